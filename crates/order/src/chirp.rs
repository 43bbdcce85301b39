//! The order of a chirp, or of another excitation.

use clap::ValueEnum;
use schemars::JsonSchema;
use serde::Serialize;

use super::bench_options::{BenchOptions, given};
use super::excitation_options::ExcitationOptions;
use super::figure_options::ResponseFigureOptions;
use super::help::with_setting;
use super::rig_options::RigOptions;
use bench_base::quantity::Time;
use bench_config::{Config, ExcitationKind, OptionSetting, Purpose, Sweep};
use bench_experiment::ExperimentError;
use bench_experiment::sequential::{default_max_motion_s, first_shot_config};

/// The bench and its excitation.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, JsonSchema)]
pub struct ChirpOrder {
    /// The bench.
    #[command(flatten)]
    #[serde(flatten)]
    pub bench: BenchOptions,
    /// Rig and pace.
    #[command(flatten)]
    #[serde(flatten)]
    pub rig: RigOptions,
    /// How responses are drawn.
    #[command(flatten)]
    #[serde(flatten)]
    pub figures: ResponseFigureOptions,
    /// Kind of excitation
    #[arg(long, value_name = "KIND", help = with_setting("Kind of excitation", "excitation.kind"))]
    pub excitation: Option<ExcitationKind>,
    /// Band and amplitude.
    #[command(flatten)]
    #[serde(flatten)]
    pub band: ExcitationOptions,
    /// Length of the sweep
    #[arg(long, value_name = "TIME", allow_hyphen_values = true,
        help = with_setting("Length of the sweep", "chirp.duration_s"))]
    pub duration: Option<Time>,
    /// Frequency as a function of time
    #[arg(long, value_name = "KIND", help = with_setting("Frequency as a function of time", "chirp.sweep"))]
    pub sweep: Option<Sweep>,
    /// Short chirps until the verdict is certain.
    #[command(flatten)]
    #[serde(flatten)]
    pub sequential: SequentialOptions,
}

/// Options of a sequential experiment.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, JsonSchema)]
pub struct SequentialOptions {
    /// Make short chirps until the verdict on CNMP zeros is certain; bands, lengths and amplitudes are planned within the interlocks
    #[arg(long, conflicts_with_all = ["duration", "sweep", "excitation", "amplitude", "shape"])]
    pub until_decided: bool,
    /// Limit of the length of all chirps together [default: 20 times the first chirp]
    #[arg(
        long,
        value_name = "TIME",
        requires = "until_decided",
        allow_hyphen_values = true
    )]
    pub max_duration: Option<Time>,
}

impl ChirpOrder {
    fn settings(&self) -> Vec<OptionSetting> {
        let duration = given("chirp.duration_s", "--duration", self.duration.as_ref());
        let sweep = self.sweep.map(word);
        let kind = self.excitation.map(word);
        let mut settings = self.band.settings();
        settings.extend(self.rig.seed.setting());
        settings.extend(duration);
        settings.extend(sweep.map(|word| word_setting("chirp.sweep", "--sweep", word)));
        settings.extend(kind.map(|word| word_setting("excitation.kind", "--excitation", word)));
        settings
    }

    /// The configuration with the requested amplitude over frequency.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn config(&self) -> Result<Config, ExperimentError> {
        let config = self.bench.load(Purpose::Chirp, &self.settings())?;
        self.refuse_unused(&config)?;
        self.band.shaped(config)
    }

    /// Refuses options of a chirp that have no effect on another kind of excitation.
    fn refuse_unused(&self, config: &Config) -> Result<(), ExperimentError> {
        let kind = config.excitation.kind;
        if kind == ExcitationKind::Chirp {
            return Ok(());
        }
        let (name, chosen) = (kind.name(), config.chosen_excitation()?);
        let key = chosen.design.length(&chosen.shared).key;
        let unused = match (&self.duration, self.sweep) {
            (Some(duration), _) => {
                format!(
                    "--duration {duration} is the length of a chirp, not of `{name}`; use --set {key}=N"
                )
            }
            (None, Some(_)) => format!(
                "--sweep goes with --excitation chirp only, not with `{name}`; leave it out"
            ),
            (None, None) => return Ok(()),
        };
        Err(ExperimentError::Refused(unused))
    }
}

fn word_setting(key: &str, option: &str, word: String) -> OptionSetting {
    let option = format!("{option} {word}");
    OptionSetting::new(key, word, option)
}

/// The word of a value in help and settings.
fn word(value: impl ValueEnum) -> String {
    let value = value.to_possible_value();
    value.map_or(String::new(), |value| value.get_name().to_string())
}

impl SequentialOptions {
    /// The limit of the motion in seconds; `None` for a single chirp.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn max_motion_s(&self, config: &Config) -> Result<Option<f64>, ExperimentError> {
        if !self.until_decided {
            return Ok(None);
        }
        let Some(limit) = &self.max_duration else {
            return Ok(Some(default_max_motion_s(config)?));
        };
        let first_s = first_shot_config(config)?.chirp.duration_s;
        if limit.si() >= first_s {
            Ok(Some(limit.si()))
        } else {
            Err(ExperimentError::Refused(format!(
                "--max-duration is {limit}, but the first chirp takes {first_s:.2} s; give a longer time"
            )))
        }
    }
}
