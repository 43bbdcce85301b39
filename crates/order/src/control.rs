//! The order of a closed loop, and the settings that it changes.

use clap::ValueEnum;
use schemars::JsonSchema;
use serde::Serialize;
use toml::{Table, Value};

use super::bench_options::{BenchOptions, given};
use super::controller_choice::ControllerChoice;
use super::help::{default_value, with_setting};
use super::reference::{
    ACCELERATION, FREQUENCY, HEIGHT, JERK, PERIOD, Reference, ReferenceKind, SEED, SPEED, TABLE,
    names,
};
use super::rig_options::RigOptions;
use bench_base::quantity::{Acceleration, Frequency, Jerk, Length, Measure, Ratio, Speed, Time};
use bench_config::{Config, OptionSetting, Purpose};
use bench_experiment::ExperimentError;
use bench_experiment::certificate::OverrideReason;

const OVERSHOOT_KEY: &str = "control.shaper.max_overshoot_ratio";
const PREFILTER_KEY: &str = "control.prefilter.frequency_hz";

/// The loop and its reference.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, JsonSchema)]
pub struct ControlOrder {
    /// The bench.
    #[command(flatten)]
    #[serde(flatten)]
    pub bench: BenchOptions,
    /// The controller.
    #[command(flatten)]
    #[serde(flatten)]
    pub choice: ControllerChoice,
    /// Rig and pace.
    #[command(flatten)]
    #[serde(flatten)]
    pub rig: RigOptions,
    /// Reference: step, hold (rest position), ramp, sine, square, triangle, s-curve (move with bounded speed, acceleration and
    /// jerk), random (limited to a band), chirp (identification in closed loop), or a CSV file with the columns
    /// time_s,reference_m [default: control.reference of the profile]
    #[arg(long, value_name = "KIND|FILE")]
    #[schemars(with = "Option<String>")]
    pub reference: Option<Reference>,
    /// Height of step, ramp and s-curve, amplitude of sine, square and triangle, largest position of random
    /// [default: 50um]; for a chirp: largest travel predicted by the model [default: 20um]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub amplitude: Option<Length>,
    /// Frequency of sine, square and triangle [default: 1Hz]; for random: highest frequency [default: 10Hz]
    #[arg(long, value_name = "FREQUENCY", allow_hyphen_values = true)]
    pub frequency: Option<Frequency>,
    /// Speed of the ramp [default: 0.1mm/s]; for an s-curve: largest speed [default: 1mm/s]
    #[arg(long, value_name = "SPEED", allow_hyphen_values = true)]
    pub speed: Option<Speed>,
    /// Largest acceleration of the s-curve [default: 50mm/s^2]
    #[arg(long, value_name = "ACCELERATION", allow_hyphen_values = true)]
    pub acceleration: Option<Acceleration>,
    /// Largest jerk of the s-curve [default: 5m/s^3]
    #[arg(long, value_name = "JERK", allow_hyphen_values = true)]
    pub jerk: Option<Jerk>,
    /// Time after which the random reference repeats [default: 10s]
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub period: Option<Time>,
    /// Seed of the random reference [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub reference_seed: Option<u64>,
    /// Time with the loop closed; of a chirp the length of its sweep
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, help = duration_help())]
    pub duration: Option<Time>,
    /// Shape the reference: zv, zvd, ei (impulses that cancel the vibration of the closed loop), or minimum-time (fastest
    /// step within the limits of current and travel) [default: control.shaper of the profile]
    #[arg(
        long,
        value_name = "zv|zvd|ei|minimum-time",
        value_enum,
        hide_possible_values = true
    )]
    pub shaper: Option<Shaper>,
    /// Largest overshoot of a minimum-time step: 5% or 0.05 [default: not limited]
    #[arg(long, value_name = "RATIO", allow_hyphen_values = true)]
    pub max_overshoot: Option<Ratio>,
    /// Filter the reference by a critically damped low-pass of second order at this frequency
    #[arg(long, value_name = "FREQUENCY", allow_hyphen_values = true)]
    pub prefilter: Option<Frequency>,
    /// Add the current that moves the model along the reference (inverse of the plant, with preview)
    #[arg(long)]
    pub feedforward: bool,
    /// Certificate of a chirp (`*_certificate.json`): the evidence that devices, load and controller belong together. On devices a
    /// loop closes only with one [default: control.certificate; none]
    #[arg(long, value_name = "FILE")]
    pub certificate: Option<String>,
    /// Close the loop on devices although the certificate is missing or does not fit; the reason (at least 10 characters) is
    /// recorded. A loop that is unstable by the model is refused nevertheless
    #[arg(long = "override", value_name = "REASON")]
    #[serde(rename = "override")]
    #[schemars(with = "Option<String>")]
    pub override_reason: Option<OverrideReason>,
    /// Write only the recording, without plots and report
    #[arg(long)]
    pub no_report: bool,
}

fn duration_help() -> String {
    let sweep = default_value("chirp.duration_s").unwrap_or_default();
    let closed = with_setting("Time with the loop closed", "control.duration_s");
    format!("{closed}; for a chirp: length of the sweep [default: chirp.duration_s; {sweep}]")
}

/// What `bench control` does without options.
pub fn defaults_help() -> String {
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

/// The kinds of shaper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Shaper {
    /// Two impulses.
    Zv,
    /// Three impulses, for an uncertain frequency.
    Zvd,
    /// Three impulses with some residual vibration, for a frequency of larger uncertainty.
    Ei,
    /// The fastest step within the limits of current and travel.
    MinimumTime,
}

impl Shaper {
    /// The name in `control.shaper.kind`.
    fn kind(self) -> &'static str {
        match self {
            Shaper::Zv => "zv",
            Shaper::Zvd => "zvd",
            Shaper::Ei => "ei",
            Shaper::MinimumTime => "minimum_time",
        }
    }
}

impl ControlOrder {
    /// Controller, reference and certificate, as far as they may be files.
    pub(crate) fn files(&self) -> Vec<String> {
        let reference = match &self.reference {
            Some(Reference::File(path)) => Some(path),
            Some(Reference::Kind(_)) | None => None,
        };
        let files = [
            self.choice.controller.as_ref(),
            reference,
            self.certificate.as_ref(),
        ];
        files.into_iter().flatten().cloned().collect()
    }

    /// The configuration of the loop.
    ///
    /// # Errors
    /// When an option or the configuration is refused.
    pub fn config(&self) -> Result<Config, ExperimentError> {
        self.bench.load(Purpose::Control, &self.settings()?)
    }

    /// The settings that the options change.
    fn settings(&self) -> Result<Vec<OptionSetting>, ExperimentError> {
        self.refuse_unused()?;
        if let Some(Reference::File(path)) = &self.reference {
            require_file(path)?;
        }
        let mut settings = self.choice.settings();
        settings.extend(self.reference.as_ref().map(Reference::setting));
        let duration_key = match self.kind() {
            Some(ReferenceKind::Chirp) => "chirp.duration_s",
            _ => "control.duration_s",
        };
        let options = [
            self.reference_setting(self.amplitude_key(), "--amplitude", self.amplitude.as_ref()),
            given(duration_key, "--duration", self.duration.as_ref()),
            self.reference_setting(FREQUENCY.0, "--frequency", self.frequency.as_ref()),
            self.reference_setting(SPEED.0, "--speed", self.speed.as_ref()),
            self.reference_setting(ACCELERATION.0, "--acceleration", self.acceleration.as_ref()),
            self.reference_setting(JERK.0, "--jerk", self.jerk.as_ref()),
            self.reference_setting(PERIOD.0, "--period", self.period.as_ref()),
            self.seed_setting(),
        ];
        settings.extend(options.into_iter().flatten());
        settings.extend(self.command_settings());
        settings.extend(self.certificate.as_deref().map(certificate_setting));
        settings.extend(self.rig.seed.setting());
        Ok(settings)
    }

    /// The settings of shaper, prefilter and feedforward.
    fn command_settings(&self) -> Vec<OptionSetting> {
        let shaper = self.shaper.map(|shaper| {
            let name = shaper.to_possible_value();
            let name = name.map_or(String::new(), |value| value.get_name().to_string());
            kind_setting("control.shaper", shaper.kind(), format!("--shaper {name}"))
        });
        let prefilter = self.prefilter.as_ref().map(|frequency| {
            let option = format!("--prefilter {frequency}");
            kind_setting("control.prefilter", "low_pass", option)
        });
        let feedforward = self
            .feedforward
            .then(|| kind_setting("control.feedforward", "inverse", "--feedforward".into()));
        let options = [
            shaper,
            given(
                OVERSHOOT_KEY,
                "--max-overshoot",
                self.max_overshoot.as_ref(),
            ),
            prefilter,
            given(PREFILTER_KEY, "--prefilter", self.prefilter.as_ref()),
            feedforward,
        ];
        options.into_iter().flatten().collect()
    }

    fn kind(&self) -> Option<ReferenceKind> {
        match self.reference {
            Some(Reference::Kind(kind)) => Some(kind),
            _ => None,
        }
    }

    /// The key of `--amplitude`.
    fn amplitude_key(&self) -> &'static str {
        self.kind().map_or(HEIGHT.0, ReferenceKind::amplitude_key)
    }

    /// A setting of the reference with the quantity of an option, if it is given.
    fn reference_setting<D>(
        &self,
        key: &str,
        option: &str,
        quantity: Option<&Measure<D>>,
    ) -> Option<OptionSetting> {
        given(&format!("{TABLE}.{key}"), option, quantity)
    }

    /// The seed of a random reference, if it is given.
    fn seed_setting(&self) -> Option<OptionSetting> {
        let seed = self.reference_seed?;
        let option = format!("--reference-seed {seed}");
        // The parser of the option allows no larger one.
        Some(OptionSetting::new(
            format!("{TABLE}.{}", SEED.0),
            seed as i64,
            option,
        ))
    }

    /// Refuses an option that the reference does not use.
    fn refuse_unused(&self) -> Result<(), ExperimentError> {
        if self.max_overshoot.is_some() && self.shaper != Some(Shaper::MinimumTime) {
            return Err(ExperimentError::Refused(
                "--max-overshoot is valid only with --shaper minimum-time; leave it out, or choose that shaper".into(),
            ));
        }
        let is_default = self.reference.is_none();
        let amplitude = self.amplitude.is_some() && !is_default;
        self.refuse_without(amplitude, "--amplitude", |kind| {
            kind.has(kind.amplitude_key())
        })?;
        for (is_given, option, key) in [
            (self.frequency.is_some(), "--frequency", FREQUENCY.0),
            (self.speed.is_some(), "--speed", SPEED.0),
            (
                self.acceleration.is_some(),
                "--acceleration",
                ACCELERATION.0,
            ),
            (self.jerk.is_some(), "--jerk", JERK.0),
            (self.period.is_some(), "--period", PERIOD.0),
            (self.reference_seed.is_some(), "--reference-seed", SEED.0),
        ] {
            self.refuse_without(is_given, option, |kind| kind.has(key))?;
        }
        let is_chirp = self.kind() == Some(ReferenceKind::Chirp);
        self.refuse_without(self.no_report && is_chirp, "--no-report", |kind| {
            kind != ReferenceKind::Chirp
        })
    }

    /// Refuses an option that is given with a reference for which `is_used` does not hold.
    fn refuse_without(
        &self,
        is_given: bool,
        option: &str,
        is_used: impl Fn(ReferenceKind) -> bool,
    ) -> Result<(), ExperimentError> {
        if !is_given || self.kind().is_some_and(&is_used) {
            return Ok(());
        }
        let kinds = names(is_used);
        Err(ExperimentError::Refused(format!(
            "{option} is valid only with --reference {kinds}; leave it out, or choose such a reference"
        )))
    }
}

/// Refuses a reference that is neither a kind nor a file.
fn require_file(path: &str) -> Result<(), ExperimentError> {
    match std::fs::metadata(path) {
        Ok(_) => Ok(()),
        Err(error) => Err(ExperimentError::Refused(format!(
            "--reference {path}: neither a kind of reference nor a file: {error}; choose {}, or a file",
            names(|_| true)
        ))),
    }
}

/// A table with nothing but its kind.
fn kind_setting(key: &str, kind: &str, option: String) -> OptionSetting {
    let table = Table::from_iter([("kind".to_string(), Value::String(kind.into()))]);
    OptionSetting::new(key, table, option)
}

fn certificate_setting(file: &str) -> OptionSetting {
    let option = format!("--certificate {file}");
    OptionSetting::new("control.certificate", file, option)
}
