//! From layers of TOML to a checked [`Config`].

use std::path::{Path, PathBuf};

use serde_json::Value as Json;
use toml::{Table, Value};

use super::check;
use super::layer::{Layer, lay, same_kind};
use super::overrides::{
    OptionSetting, convert_quantities, in_terms_of_option, options_table, sets,
};
use super::place::line_of;
use super::profiles::{self, EmbeddedFile};
use super::{Config, IdentifySettings, ReferenceSettings, TravelPoint, excited, relations, schema};
use crate::util::finding::Finding;

/// Longest excitation in ticks, over an hour at 5 kHz: it is analysed as one record, in some 80 bytes a tick.
const CHIRP_TICKS: f64 = 2e7;

/// What a person asked for: a profile or file, and single settings over it.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// A profile's name or the path of a TOML file; the default profile if absent.
    pub config: Option<String>,
    /// `KEY=VALUE`, the later one wins.
    pub sets: Vec<String>,
    /// Settings that command-line options stand for, over all of `sets`.
    pub options: Vec<OptionSetting>,
    /// What it is for.
    pub purpose: Purpose,
}

/// What a configuration is for: relations between settings that a command does not use do not stand in its way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Purpose {
    /// Models, margins, replay.
    #[default]
    Model,
    /// An excitation.
    Chirp,
    /// A closed loop.
    Control,
    /// Whatever may come.
    All,
}

impl Purpose {
    fn includes(self, other: Purpose) -> bool {
        self == other || self == Purpose::All
    }
}

/// Why a configuration is refused. Nothing has moved yet when it is.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConfigError {
    /// Neither a profile nor a file.
    #[error("no {what} and no file is called `{name}`; {}a file is named with its path", if known.is_empty() { String::new() } else { format!("there are {known}; ") })]
    NotFound {
        /// Profile or controller.
        what: &'static str,
        /// What was asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// The file is there but cannot be read.
    #[error("cannot read {path}: {why}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's words.
        why: String,
    },
    /// The text is not TOML.
    #[error("{place} is not TOML: {why}")]
    Syntax {
        /// File or flag.
        place: String,
        /// The parser's words, with line and column.
        why: String,
    },
    /// Keys, types, ranges or their combination are wrong.
    #[error("refused:\n{}", .0.join("\n"))]
    Refused(
        /// A line a finding, with its place.
        Vec<String>,
    ),
}

impl ConfigError {
    /// The file, line or option that is wrong; of several the first.
    pub fn place(&self) -> Option<String> {
        match self {
            ConfigError::NotFound { name, .. } => Some(name.clone()),
            ConfigError::Unreadable { path, .. } => Some(path.display().to_string()),
            ConfigError::Syntax { place, .. } => Some(place.clone()),
            ConfigError::Refused(findings) => {
                let (place, _) = findings.first()?.split_once(": `")?;
                Some(place.trim().to_string())
            }
        }
    }
}

/// Loads, merges and checks a configuration.
pub fn load(source: &Source) -> Result<Config, ConfigError> {
    checked(&layers(source)?, &source.options, source.purpose)
}

/// Tables that recordings of earlier versions lack, which ran a chirp: they are those of the default profile.
const LATER: [&str; 6] = [
    "excitation",
    "multisine",
    "stepped_sine",
    "prbs",
    "shape",
    "campaign",
];

/// The configuration that travels with a recording: whole, over nothing but the tables that are newer than it may be.
pub fn whole(name: &str, text: &str) -> Result<Config, ConfigError> {
    let mut layers = Vec::new();
    if let Some(base) = profiles::find(profiles::PROFILES, profiles::DEFAULT) {
        let mut base = Layer::parse(format!("profile {}", base.name), base.text.to_string())?;
        base.table.retain(|key, _| LATER.contains(&key));
        layers.push(base);
    }
    layers.push(Layer::parse(name.to_string(), text.to_string())?);
    checked(&layers, &[], Purpose::Model)
}

fn checked(
    layers: &[Layer],
    options: &[OptionSetting],
    purpose: Purpose,
) -> Result<Config, ConfigError> {
    let schema = schema();
    let mut merged = Table::new();
    for layer in layers {
        lay(&mut merged, &layer.table, same_kind);
    }
    lay(&mut merged, &options_table(options), same_kind);
    let sets = layers.last().filter(|layer| layer.name == Layer::SETS);
    let findings = sets.map(|sets| convert_quantities(&schema, &sets.table, &mut merged));
    let merged = Value::Table(merged);
    let refuse = |findings| refuse(layers, options, findings, &schema, &merged);
    refuse(findings.unwrap_or_default())?;
    refuse(check::check(&schema, &merged))?;
    let typed: Result<Config, toml::de::Error> = merged.clone().try_into();
    let config = typed.map_err(|e| ConfigError::Refused(vec![e.to_string()]))?;
    refuse(cross_checks(&config, purpose))?;
    Ok(config)
}

/// Checks a configuration that was changed after it was loaded.
pub(crate) fn validate(config: &Config) -> Result<(), ConfigError> {
    let value = Value::try_from(config).map_err(|e| ConfigError::Refused(vec![e.to_string()]))?;
    let mut findings = check::check(&schema(), &value);
    findings.extend(cross_checks(config, Purpose::Model));
    let lines: Vec<String> = findings
        .iter()
        .map(|f| format!("  `{}` {}", f.path, f.what))
        .collect();
    if lines.is_empty() {
        Ok(())
    } else {
        Err(ConfigError::Refused(lines))
    }
}

fn refuse(
    layers: &[Layer],
    options: &[OptionSetting],
    findings: Vec<Finding>,
    schema: &Json,
    merged: &Value,
) -> Result<(), ConfigError> {
    let line = |finding: &Finding| {
        in_terms_of_option(options, finding, schema, merged).unwrap_or_else(|| {
            let place = place(layers, finding.at());
            format!("  {place}: `{}` {}", finding.path, finding.what)
        })
    };
    let mut lines: Vec<String> = findings.iter().map(line).collect();
    // One option may stand for several settings.
    lines.dedup();
    match lines.is_empty() {
        true => Ok(()),
        false => Err(ConfigError::Refused(lines)),
    }
}

/// The last layer that sets `path`, with the line; or the last layer that sets something around it.
fn place(layers: &[Layer], path: &str) -> String {
    let mut path = path;
    loop {
        for layer in layers.iter().rev() {
            if let Some(line) = line_of(&layer.text, path) {
                return if layer.name == Layer::SETS {
                    layer.name.clone()
                } else {
                    format!("{} line {line}", layer.name)
                };
            }
        }
        match path.rsplit_once('.') {
            Some((outer, _)) => path = outer,
            None => {
                return layers
                    .last()
                    .map_or("the configuration".into(), |layer| layer.name.clone());
            }
        }
    }
}

fn layers(source: &Source) -> Result<Vec<Layer>, ConfigError> {
    let embedded = |name: &str| profiles::find(profiles::PROFILES, name);
    let mut layers = Vec::new();
    if let Some(base) = embedded(profiles::DEFAULT) {
        layers.push(Layer::parse(
            format!("profile {}", base.name),
            base.text.to_string(),
        )?);
    }
    match source.config.as_deref() {
        None | Some(profiles::DEFAULT) => {}
        Some(name) => match embedded(name) {
            Some(profile) => layers.push(Layer::parse(
                format!("profile {name}"),
                profile.text.to_string(),
            )?),
            None => layers.push(Layer::parse(
                name.to_string(),
                read(name, profiles::PROFILES, "profile")?,
            )?),
        },
    }
    if !source.sets.is_empty() {
        layers.push(sets(&source.sets)?);
    }
    Ok(layers)
}

fn read(name: &str, known: &[EmbeddedFile], what: &'static str) -> Result<String, ConfigError> {
    let path = Path::new(name);
    if !path.exists() {
        return Err(ConfigError::NotFound {
            what,
            name: name.into(),
            known: profiles::names(known),
        });
    }
    std::fs::read_to_string(path).map_err(|e| ConfigError::Unreadable {
        path: path.into(),
        why: e.to_string(),
    })
}

/// The text of an embedded file by its name, or of any file by its path.
pub(crate) fn text_of(
    name: &str,
    known: &[EmbeddedFile],
    what: &'static str,
) -> Result<String, ConfigError> {
    match profiles::find(known, name) {
        Some(embedded) => Ok(embedded.text.to_string()),
        None => read(name, known, what),
    }
}

/// The text of a file by its path.
pub(crate) fn text_of_file(name: &str, what: &'static str) -> Result<String, ConfigError> {
    read(name, &[], what)
}

/// TOML of a type of its own, checked against the type's schema.
pub(crate) fn typed<T>(name: &str, text: &str) -> Result<T, ConfigError>
where
    T: serde::de::DeserializeOwned + schemars::JsonSchema,
{
    let layer = Layer::parse(name.to_string(), text.to_string())?;
    let schema = schemars::schema_for!(T).to_value();
    let value = Value::Table(layer.table.clone());
    let findings = check::check(&schema, &value);
    refuse(std::slice::from_ref(&layer), &[], findings, &schema, &value)?;
    let typed: Result<T, toml::de::Error> = value.try_into();
    typed.map_err(|e: toml::de::Error| ConfigError::Refused(vec![format!("  {name}: {e}")]))
}

/// What no single setting can say: relations between settings.
fn cross_checks(config: &Config, purpose: Purpose) -> Vec<Finding> {
    let mut relations = Relations(relations::plant(config));
    relations.rig(config);
    let swept = matches!(config.control.reference, ReferenceSettings::Chirp { .. });
    if purpose.includes(Purpose::Chirp) || swept && purpose.includes(Purpose::Control) {
        relations.chirp(config);
        relations.identify(config);
    }
    if purpose.includes(Purpose::Control) {
        relations.control(config);
    }
    relations.0
}

struct Relations(Vec<Finding>);

impl Relations {
    fn must(&mut self, good: bool, path: &str, what: String) {
        if !good {
            self.0.push(Finding {
                path: path.into(),
                what,
                missing: false,
            });
        }
    }

    fn rig(&mut self, config: &Config) {
        let (soft_m, stop_m, seen_m) = (
            config.interlock.soft_limit_m,
            config.sim.stop_m,
            config.probe.range_m / 2.0,
        );
        let path = "interlock.soft_limit_m";
        self.must(
            soft_m < stop_m,
            path,
            format!("is {soft_m} m; it must lie inside the stop at {stop_m} m"),
        );
        self.must(
            soft_m <= seen_m,
            path,
            format!(
                "is {soft_m} m, beyond what the probe sees, {seen_m} m (half of probe.range_m)"
            ),
        );
        let (continuous_n, peak_n) = (config.motor.continuous_force_n, config.motor.peak_force_n);
        let what = format!("is {continuous_n} N, above the peak force of {peak_n} N");
        self.must(continuous_n <= peak_n, "motor.continuous_force_n", what);
        let (stale_s, period_s) = (config.interlock.probe_stale_s, config.servo.period_s());
        let what = format!("is {stale_s} s, shorter than a tick of {period_s} s");
        self.must(stale_s >= period_s, "interlock.probe_stale_s", what);
        let oldest_s = config.probe.age_at_arrival_s()
            + config.probe.rate_hz.map_or(0.0, |rate_hz| 1.0 / rate_hz);
        let what = format!(
            "is {stale_s} s, but a reading may be {oldest_s} s old before the next one (probe.latency_s, transport_s, rate_hz)"
        );
        self.must(stale_s > oldest_s, "interlock.probe_stale_s", what);
    }

    fn chirp(&mut self, config: &Config) {
        let (chirp, nyquist_hz) = (&config.chirp, config.servo.rate_hz / 2.0);
        let (start_hz, stop_hz) = (chirp.start_hz, chirp.stop_hz);
        let what = format!(
            "is {stop_hz} Hz, but the sweep starts at {start_hz} Hz; a sweep needs two frequencies"
        );
        self.must(start_hz != stop_hz, "chirp.stop_hz", what);
        for (path, hz) in [("chirp.start_hz", start_hz), ("chirp.stop_hz", stop_hz)] {
            let what =
                format!("is {hz} Hz; it must stay below half the servo rate, {nyquist_hz} Hz");
            self.must(hz < nyquist_hz, path, what);
            let seen_hz = config.probe.rate_hz.unwrap_or(f64::INFINITY) / 2.0;
            let what =
                format!("is {hz} Hz; the probe sees frequencies below half its rate, {seen_hz} Hz");
            self.must(hz < seen_hz, path, what);
        }
        let (ticks, path, value) = excited::ticks(config);
        let unit = if path.ends_with("_s") { " s" } else { "" };
        let what = format!(
            "is {value}{unit}, with the quiet before and after {ticks} ticks; {CHIRP_TICKS} can be analysed as one record: shorten it or lower loop.rate_hz"
        );
        self.must(ticks <= CHIRP_TICKS, path, what);
        self.0.extend(excited::excitation(config));
        let fades_s = chirp.fade_in_s + chirp.fade_out_s;
        let what = format!(
            "is {} s, shorter than both fades, {fades_s} s",
            chirp.duration_s
        );
        self.must(fades_s <= chirp.duration_s, "chirp.duration_s", what);
        let rising = chirp
            .amplitude
            .windows(2)
            .all(|pair| pair[0].frequency_hz < pair[1].frequency_hz);
        self.must(
            rising,
            "chirp.amplitude",
            "has frequencies that do not rise from point to point".into(),
        );
    }

    /// A swept reference.
    fn swept(&mut self, config: &Config, amplitude: &[TravelPoint], travel_m: f64) {
        let soft_m = config.interlock.soft_limit_m;
        let largest_m = amplitude
            .iter()
            .map(|point| point.amplitude_m)
            .fold(travel_m, f64::max);
        let what = format!(
            "reaches {largest_m} m, beyond the soft limit of {soft_m} m (interlock.soft_limit_m)"
        );
        self.must(largest_m <= soft_m, "control.reference", what);
        let rising = amplitude
            .windows(2)
            .all(|pair| pair[0].frequency_hz < pair[1].frequency_hz);
        let what = "has frequencies that do not rise from point to point";
        self.must(rising, "control.reference.amplitude", what.into());
    }

    fn identify(&mut self, config: &Config) {
        let IdentifySettings::Local(local) = &config.identify else {
            return;
        };
        let rising = local
            .resolution
            .windows(2)
            .all(|pair| pair[0].frequency_hz < pair[1].frequency_hz);
        self.must(
            rising,
            "identify.resolution",
            "has frequencies that do not rise from point to point".into(),
        );
    }

    fn control(&mut self, config: &Config) {
        let nyquist_hz = config.servo.rate_hz / 2.0;
        let path = "control.reference.amplitude_m";
        let soft_m = config.interlock.soft_limit_m;
        match config.control.reference {
            ReferenceSettings::Step { amplitude_m, .. }
            | ReferenceSettings::Ramp { amplitude_m, .. }
            | ReferenceSettings::Sine { amplitude_m, .. } => {
                let what = format!(
                    "is {amplitude_m} m, beyond the soft limit of {soft_m} m (interlock.soft_limit_m)"
                );
                self.must(amplitude_m.abs() <= soft_m, path, what);
            }
            ReferenceSettings::Chirp {
                ref amplitude,
                travel_m,
            } => {
                self.swept(config, amplitude, travel_m);
            }
            ReferenceSettings::Hold | ReferenceSettings::File { .. } => {}
        }
        if let ReferenceSettings::Sine { frequency_hz, .. } = config.control.reference {
            let what = format!(
                "is {frequency_hz} Hz; it must stay below half the servo rate, {nyquist_hz} Hz"
            );
            self.must(
                frequency_hz < nyquist_hz,
                "control.reference.frequency_hz",
                what,
            );
        }
    }
}
