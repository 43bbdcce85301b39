//! Options of `bench control`, and the settings that they stand for.

use std::path::Path;

use clap::ValueEnum;
use toml::{Table, Value};

use super::controller_choice::ControllerChoice;
use super::error::CliError;
use super::help::{default_value, with_setting};
use super::options::BenchOptions;
use super::run_options::RunOptions;
use crate::config::OptionSetting;
use crate::util::quantity::{Frequency, Length, Speed, Time};

/// Height of a step or ramp and amplitude of a sine without `--amplitude`, in metres.
const AMPLITUDE_M: f64 = 50e-6;
/// Largest travel of a swept reference without `--amplitude`, in metres.
const TRAVEL_M: f64 = 20e-6;
/// Frequency of a sine without `--frequency`, in hertz.
const FREQUENCY_HZ: f64 = 1.0;
/// Speed of a ramp without `--speed`, in metres per second.
const SPEED_M_PER_S: f64 = 1e-4;
/// Start of a step or ramp after the loop closed, in seconds.
const START_S: f64 = 0.2;

/// Which loop, and what it follows.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = what_happens_without_options())]
pub(super) struct Args {
    #[command(flatten)]
    pub bench: BenchOptions,
    #[command(flatten)]
    choice: ControllerChoice,
    #[command(flatten)]
    pub run: RunOptions,
    /// What to follow: step, hold, ramp, sine, chirp (identification in closed loop), or a CSV file with the columns
    /// time_s,reference_m [default: control.reference of the profile]
    #[arg(long, value_name = "step|hold|ramp|sine|chirp|FILE", value_parser = reference)]
    reference: Option<Reference>,
    /// Height of step and ramp, amplitude of the sine [default: 50um]; for a chirp: largest travel by the model
    /// [default: 20um]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    amplitude: Option<Length>,
    /// Frequency of the sine [default: 1Hz]
    #[arg(long, value_name = "FREQUENCY", allow_hyphen_values = true)]
    frequency: Option<Frequency>,
    /// Speed of the ramp [default: 0.1mm/s]
    #[arg(long, value_name = "SPEED", allow_hyphen_values = true)]
    speed: Option<Speed>,
    /// Time with the loop closed; of a chirp the length of its sweep
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, help = duration_help())]
    duration: Option<Time>,
}

fn duration_help() -> String {
    let sweep = default_value("chirp.duration_s").unwrap_or_default();
    let closed = with_setting("Time with the loop closed", "control.duration_s");
    format!("{closed}; for a chirp: length of the sweep [default: chirp.duration_s; {sweep}]")
}

fn what_happens_without_options() -> String {
    let value = |key| default_value(key).unwrap_or_default();
    format!(
        "Without options, in the profile `stage`: the {} controller follows a {} of {} at {} after the loop closed, for {} in all.",
        value("control.controller"),
        value("control.reference.kind"),
        value("control.reference.amplitude_m"),
        value("control.reference.at_s"),
        value("control.duration_s"),
    )
}

/// The kinds of reference that an option can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ReferenceKind {
    Step,
    Hold,
    Ramp,
    Sine,
    Chirp,
}

/// What follows `--reference`.
#[derive(Clone, Debug)]
enum Reference {
    Kind(ReferenceKind),
    File(String),
}

impl Reference {
    /// The whole table with default values; the other options replace them.
    fn setting(&self) -> OptionSetting {
        let number = |key: &str, value| (key.to_string(), Value::Float(value));
        let word = |key: &str, text: &str| (key.to_string(), Value::String(text.into()));
        let height = number("amplitude_m", AMPLITUDE_M);
        let start = number("at_s", START_S);
        let (kind, entries) = match self {
            Reference::File(path) => ("file", vec![word("path", path)]),
            Reference::Kind(ReferenceKind::Hold) => ("hold", Vec::new()),
            Reference::Kind(ReferenceKind::Step) => ("step", vec![height, start]),
            Reference::Kind(ReferenceKind::Ramp) => {
                let speed = number("speed_m_per_s", SPEED_M_PER_S);
                ("ramp", vec![height, start, speed])
            }
            Reference::Kind(ReferenceKind::Sine) => {
                ("sine", vec![height, number("frequency_hz", FREQUENCY_HZ)])
            }
            Reference::Kind(ReferenceKind::Chirp) => ("chirp", vec![number("travel_m", TRAVEL_M)]),
        };
        let mut table = Table::from_iter(entries);
        table.insert("kind".into(), Value::String(kind.into()));
        OptionSetting::new("control.reference", table, format!("--reference {kind}"))
    }
}

fn reference(text: &str) -> Result<Reference, String> {
    if let Ok(kind) = ReferenceKind::from_str(text, false) {
        return Ok(Reference::Kind(kind));
    }
    match std::fs::metadata(Path::new(text)) {
        Ok(_) => Ok(Reference::File(text.into())),
        Err(error) => Err(format!(
            "neither a kind of reference nor a file: {error}; the kinds are step, hold, ramp, sine, chirp"
        )),
    }
}

impl Args {
    /// The settings that the options stand for.
    pub fn settings(&self) -> Result<Vec<OptionSetting>, CliError> {
        self.refuse_unused()?;
        let mut settings = self.choice.settings();
        settings.extend(self.reference.as_ref().map(Reference::setting));
        settings.extend(self.amplitude_setting());
        settings.extend(self.duration_setting());
        if let Some(frequency) = &self.frequency {
            let option = format!("--frequency {frequency}");
            let key = "control.reference.frequency_hz";
            settings.push(OptionSetting::new(key, frequency.si(), option));
        }
        if let Some(speed) = &self.speed {
            let option = format!("--speed {speed}");
            let key = "control.reference.speed_m_per_s";
            settings.push(OptionSetting::new(key, speed.si(), option));
        }
        Ok(settings)
    }

    fn kind(&self) -> Option<ReferenceKind> {
        match self.reference {
            Some(Reference::Kind(kind)) => Some(kind),
            _ => None,
        }
    }

    fn amplitude_setting(&self) -> Option<OptionSetting> {
        let amplitude = self.amplitude.as_ref()?;
        let key = match self.kind() {
            Some(ReferenceKind::Chirp) => "control.reference.travel_m",
            _ => "control.reference.amplitude_m",
        };
        let option = format!("--amplitude {amplitude}");
        Some(OptionSetting::new(key, amplitude.si(), option))
    }

    fn duration_setting(&self) -> Option<OptionSetting> {
        let duration = self.duration.as_ref()?;
        let key = match self.kind() {
            Some(ReferenceKind::Chirp) => "chirp.duration_s",
            _ => "control.duration_s",
        };
        let option = format!("--duration {duration}");
        Some(OptionSetting::new(key, duration.si(), option))
    }

    /// Refuses an option that the reference has no use for.
    fn refuse_unused(&self) -> Result<(), CliError> {
        let is_file = matches!(self.reference, Some(Reference::File(_)));
        let has_amplitude = !is_file && self.kind() != Some(ReferenceKind::Hold);
        let is_sine = self.kind() == Some(ReferenceKind::Sine);
        let is_ramp = self.kind() == Some(ReferenceKind::Ramp);
        let unused = [
            (
                self.amplitude.is_some() && !has_amplitude,
                "--amplitude",
                "step, ramp, sine or chirp",
            ),
            (self.frequency.is_some() && !is_sine, "--frequency", "sine"),
            (self.speed.is_some() && !is_ramp, "--speed", "ramp"),
        ];
        match unused.iter().find(|(is_unused, ..)| *is_unused) {
            Some((_, option, kinds)) => Err(CliError::Usage(format!(
                "{option} goes with --reference {kinds} only"
            ))),
            None => Ok(()),
        }
    }
}
