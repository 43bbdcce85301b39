//! The value of `--reference`, and the settings of each kind without other options.

use std::convert::Infallible;
use std::str::FromStr;

use clap::ValueEnum;
use serde::{Serialize, Serializer};
use toml::{Table, Value};

use bench_config::OptionSetting;

/// The table that the options of a reference change.
pub(crate) const TABLE: &str = "control.reference";

/// A setting of a reference without its option.
pub(crate) type Default = (&'static str, Value);

/// Height or amplitude without `--amplitude`.
pub(crate) const HEIGHT: Default = ("amplitude_m", Value::Float(50e-6));
/// Largest travel of a swept reference without `--amplitude`.
const TRAVEL: Default = ("travel_m", Value::Float(20e-6));
/// Frequency of a periodic reference without `--frequency`.
pub(crate) const FREQUENCY: Default = ("frequency_hz", Value::Float(1.0));
/// Highest frequency of a random reference without `--frequency`.
const HIGHEST_FREQUENCY: Default = ("frequency_hz", Value::Float(10.0));
/// Period of a random reference.
pub(crate) const PERIOD: Default = ("period_s", Value::Float(10.0));
/// Seed of a random reference.
pub(crate) const SEED: Default = ("seed", Value::Integer(1));
/// Speed of a ramp without `--speed`.
pub(crate) const SPEED: Default = ("speed_m_per_s", Value::Float(1e-4));
/// Largest speed of an s-curve without `--speed`.
const LARGEST_SPEED: Default = ("speed_m_per_s", Value::Float(1e-3));
/// Largest acceleration of an s-curve without `--acceleration`.
pub(crate) const ACCELERATION: Default = ("acceleration_m_per_s2", Value::Float(0.05));
/// Largest jerk of an s-curve without `--jerk`.
pub(crate) const JERK: Default = ("jerk_m_per_s3", Value::Float(5.0));
/// Start of the motion after the loop is closed.
const START: Default = ("at_s", Value::Float(0.2));

/// The kinds of reference that an option can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ReferenceKind {
    /// A step.
    Step,
    /// The rest position.
    Hold,
    /// A motion of constant speed.
    Ramp,
    /// A sine.
    Sine,
    /// A square wave.
    Square,
    /// A triangle wave.
    Triangle,
    /// A move with bounded speed, acceleration and jerk.
    #[value(alias = "s_curve")]
    SCurve,
    /// A random motion, limited to a band.
    Random,
    /// A sweep, for identification in closed loop.
    Chirp,
}

/// The value of `--reference`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reference {
    /// A kind by its name.
    Kind(ReferenceKind),
    /// A CSV file.
    File(String),
}

impl FromStr for Reference {
    type Err = Infallible;

    /// What is not the name of a kind is a file.
    fn from_str(text: &str) -> Result<Reference, Infallible> {
        let kind = <ReferenceKind as ValueEnum>::from_str(text, false);
        Ok(kind.map_or_else(|_| Reference::File(text.into()), Reference::Kind))
    }
}

/// As it was typed.
impl Serialize for Reference {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Reference::Kind(kind) => serializer.serialize_str(&kind.text()),
            Reference::File(path) => serializer.serialize_str(path),
        }
    }
}

impl ReferenceKind {
    fn name(self) -> &'static str {
        match self {
            ReferenceKind::Step => "step",
            ReferenceKind::Hold => "hold",
            ReferenceKind::Ramp => "ramp",
            ReferenceKind::Sine => "sine",
            ReferenceKind::Square => "square",
            ReferenceKind::Triangle => "triangle",
            ReferenceKind::SCurve => "s_curve",
            ReferenceKind::Random => "random",
            ReferenceKind::Chirp => "chirp",
        }
    }

    /// The name on the command line.
    fn text(self) -> String {
        let value = self.to_possible_value();
        value.map_or(String::new(), |value| value.get_name().to_string())
    }

    /// Its settings without other options.
    fn defaults(self) -> Vec<Default> {
        match self {
            ReferenceKind::Step => vec![HEIGHT, START],
            ReferenceKind::Hold => vec![],
            ReferenceKind::Ramp => vec![HEIGHT, START, SPEED],
            ReferenceKind::Sine | ReferenceKind::Triangle => vec![HEIGHT, FREQUENCY],
            ReferenceKind::Square => vec![HEIGHT, FREQUENCY, START],
            ReferenceKind::SCurve => vec![HEIGHT, LARGEST_SPEED, ACCELERATION, JERK, START],
            ReferenceKind::Random => vec![HEIGHT, HIGHEST_FREQUENCY, PERIOD, SEED],
            ReferenceKind::Chirp => vec![TRAVEL],
        }
    }

    /// Whether it has a setting.
    pub(crate) fn has(self, key: &str) -> bool {
        self.defaults().iter().any(|(name, _)| *name == key)
    }

    /// The key of `--amplitude`.
    pub(crate) fn amplitude_key(self) -> &'static str {
        match self {
            ReferenceKind::Chirp => TRAVEL.0,
            _ => HEIGHT.0,
        }
    }
}

/// The names of the kinds that fulfil a condition: `step, ramp or sine`.
pub(crate) fn names(condition: impl Fn(ReferenceKind) -> bool) -> String {
    let kinds = ReferenceKind::value_variants().iter();
    let values = kinds
        .filter(|kind| condition(**kind))
        .filter_map(ReferenceKind::to_possible_value);
    let names: Vec<String> = values.map(|value| value.get_name().to_string()).collect();
    match names.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

impl Reference {
    /// The whole table with default values; the other options replace them.
    pub(crate) fn setting(&self) -> OptionSetting {
        let (kind, mut table) = match self {
            Reference::File(path) => {
                let path = ("path".to_string(), Value::String(path.clone()));
                ("file", Table::from_iter([path]))
            }
            Reference::Kind(kind) => {
                let defaults = kind.defaults().into_iter();
                let entries = defaults.map(|(key, value)| (key.to_string(), value));
                (kind.name(), entries.collect())
            }
        };
        table.insert("kind".into(), Value::String(kind.into()));
        OptionSetting::new(TABLE, table, format!("--reference {kind}"))
    }
}
