//! `bench identify` of an external CSV: any input, any output, without a model.

use std::ops::RangeInclusive;
use std::path::Path;

use serde::Serialize;

use super::analysis_output::{in_folder, pages_text, response_text};
use super::error::CliError;
use super::linearity_output;
use super::modal_output;
use super::outcome::Outcome;
use super::output::print_result;
use bench_base::quantity::{Dimension, Frequency, OfFrequency, OfTime, Time, si};
use bench_experiment::AnalysisError;
use bench_identify::external_csv::{self, Columns, Sampling};
use bench_identify::frf_csv;
use bench_identify::linearity::Linearity;
use bench_identify::modal::InputPath;
use bench_identify::periodic::Repetition;
use bench_identify::settling::settling_periods;
use bench_identify::{Distortion, DistortionSource, Identification, IdentificationError};
use bench_identify::{IdentifyError, Signals};
use bench_report::MagnitudeAxis;
use bench_report::run_pages::{
    ExistingFile, ExternalRecord, ModalSummary, OutputError, PageFiles, ResultFiles,
};

/// Largest deviation of a period from a whole number of samples, in samples. Leakage becomes relevant at a deviation
/// a thousand times larger.
const WHOLE_SAMPLES: f64 = 1e-3;
/// Allowed sampling rates.
const RATE_HZ: RangeInclusive<f64> = 1e-6..=1e9;

/// Allowed lags of the input in seconds.
const LAG_S: RangeInclusive<f64> = 0.0..=10.0;

/// What the columns of a CSV mean.
#[derive(Clone, Debug, clap::Args)]
#[group(id = "table")]
pub(super) struct ExternalOptions {
    /// Input column: the force or a signal proportional to it, in any unit; the file is read as CSV
    #[arg(long, value_name = "COLUMN", requires = "output")]
    input: Option<String>,
    /// Output column: the displacement or a signal proportional to it, in any unit
    #[arg(long, value_name = "COLUMN", requires = "input")]
    output: Option<String>,
    /// Time column, in seconds; the times must be equally spaced
    #[arg(
        long,
        value_name = "COLUMN",
        requires = "input",
        conflicts_with = "rate"
    )]
    time: Option<String>,
    /// Sampling rate, for a CSV file without a time column
    #[arg(
        long,
        value_name = "HZ",
        requires = "input",
        allow_hyphen_values = true, value_parser = si::<OfFrequency>)]
    rate: Option<f64>,
    /// Period of a periodic record: number of samples (2500) or time with unit (1s). Without it, the record must begin and
    /// end at rest
    #[arg(long, value_name = "SAMPLES|S", requires = "input")]
    period: Option<String>,
    /// Number of periods to skip at the beginning, while the plant settles [default: those that differ from the later ones]
    #[arg(long, value_name = "N", requires = "period")]
    skip_periods: Option<usize>,
    /// How the input is held between its samples: `zoh` if a command is constant over each sampling period, `none` for a measured input
    #[arg(long, value_name = "HOLD", requires = "input", value_enum, default_value_t = Hold::None)]
    hold: Hold,
    /// Time constant of a first-order lag between the recorded input and the force, as of a current loop (0.16ms)
    #[arg(
        long,
        value_name = "S",
        requires = "input",
        allow_hyphen_values = true, value_parser = si::<OfTime>)]
    input_lag: Option<f64>,
    /// Frequency band to analyse: 11Hz:250Hz, or 11:250 in hertz [default: the band that the input excites]
    #[arg(
        long,
        value_name = "LOW:HIGH",
        requires = "input",
        allow_hyphen_values = true
    )]
    band: Option<String>,
}

/// How an input is held between its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
enum Hold {
    /// Zero-order hold over each sampling period.
    Zoh,
    /// No hold.
    None,
}

/// The JSON object of the command: as for a recording, with fields of a CSV.
#[derive(Debug, Serialize)]
struct Report {
    /// Always `null`, as is the trip: the file does not state how the run ended.
    outcome: Option<&'static str>,
    trip: Option<&'static str>,
    recording: String,
    input: String,
    output: String,
    ticks: usize,
    overruns: u64,
    lost_records: u64,
    truncated: bool,
    rate_hz: f64,
    band_hz: (f64, f64),
    /// Hold and lag of the input that were assumed; 0 without them.
    hold_s: f64,
    input_lag_s: f64,
    /// Number of averaged periods; `null` if the record is not periodic.
    periods: Option<usize>,
    /// Number of omitted periods before them.
    skipped_periods: Option<usize>,
    /// Power of the distortion over that of the output; `null` if the record is not periodic.
    distortion_ratio: Option<f64>,
    distortion_source: Option<DistortionSource>,
    #[serde(skip)]
    distortion: Option<Distortion>,
    /// Noise, odd and even distortion, if a periodic excitation omits lines.
    #[serde(skip_serializing_if = "Option::is_none")]
    linearity: Option<Linearity>,
    frf_csv: String,
    #[serde(flatten)]
    pages: PageFiles,
    frequencies: usize,
    /// Median coherence over the band.
    coherence_median: Option<f64>,
    #[serde(flatten)]
    summary: ModalSummary,
}

impl ExternalOptions {
    /// Whether a file is to be read as a CSV: by the options, or by its name.
    pub(super) fn selects_csv(&self, path: &Path) -> bool {
        self.input.is_some()
            || path
                .extension()
                .is_some_and(|extension| extension.eq_ignore_ascii_case("csv"))
    }

    fn columns(&self, path: &Path) -> Result<Columns, CliError> {
        let (Some(input), Some(output)) = (self.input.clone(), self.output.clone()) else {
            let (file, names) = (path.display(), names(path)?);
            return Err(CliError::Usage(format!(
                "{file}: input and output column are not selected; give --input COLUMN and --output COLUMN (columns: {names})"
            )));
        };
        Ok(Columns {
            input,
            output,
            sampling: self.sampling(path)?,
        })
    }

    fn sampling(&self, path: &Path) -> Result<Sampling, CliError> {
        match (&self.time, self.rate) {
            (Some(time), _) => Ok(Sampling::TimeColumn(time.clone())),
            (None, Some(rate_hz)) => Ok(Sampling::RateHz(checked_rate_hz(rate_hz)?)),
            (None, None) => {
                let names = names(path)?;
                Err(CliError::Usage(format!(
                    "the sampling times of the lines are not known; give --time COLUMN (columns: {names}) or --rate HZ"
                )))
            }
        }
    }

    fn band_hz(&self) -> Result<Option<(f64, f64)>, CliError> {
        let Some(text) = &self.band else {
            return Ok(None);
        };
        let limits = text.split_once(':').and_then(|(low, high)| {
            let [low, high]: [Frequency; 2] = [low.parse().ok()?, high.parse().ok()?];
            Some((low.si(), high.si()))
        });
        limits.map(Some).ok_or_else(|| {
            CliError::Usage(format!(
                "--band {text} is not a band; give two frequencies, as in 11Hz:250Hz"
            ))
        })
    }

    fn identification(&self, signals: &Signals) -> Result<Identification, CliError> {
        let mut identification = Identification::new(signals.rate_hz);
        if let Some((low_hz, high_hz)) = self.band_hz()? {
            identification = identification.band_hz(low_hz, high_hz);
        }
        if let Some(repetition) = self.repetition(signals)? {
            identification = identification.periods(repetition);
        }
        let InputPath { hold_s, lag_s } = self.input_path(signals.rate_hz)?;
        Ok(identification.held_s(hold_s).lag_s(lag_s))
    }

    /// The error of an analysis: wrong usage, if an option is the cause.
    fn refused(&self, error: IdentificationError) -> CliError {
        let IdentificationError::Signals(why) = &error else {
            return AnalysisError::from(error).into();
        };
        let option = match why {
            IdentifyError::Band(_) => self.band.as_ref().map(|band| format!("--band {band}")),
            IdentifyError::Setting { .. } => self.period.as_ref().map(|n| format!("--period {n}")),
            IdentifyError::Periods { .. } => {
                self.skip_periods.map(|n| format!("--skip-periods {n}"))
            }
            IdentifyError::Signals(_) | IdentifyError::NotExcited { .. } => None,
        };
        match option {
            Some(option) => CliError::Usage(format!("{option}: {why}")),
            None => AnalysisError::from(error).into(),
        }
    }

    fn input_path(&self, rate_hz: f64) -> Result<InputPath, CliError> {
        let lag_s = self.input_lag.unwrap_or(0.0);
        if !LAG_S.contains(&lag_s) {
            let lag = Dimension::Time.display(lag_s);
            let (min, max) = (LAG_S.start(), LAG_S.end());
            return Err(CliError::Usage(format!(
                "--input-lag is {lag}; give a time from {min} to {max} s"
            )));
        }
        let hold_s = match self.hold {
            Hold::Zoh => 1.0 / rate_hz,
            Hold::None => 0.0,
        };
        Ok(InputPath { hold_s, lag_s })
    }

    fn repetition(&self, signals: &Signals) -> Result<Option<Repetition>, CliError> {
        let Some(text) = &self.period else {
            return Ok(None);
        };
        let rate_hz = signals.rate_hz;
        let period = period_samples(text, rate_hz).ok_or_else(|| {
            CliError::Usage(format!(
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
fn checked_rate_hz(rate_hz: f64) -> Result<f64, CliError> {
    if RATE_HZ.contains(&rate_hz) {
        return Ok(rate_hz);
    }
    let rate = Dimension::Frequency.display(rate_hz);
    let (min, max) = (RATE_HZ.start(), RATE_HZ.end());
    Err(CliError::Usage(format!(
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

fn names(path: &Path) -> Result<String, CliError> {
    Ok(external_csv::names(path)?.join(", "))
}

/// Analyses a CSV and writes the results under its name: beside it, or to the requested folder. Existing files are kept: they may
/// be the results of other columns, of another band or of another file.
pub(super) fn run(
    path: &Path,
    out: Option<&Path>,
    options: &ExternalOptions,
    magnitude_axis: MagnitudeAxis,
    json: bool,
) -> Result<Outcome, CliError> {
    let columns = options.columns(path)?;
    let signals = external_csv::read(path, &columns)?;
    signals.check()?;
    let identification = options.identification(&signals)?;
    let analysis = identification.run(&signals.input, &signals.output);
    let analysis = analysis.map_err(|error| options.refused(error))?;
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let record = ExternalRecord {
        analysis: &analysis,
        file: &file,
        input: &columns.input,
        output: &columns.output,
        rate_hz: signals.rate_hz,
        samples: signals.len(),
        magnitude_axis,
    };
    let results = ResultFiles {
        beside: &in_folder(out, path)?,
        existing: ExistingFile::Keep,
    };
    let report = Report::write(&record, path, results)?;
    print_result(json, &report, Report::text)?;
    Ok(Outcome::Done)
}

impl Report {
    /// Writes the files of an analysed CSV.
    fn write(
        record: &ExternalRecord,
        path: &Path,
        results: ResultFiles<'_>,
    ) -> Result<Report, CliError> {
        let (analysis, input, output) = (record.analysis, record.input, record.output);
        let magnitude = frf_csv::external_magnitude(input, output);
        let periodic = analysis.periodic.as_ref();
        let distortion = periodic.and_then(|part| part.distortion);
        Ok(Report {
            outcome: None,
            trip: None,
            recording: path.display().to_string(),
            input: input.into(),
            output: output.into(),
            ticks: record.samples,
            overruns: 0,
            lost_records: 0,
            truncated: false,
            rate_hz: record.rate_hz,
            band_hz: analysis.band_hz,
            hold_s: analysis.input_path.hold_s,
            input_lag_s: analysis.input_path.lag_s,
            periods: periodic.map(|part| part.periods),
            skipped_periods: periodic.map(|part| part.skipped),
            distortion_ratio: distortion.map(|distortion| distortion.ratio),
            distortion_source: distortion.map(|distortion| distortion.source),
            distortion,
            linearity: periodic.and_then(|part| part.linearity.clone()),
            frf_csv: results.write_frf("frf", &analysis.frf, &magnitude)?,
            pages: PageFiles::write(&record.report().map_err(OutputError::from)?, results)?,
            frequencies: analysis.frf.len(),
            coherence_median: analysis.frf.median_coherence(),
            summary: ModalSummary::new(analysis.fit.as_ref().ok(), &analysis.verdict),
        })
    }

    fn text(&self) -> String {
        let (input, output) = (&self.input, &self.output);
        let coherence = self.coherence_median.unwrap_or(0.0);
        let chi2 = self.summary.fit_chi2_per_freedom.unwrap_or(0.0);
        format!(
            "{}{}\n{}  residues   in `{output}`/(`{input}` s^2) instead of the 1/kg in the table\n  fit        reduced chi-square {chi2:.3}\n{}",
            self.record_text(),
            response_text(&self.frf_csv, self.frequencies, coherence),
            pages_text(&self.pages),
            modal_output::text(&self.summary)
        )
    }

    fn record_text(&self) -> String {
        let periods = self.periods_text().unwrap_or_default();
        format!(
            "  record     {}\n             {} samples at {} from `{}` to `{}`\n{periods}{}",
            self.recording,
            self.ticks,
            hertz(self.rate_hz),
            self.input,
            self.output,
            self.input_path_text()
        )
    }

    /// The averaged periods and the distortion of a periodic record.
    fn periods_text(&self) -> Option<String> {
        let (count, skipped) = (self.periods?, self.skipped_periods?);
        let mut text = format!("             {count} periods averaged, {skipped} skipped before\n");
        if let Some(distortion) = self.distortion {
            text += &format!("             distortion {}\n", distortion.description());
        }
        if let Some(linearity) = &self.linearity {
            text += &linearity_output::text(linearity);
        }
        Some(text)
    }

    /// The assumed hold and lag, if there are any.
    fn input_path_text(&self) -> String {
        if self.hold_s == 0.0 && self.input_lag_s == 0.0 {
            return String::new();
        }
        let (hold_ms, lag_ms) = (1e3 * self.hold_s, 1e3 * self.input_lag_s);
        format!("             input held for {hold_ms:.4} ms, lag {lag_ms:.4} ms\n")
    }
}

/// A rate with nine significant digits. A rate computed from decimal times has rounding errors.
fn hertz(rate_hz: f64) -> String {
    let rounded: f64 = format!("{rate_hz:.8e}").parse().unwrap_or(rate_hz);
    format!("{rounded} Hz")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_is_shown_without_rounding_errors() {
        assert_eq!(hertz(2000.0000000000002), "2000 Hz");
        assert_eq!(hertz(1234.5678), "1234.5678 Hz");
    }
}
