//! Options of `bench control`, and the settings that they change.

use std::path::Path;

use clap::ValueEnum;
use toml::{Table, Value};

use super::controller_choice::ControllerChoice;
use super::error::CliError;
use super::help::{default_value, with_setting};
use super::options::{BenchOptions, given};
use super::run_options::RunOptions;
use crate::config::OptionSetting;
use crate::experiment::certificate::OverrideReason;
use crate::util::quantity::{Frequency, Length, Speed, Time};

/// Height of a step or ramp and amplitude of a sine without `--amplitude`.
const HEIGHT: (&str, f64) = ("amplitude_m", 50e-6);
/// Largest travel of a swept reference without `--amplitude`.
const TRAVEL: (&str, f64) = ("travel_m", 20e-6);
/// Frequency of a sine without `--frequency`.
const FREQUENCY: (&str, f64) = ("frequency_hz", 1.0);
/// Speed of a ramp without `--speed`.
const SPEED: (&str, f64) = ("speed_m_per_s", 1e-4);
/// Start of a step or ramp after the loop is closed.
const START: (&str, f64) = ("at_s", 0.2);

const AMPLITUDE_KEY: &str = "control.reference.amplitude_m";
const TRAVEL_KEY: &str = "control.reference.travel_m";
const FREQUENCY_KEY: &str = "control.reference.frequency_hz";
const SPEED_KEY: &str = "control.reference.speed_m_per_s";

/// The loop and its reference.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = defaults_help())]
pub(super) struct Args {
    #[command(flatten)]
    pub bench: BenchOptions,
    #[command(flatten)]
    choice: ControllerChoice,
    #[command(flatten)]
    pub run: RunOptions,
    /// Reference signal: step, hold (constant rest position), ramp, sine, chirp (identification in closed loop), or a CSV
    /// file with the columns
    /// time_s,reference_m [default: control.reference of the profile]
    #[arg(long, value_name = "step|hold|ramp|sine|chirp|FILE", value_parser = reference)]
    reference: Option<Reference>,
    /// Height of step and ramp, amplitude of the sine [default: 50um]; for a chirp: largest travel
    /// predicted by the model
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
    /// Certificate of a chirp (`*_certificate.json`): the evidence that devices, load and controller belong together. On devices a
    /// loop closes only with one [default: control.certificate; none]
    #[arg(long, value_name = "FILE")]
    certificate: Option<String>,
    /// Close the loop on devices although the certificate is missing or does not fit; the reason (at least 10 characters) is
    /// recorded. A loop that is unstable by the model is refused nevertheless
    #[arg(long = "override", value_name = "REASON")]
    pub override_reason: Option<OverrideReason>,
    /// Only print what the run would do: margins, travel, current, heat, duration; no motion
    #[arg(long)]
    pub plan: bool,
}

fn duration_help() -> String {
    let sweep = default_value("chirp.duration_s").unwrap_or_default();
    let closed = with_setting("Time with the loop closed", "control.duration_s");
    format!("{closed}; for a chirp: length of the sweep [default: chirp.duration_s; {sweep}]")
}

fn defaults_help() -> String {
    let value = |key| default_value(key).unwrap_or_default();
    format!(
        "Without options, in the profile `stage`: {} controller; reference: {} of {}, {} after the loop is closed; the loop is closed for {}.",
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

/// The value of `--reference`.
#[derive(Clone, Debug)]
enum Reference {
    Kind(ReferenceKind),
    File(String),
}

impl ReferenceKind {
    fn name(self) -> &'static str {
        match self {
            ReferenceKind::Step => "step",
            ReferenceKind::Hold => "hold",
            ReferenceKind::Ramp => "ramp",
            ReferenceKind::Sine => "sine",
            ReferenceKind::Chirp => "chirp",
        }
    }

    /// Its settings without other options.
    fn defaults(self) -> &'static [(&'static str, f64)] {
        match self {
            ReferenceKind::Step => &[HEIGHT, START],
            ReferenceKind::Hold => &[],
            ReferenceKind::Ramp => &[HEIGHT, START, SPEED],
            ReferenceKind::Sine => &[HEIGHT, FREQUENCY],
            ReferenceKind::Chirp => &[TRAVEL],
        }
    }
}

impl Reference {
    /// The whole table with default values; the other options replace them.
    fn setting(&self) -> OptionSetting {
        let (kind, mut table) = match self {
            Reference::File(path) => {
                let path = ("path".to_string(), Value::String(path.clone()));
                ("file", Table::from_iter([path]))
            }
            Reference::Kind(kind) => {
                let defaults = kind.defaults().iter();
                let entries = defaults.map(|(key, si)| (key.to_string(), Value::Float(*si)));
                (kind.name(), entries.collect())
            }
        };
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
            "neither a kind of reference nor a file: {error}; choose step, hold, ramp, sine, chirp, or a file"
        )),
    }
}

impl Args {
    /// The settings that the options change.
    pub fn settings(&self) -> Result<Vec<OptionSetting>, CliError> {
        self.refuse_unused()?;
        let mut settings = self.choice.settings();
        settings.extend(self.reference.as_ref().map(Reference::setting));
        let (amplitude_key, duration_key) = match self.kind() {
            Some(ReferenceKind::Chirp) => (TRAVEL_KEY, "chirp.duration_s"),
            _ => (AMPLITUDE_KEY, "control.duration_s"),
        };
        let options = [
            given(amplitude_key, "--amplitude", self.amplitude.as_ref()),
            given(duration_key, "--duration", self.duration.as_ref()),
            given(FREQUENCY_KEY, "--frequency", self.frequency.as_ref()),
            given(SPEED_KEY, "--speed", self.speed.as_ref()),
        ];
        settings.extend(options.into_iter().flatten());
        settings.extend(self.certificate.as_deref().map(certificate_setting));
        settings.extend(self.run.seed.setting());
        Ok(settings)
    }

    fn kind(&self) -> Option<ReferenceKind> {
        match self.reference {
            Some(Reference::Kind(kind)) => Some(kind),
            _ => None,
        }
    }

    /// Refuses an option that the reference does not use.
    fn refuse_unused(&self) -> Result<(), CliError> {
        let is_file = matches!(self.reference, Some(Reference::File(_)));
        let kind = self.kind();
        if self.amplitude.is_some() && (is_file || kind == Some(ReferenceKind::Hold)) {
            return Err(unused("--amplitude", "step, ramp, sine or chirp"));
        }
        if self.frequency.is_some() && kind != Some(ReferenceKind::Sine) {
            return Err(unused("--frequency", "sine"));
        }
        if self.speed.is_some() && kind != Some(ReferenceKind::Ramp) {
            return Err(unused("--speed", "ramp"));
        }
        Ok(())
    }
}

fn certificate_setting(file: &str) -> OptionSetting {
    let option = format!("--certificate {file}");
    OptionSetting::new("control.certificate", file, option)
}

fn unused(option: &str, kinds: &str) -> CliError {
    CliError::Usage(format!(
        "{option} is valid only with --reference {kinds}; leave it out, or choose such a reference"
    ))
}
