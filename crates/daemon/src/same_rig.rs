//! Whether an order is for the rig of the daemon.

use toml::Value;

use bench_config::Config;
use bench_experiment::{ExperimentError, Stage};

/// The tables of the settings that belong to the devices. The daemon answers for their limits, so that an order cannot change them.
const TABLES: [&str; 5] = ["loop", "motor", "amplifier", "probe", "interlock"];

/// Refuses an order for another rig, or for other limits of the same devices. On a simulated stage an order may change everything.
///
/// # Errors
/// With the first setting that differs.
pub fn require_same_rig(own: &Config, ordered: &Config) -> Result<(), ExperimentError> {
    match (Stage::of(own), Stage::of(ordered)) {
        (Stage::Simulated, Stage::Simulated) => Ok(()),
        (Stage::Devices, Stage::Devices) => match first_difference(own, ordered)? {
            None => Ok(()),
            Some(difference) => Err(ExperimentError::Refused(difference)),
        },
        (Stage::Simulated, Stage::Devices) => Err(ExperimentError::Refused(
            "the daemon runs the simulated stage, and the configuration of this command names devices; start the daemon with that configuration, or add --connect none".into(),
        )),
        (Stage::Devices, Stage::Simulated) => Err(ExperimentError::Refused(
            "the daemon runs devices, and the configuration of this command is the simulated stage; add --connect none".into(),
        )),
    }
}

/// The first setting of the devices that differs, as text.
fn first_difference(own: &Config, ordered: &Config) -> Result<Option<String>, ExperimentError> {
    let (own, ordered) = (table(own)?, table(ordered)?);
    let found = TABLES.iter().find_map(|name| {
        let (own, ordered) = (own.get(name)?, ordered.get(name)?);
        difference(name, own, ordered)
    });
    Ok(found.map(|(key, own, ordered)| {
        format!(
            "{key} is {ordered} in this command, but {own} in the daemon that owns the devices; leave it out, or change the configuration of the daemon"
        )
    }))
}

fn table(config: &Config) -> Result<Value, ExperimentError> {
    let made = Value::try_from(config);
    made.map_err(|error| {
        ExperimentError::Failed(format!(
            "the configuration cannot be compared: {error}; report this with the configuration"
        ))
    })
}

/// The path of the first difference with both values.
fn difference(path: &str, own: &Value, ordered: &Value) -> Option<(String, String, String)> {
    let (Value::Table(own), Value::Table(ordered)) = (own, ordered) else {
        let differs = own != ordered;
        return differs.then(|| (path.into(), own.to_string(), ordered.to_string()));
    };
    let keys = own.keys().chain(ordered.keys());
    let absent = Value::String("not set".into());
    let mut pairs = keys.map(|key| {
        let (own, ordered) = (own.get(key), ordered.get(key));
        (key, own.unwrap_or(&absent), ordered.unwrap_or(&absent))
    });
    pairs.find_map(|(key, own, ordered)| difference(&format!("{path}.{key}"), own, ordered))
}
