//! The order of an analysis: of a recording, of an external CSV, or of the frequency response of another program.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;

use super::figure_options::ResponseFigureOptions;
use super::path_text::optional_path_text;
use super::response_options::ResponseOptions;
use bench_base::quantity::{Dimension, Frequency, Time};
use bench_experiment::{AnalysisError, ExperimentError};
use bench_external::{Columns, ExternalCsvError, Sampling, TimeUnit};
use bench_identify::periodic::Repetition;
use bench_identify::settling::settling_periods;
use bench_identify::{Identification, IdentificationError, IdentifyError, Signals};
use bench_plant::{InputKind, OutputKind};

/// The recording or the file, and what it contains.
#[derive(Clone, Debug, PartialEq, clap::Args, Serialize, JsonSchema)]
pub struct IdentifyOrder {
    /// The recording (MCAP) of a chirp, or an external CSV with --input and --output
    #[arg(required_unless_present = "frf")]
    #[serde(serialize_with = "optional_path_text")]
    pub recording: Option<PathBuf>,
    /// The frequency response of another program.
    #[command(flatten)]
    #[serde(flatten)]
    pub response: ResponseOptions,
    /// The columns of a CSV.
    #[command(flatten)]
    #[serde(flatten)]
    pub table: ExternalOptions,
    /// How responses are drawn.
    #[command(flatten)]
    #[serde(flatten)]
    pub figures: ResponseFigureOptions,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    pub json: bool,
}

impl IdentifyOrder {
    /// The file to analyse.
    pub fn file(&self) -> Option<&Path> {
        self.recording.as_deref().or(self.response.frf.as_deref())
    }
}

/// A CSV whose columns are not selected, or that cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ColumnsError {
    /// The options do not select the columns.
    #[error(transparent)]
    Options(#[from] ExperimentError),
    /// The file.
    #[error(transparent)]
    File(#[from] ExternalCsvError),
}

/// Largest deviation of a period from a whole number of samples, in samples. Leakage becomes relevant at a deviation
/// a thousand times larger.
const WHOLE_SAMPLES: f64 = 1e-3;
/// Allowed sampling rates.
const RATE_HZ: RangeInclusive<f64> = 1e-6..=1e9;

/// Allowed lags of the input in seconds.
const LAG_S: RangeInclusive<f64> = 0.0..=10.0;

/// What the columns of a CSV mean.
#[derive(Clone, Debug, PartialEq, clap::Args, Serialize, JsonSchema)]
#[group(id = "table")]
pub struct ExternalOptions {
    /// Input column: the force or a signal proportional to it, in any unit; the file is read as CSV
    #[arg(long, value_name = "COLUMN", requires = "output", group = "data")]
    pub input: Option<String>,
    /// Output column: the displacement, its velocity or acceleration (--output-kind), or a signal proportional to it, in any unit
    #[arg(long, value_name = "COLUMN", requires = "input")]
    pub output: Option<String>,
    /// Reference column of a record that was taken in closed loop: the set-point, or the excitation that was added in the loop, in any
    /// unit; not the control error. The input is then the whole signal that acts on the stage [default: none, open loop]
    #[arg(long, value_name = "COLUMN", requires = "input")]
    pub reference: Option<String>,
    /// What the input is: `force`, `current`, or `voltage` of a coil, whose lag L/R is then fitted together with complex residues, unless
    /// --input-lag states it [default: not stated]
    #[arg(long, value_name = "KIND", requires = "data", value_enum)]
    pub input_kind: Option<InputKind>,
    /// What the output measures: `position`, `velocity` as of a laser vibrometer, or `acceleration`. The modes are those of the position
    /// [default: position, and no verdict if the output looks like another kind]
    #[arg(long, value_name = "KIND", requires = "data", value_enum)]
    pub output_kind: Option<OutputKind>,
    /// Time column: numbers, or dates such as 2026-11-26T12:40:48.002Z. Times that are not equally spaced are taken as true
    #[arg(
        long,
        value_name = "COLUMN",
        requires = "input",
        conflicts_with = "rate"
    )]
    pub time: Option<String>,
    /// Unit of the times, if they are numbers [default: that in the name of the column (time_ms, t_us) or in a line of units, otherwise s]
    #[arg(long, value_name = "UNIT", requires = "time", value_enum)]
    pub time_unit: Option<TimeUnit>,
    /// Sampling rate, for a CSV file without a time column, or with inaccurate times of regular samples; with --frf and --hold zoh,
    /// that of the held command
    #[arg(long, value_name = "HZ", requires = "data", allow_hyphen_values = true)]
    pub rate: Option<Frequency>,
    /// Period of a periodic record: number of samples (2500) or time with unit (1s). Without it, the record must begin and
    /// end at rest
    #[arg(long, value_name = "SAMPLES|S", requires = "input")]
    pub period: Option<String>,
    /// Number of periods to skip at the beginning, while the plant settles [default: those that differ from the later ones]
    #[arg(long, value_name = "N", requires = "period")]
    pub skip_periods: Option<usize>,
    /// How the input is held between its samples: `zoh` if a command is constant over each sampling period, `none` for a measured input
    #[arg(long, value_name = "HOLD", requires = "data", value_enum, default_value_t = Hold::None)]
    pub hold: Hold,
    /// Time constant of a first-order lag between the recorded input and the force, as of a current loop (0.16ms) [default: none, or the
    /// one that is fitted if modes do not describe the response without one; 0s: none]
    #[arg(long, value_name = "S", requires = "data", allow_hyphen_values = true)]
    pub input_lag: Option<Time>,
    /// Frequency band to analyse: 11Hz:250Hz, or 11:250 in hertz [default: the band that the input excites; with --frf, all its frequencies]
    #[arg(
        long,
        value_name = "LOW:HIGH",
        requires = "data",
        allow_hyphen_values = true
    )]
    pub band: Option<String>,
}

/// How an input is held between its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Hold {
    /// Zero-order hold over each sampling period.
    Zoh,
    /// No hold.
    None,
}

impl ExternalOptions {
    /// Whether a file is to be read as a CSV: by the options, or by its name.
    pub fn selects_csv(&self, path: &Path) -> bool {
        self.input.is_some()
            || path
                .extension()
                .is_some_and(|extension| extension.eq_ignore_ascii_case("csv"))
    }

    /// The columns to read.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn columns(&self, path: &Path) -> Result<Columns, ColumnsError> {
        let (Some(input), Some(output)) = (self.input.clone(), self.output.clone()) else {
            let (file, names) = (path.display(), names(path)?);
            return Err(ExperimentError::Refused(format!(
                "{file}: input and output column are not selected; give --input COLUMN and --output COLUMN (columns: {names})"
            ))
            .into());
        };
        Ok(Columns {
            input,
            output,
            reference: self.reference()?,
            sampling: self.sampling(path)?,
        })
    }

    /// The column of the reference, which averages over periods do not need.
    fn reference(&self) -> Result<Option<String>, ExperimentError> {
        if self.reference.is_some() && self.period.is_some() {
            return Err(ExperimentError::Refused(
                "--reference is not used with --period, because noise that a controller feeds back averages out of input and output; leave out --reference".into(),
            ));
        }
        Ok(self.reference.clone())
    }

    fn sampling(&self, path: &Path) -> Result<Sampling, ColumnsError> {
        match (&self.time, &self.rate) {
            (Some(time), _) => Ok(Sampling::TimeColumn {
                name: time.clone(),
                unit: self.time_unit,
            }),
            (None, Some(rate)) => Ok(Sampling::RateHz(checked_rate_hz(rate.si())?)),
            (None, None) => {
                let names = names(path)?;
                Err(ExperimentError::Refused(format!(
                    "the sampling times of the lines are not known; give --time COLUMN (columns: {names}) or --rate HZ"
                ))
                .into())
            }
        }
    }

    pub(crate) fn band_hz(&self) -> Result<Option<(f64, f64)>, ExperimentError> {
        let Some(text) = &self.band else {
            return Ok(None);
        };
        let limits = text.split_once(':').and_then(|(low, high)| {
            let [low, high]: [Frequency; 2] = [low.parse().ok()?, high.parse().ok()?];
            Some((low.si(), high.si()))
        });
        limits.map(Some).ok_or_else(|| {
            ExperimentError::Refused(format!(
                "--band {text} is not a band; give two frequencies, as in 11Hz:250Hz"
            ))
        })
    }

    /// How the signals are analysed.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn identification(&self, signals: &Signals) -> Result<Identification, ExperimentError> {
        let mut identification = Identification::new(signals.rate_hz);
        if let Some((low_hz, high_hz)) = self.band_hz()? {
            identification = identification.band_hz(low_hz, high_hz);
        }
        if let Some(repetition) = self.repetition(signals)? {
            identification = identification.periods(repetition);
        }
        if let Some(kind) = self.input_kind {
            identification = identification.input_kind(kind);
        }
        if let Some(kind) = self.output_kind {
            identification = identification.output_kind(kind);
        }
        if let Some(lag_s) = self.lag_s()? {
            identification = identification.lag_s(lag_s);
        }
        Ok(match self.hold {
            Hold::Zoh => identification.held_s(1.0 / signals.rate_hz),
            Hold::None => identification,
        })
    }

    /// The error of an analysis: wrong usage, if an option is the cause.
    pub fn refused(&self, error: IdentificationError) -> ExperimentError {
        let IdentificationError::Signals(why) = &error else {
            return AnalysisError::from(error).into();
        };
        let option = match why {
            IdentifyError::Band(_) => self.band.as_ref().map(|band| format!("--band {band}")),
            IdentifyError::Setting { .. } => self.period.as_ref().map(|n| format!("--period {n}")),
            IdentifyError::Periods { .. } => {
                self.skip_periods.map(|n| format!("--skip-periods {n}"))
            }
            _ => None,
        };
        match option {
            Some(option) => ExperimentError::Refused(format!("{option}: {why}")),
            None => AnalysisError::from(error).into(),
        }
    }

    /// The stated lag of the input.
    pub(crate) fn lag_s(&self) -> Result<Option<f64>, ExperimentError> {
        let Some(lag_s) = self.input_lag.as_ref().map(Time::si) else {
            return Ok(None);
        };
        if !LAG_S.contains(&lag_s) {
            let lag = Dimension::Time.display(lag_s);
            let (min, max) = (LAG_S.start(), LAG_S.end());
            return Err(ExperimentError::Refused(format!(
                "--input-lag is {lag}; give a time from {min} to {max} s"
            )));
        }
        Ok(Some(lag_s))
    }

    fn repetition(&self, signals: &Signals) -> Result<Option<Repetition>, ExperimentError> {
        let Some(text) = &self.period else {
            return Ok(None);
        };
        let rate_hz = signals.rate_hz;
        let period = period_samples(text, rate_hz).ok_or_else(|| {
            ExperimentError::Refused(format!(
                "--period {text} is not a whole number of samples at {rate_hz} Hz; give a number of samples (2500) or a time that is a multiple of the sampling period (1s)"
            ))
        })?;
        let skip = match self.skip_periods {
            Some(skip) => skip,
            None => settling_periods(signals, period)
                .map_err(|error| self.refused(IdentificationError::from(error)))?,
        };
        Ok(Some(Repetition { period, skip }))
    }
}

/// Refuses a rate at which no signal is sampled.
pub(crate) fn checked_rate_hz(rate_hz: f64) -> Result<f64, ExperimentError> {
    if RATE_HZ.contains(&rate_hz) {
        return Ok(rate_hz);
    }
    let rate = Dimension::Frequency.display(rate_hz);
    let (min, max) = (RATE_HZ.start(), RATE_HZ.end());
    Err(ExperimentError::Refused(format!(
        "--rate is {rate}; give a rate from {min} to {max} Hz"
    )))
}

/// The period in samples. A number without a unit is in samples; a time must be a multiple of the sampling period.
fn period_samples(text: &str, rate_hz: f64) -> Option<usize> {
    let samples: f64 = match text.parse() {
        Ok(samples) => samples,
        Err(_) => text.parse::<Time>().ok()?.si() * rate_hz,
    };
    // NaN is outside of the range.
    let is_whole = (samples - samples.round()).abs() <= WHOLE_SAMPLES;
    ((1.0..1e15).contains(&samples) && is_whole).then_some(samples.round() as usize)
}

fn names(path: &Path) -> Result<String, ExternalCsvError> {
    bench_external::listing(path)
}
