//! From layers of TOML to a checked [`Config`].

use serde_json::Value as Json;
use toml::{Table, Value};

use super::cross_checks::cross_checks;
use super::overrides::{
    OptionSetting, convert_quantities, in_terms_of_option, overlay_options, sets,
};
use super::profiles;
use super::purpose::Purpose;
use super::{Config, renamed, schema};
use bench_base::finding::Finding;
use bench_settings::check::check;
use bench_settings::files::{find, text_of};
use bench_settings::layer::{Layer, overlay, place_in, same_kind};
use bench_settings::{ConfigError, MAX_ERRORS};

/// A profile or file, and single settings that override it.
///
/// ```
/// use bench_config::{Source, load};
///
/// let sets = vec!["loop.rate_hz=1000".to_string()];
/// let config = load(&Source { sets, ..Source::default() })?;
/// assert_eq!(config.servo.period_s(), 1e-3);
/// # Ok::<(), bench_config::ConfigError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// A profile's name or the path of a TOML file; the default profile if absent.
    pub config: Option<String>,
    /// `KEY=VALUE`; a later entry overrides an earlier one.
    pub sets: Vec<String>,
    /// Settings made by command-line options, over all of `sets`.
    pub options: Vec<OptionSetting>,
    /// Purpose of the configuration.
    pub purpose: Purpose,
}

/// Loads, merges and checks a configuration.
pub fn load(source: &Source) -> Result<Config, ConfigError> {
    checked(&layers(source)?, &source.options, source.purpose)
}

/// Tables that recordings of earlier versions lack. Those versions ran a chirp, so the tables of the default profile apply.
const LATER_TABLES: [&str; 6] = [
    "excitation",
    "multisine",
    "stepped_sine",
    "prbs",
    "shape",
    "campaign",
];

/// The configuration in a recording. It is complete, except for tables that its version may not have had. Measured damping
/// ratios are not checked: earlier versions accepted all of them.
pub fn whole(name: &str, text: &str) -> Result<Config, ConfigError> {
    let mut layers = Vec::new();
    if let Some(base) = find(profiles::PROFILES, profiles::DEFAULT) {
        let mut base = Layer::embedded(base)?;
        base.table.retain(|key, _| LATER_TABLES.contains(&key));
        layers.push(base);
    }
    let mut recorded = Layer::parse(name.to_string(), text.to_string())?;
    renamed::translate(&mut recorded.table);
    layers.push(recorded);
    checked(&layers, &[], Purpose::Recorded)
}

fn checked(
    layers: &[Layer],
    options: &[OptionSetting],
    purpose: Purpose,
) -> Result<Config, ConfigError> {
    let schema = schema();
    let (merged, findings) = merge(&schema, layers, options);
    let refuse = |findings| refuse(layers, options, findings, &schema, &merged);
    refuse(findings)?;
    refuse(check(&schema, &merged, renamed::RENAMED))?;
    let typed: Result<Config, toml::de::Error> = merged.clone().try_into();
    let config = typed.map_err(|e| ConfigError::Refused(vec![e.to_string()]))?;
    refuse(cross_checks(&config, purpose))?;
    Ok(config)
}

/// All layers and options as one tree, and the errors in the quantities of `--set`.
fn merge(schema: &Json, layers: &[Layer], options: &[OptionSetting]) -> (Value, Vec<Finding>) {
    let mut merged = Table::new();
    for layer in layers {
        overlay(&mut merged, &layer.table, same_kind);
    }
    let sets = sets_of(layers);
    let mut findings = overlay_options(&mut merged, sets, options);
    let unconverted = sets.map(|sets| convert_quantities(schema, sets, &mut merged));
    findings.extend(unconverted.unwrap_or_default());
    (Value::Table(merged), findings)
}

/// The settings of `--set`.
fn sets_of(layers: &[Layer]) -> Option<&Table> {
    let sets = layers.last().filter(|layer| layer.name == Layer::SETS)?;
    Some(&sets.table)
}

/// Checks a configuration that was changed after it was loaded.
pub fn validate(config: &Config) -> Result<(), ConfigError> {
    let value = Value::try_from(config).map_err(|e| ConfigError::Refused(vec![e.to_string()]))?;
    let mut findings = check(&schema(), &value, renamed::RENAMED);
    findings.extend(cross_checks(config, Purpose::Model));
    let lines = findings
        .iter()
        .map(|f| format!("  `{}` {}", f.path, f.what));
    ConfigError::unless_empty(lines.collect())
}

fn refuse(
    layers: &[Layer],
    options: &[OptionSetting],
    findings: Vec<Finding>,
    schema: &Json,
    merged: &Value,
) -> Result<(), ConfigError> {
    let sets = sets_of(layers);
    let line = |finding: &Finding| {
        in_terms_of_option(options, sets, finding, schema, merged).unwrap_or_else(|| {
            let place = place_in(layers, finding.at());
            format!("  {place}: `{}` {}", finding.path, finding.what)
        })
    };
    let mut lines: Vec<String> = findings.iter().take(MAX_ERRORS).map(line).collect();
    // One option may set several settings.
    lines.dedup();
    ConfigError::unless_empty(lines)
}

fn layers(source: &Source) -> Result<Vec<Layer>, ConfigError> {
    let embedded = |name: &str| find(profiles::PROFILES, name);
    let base = embedded(profiles::DEFAULT).into_iter();
    let mut layers: Vec<Layer> = base.map(Layer::embedded).collect::<Result<_, _>>()?;
    let name = source.config.as_deref();
    if let Some(name) = name.filter(|name| *name != profiles::DEFAULT) {
        layers.push(match embedded(name) {
            Some(profile) => Layer::embedded(profile)?,
            None => Layer::parse(name.into(), text_of(name, profiles::PROFILES, "profile")?)?,
        });
    }
    if !source.sets.is_empty() {
        layers.push(sets(&source.sets)?);
    }
    Ok(layers)
}
