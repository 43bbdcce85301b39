//! `bench identify` of an external CSV: any input, any output, without a model.

use std::path::Path;

use serde::Serialize;

use super::analysis_output::{in_folder, pages_text, response_text};
use super::error::CliError;
use super::exit::Exit;
use super::input_path_text::{InputPathReport, input_kind_text};
use super::linearity_output;
use super::modal_output;
use super::output::print_result;
use super::table::labelled;
use bench_experiment::outputs::{ExistingFile, ModalSummary, PageFiles, ResultFiles};
use bench_external::{Record, TimeBase};
use bench_identify::frf_csv;
use bench_identify::linearity::Linearity;
use bench_identify::record_check::{Correction, Resolution};
use bench_identify::{
    ClockSkew, Distortion, DistortionSource, InputKind, OutputKind, ReadingsFit, StaticSign,
    SweepHarmonic,
};
use bench_order::ExternalOptions;
use bench_report::MagnitudeAxis;
use bench_report::run_pages::{ExternalRecord, PageError, write_page};

/// The JSON object of the command: as for a recording, with fields of a CSV.
#[derive(Debug, Serialize)]
struct Report {
    /// Always `null`, as is the trip: the file does not state how the run ended.
    outcome: Option<&'static str>,
    trip: Option<&'static str>,
    recording: String,
    input: String,
    output: String,
    /// Column of the reference of a closed loop; `null` in open loop.
    reference: Option<String>,
    ticks: usize,
    overruns: u64,
    lost_records: u64,
    truncated: bool,
    rate_hz: f64,
    /// Whether the rate was given, the times are regular, or the columns were resampled.
    times: TimeBase,
    /// Whether the times are taken as seconds only because the file does not state their unit.
    time_unit_assumed: bool,
    band_hz: (f64, f64),
    /// What the input is, as stated; `null` if it is not.
    input_kind: Option<InputKind>,
    /// What the output measures, as stated, or `position`.
    output_kind: OutputKind,
    /// The sign of the static response by the modes; `null` if they do not tell it.
    static_sign: Option<StaticSign>,
    /// Hold and lag of the input that were assumed; 0 without them.
    #[serde(flatten)]
    input_path: InputPathReport,
    /// Steps of the values of input and output; `null` if they are below the noise.
    input_resolution: Option<f64>,
    output_resolution: Option<f64>,
    #[serde(skip)]
    resolution: Resolution,
    /// Standard deviation of the noise of the output before rounding, if the modes are those of the greatest likelihood of its rounded readings.
    noise_before_rounding: Option<f64>,
    #[serde(skip)]
    readings_fit: Option<ReadingsFit>,
    /// Spikes and steps of the output that were corrected, and samples that were left out.
    corrections: Vec<Correction>,
    /// Standard deviation of the times of the readings, if they are irregular and not stated.
    jitter_s: Option<f64>,
    /// Harmonics of a sweep in the output.
    harmonics: Vec<SweepHarmonic>,
    /// By how much the clock of the output is slower than that of the input, with its standard deviation; `null` for one clock.
    clock_skew_ppm: Option<f64>,
    clock_skew_ppm_sigma: Option<f64>,
    #[serde(skip)]
    clock_skew: Option<ClockSkew>,
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

/// Analyses a CSV and writes the results under its name: beside it, or to the requested folder. Existing files are kept: they may
/// be the results of other columns, of another band or of another file.
pub(super) fn run(
    path: &Path,
    out: Option<&Path>,
    options: &ExternalOptions,
    magnitude_axis: MagnitudeAxis,
    json: bool,
) -> Result<Exit, CliError> {
    let columns = options.columns(path)?;
    let Record {
        signals,
        reference,
        times,
        seconds_assumed,
    } = bench_external::read(path, &columns)?;
    signals.check()?;
    let identification = options.identification(&signals)?;
    let analysis = match &reference {
        None => identification.run(&signals.input, &signals.output),
        Some(reference) => {
            identification.run_with_reference(reference, &signals.input, &signals.output)
        }
    };
    let analysis = analysis.map_err(|error| options.refused(error))?;
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let record = ExternalRecord {
        analysis: &analysis,
        file: &file,
        input: &columns.input,
        output: &columns.output,
        reference: columns.reference.as_deref(),
        rate_hz: signals.rate_hz,
        samples: signals.len(),
        times,
        magnitude_axis,
    };
    let results = ResultFiles {
        beside: &in_folder(out, path)?,
        existing: ExistingFile::Keep,
    };
    let mut report = Report::write(&record, path, results)?;
    report.time_unit_assumed = seconds_assumed;
    print_result(json, &report, Report::text)?;
    Ok(Exit::Done)
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
            reference: record.reference.map(String::from),
            ticks: record.samples,
            overruns: 0,
            lost_records: 0,
            truncated: false,
            rate_hz: record.rate_hz,
            times: record.times,
            time_unit_assumed: false,
            band_hz: analysis.band_hz,
            input_kind: analysis.input_kind,
            output_kind: analysis.output_kind,
            static_sign: analysis.static_sign(),
            input_path: InputPathReport::new(analysis.input_path, analysis.fitted_lag),
            input_resolution: analysis.resolution.input,
            output_resolution: analysis.resolution.output,
            resolution: analysis.resolution,
            noise_before_rounding: analysis
                .readings_fit
                .and_then(|fit| fit.noise_before_rounding()),
            readings_fit: analysis.readings_fit,
            corrections: analysis.corrections.clone(),
            jitter_s: analysis.jitter_s,
            harmonics: analysis.harmonics.clone(),
            clock_skew_ppm: analysis.clock_skew.map(|skew| skew.ppm().value),
            clock_skew_ppm_sigma: analysis.clock_skew.map(|skew| skew.ppm().sigma),
            clock_skew: analysis.clock_skew,
            periods: periodic.map(|part| part.periods),
            skipped_periods: periodic.map(|part| part.skipped),
            distortion_ratio: distortion.map(|distortion| distortion.ratio),
            distortion_source: distortion.map(|distortion| distortion.source),
            distortion,
            linearity: periodic.and_then(|part| part.linearity.clone()),
            frf_csv: results.write_frf("frf", &analysis.frf, &magnitude)?,
            pages: write_page(&record.report().map_err(PageError::from)?, results)?,
            frequencies: analysis.frf.len(),
            coherence_median: analysis.frf.median_coherence(),
            summary: ModalSummary::new(analysis.fit.as_ref().ok(), &analysis.verdict),
        })
    }

    fn text(&self) -> String {
        let coherence = self.coherence_median.unwrap_or(0.0);
        format!(
            "{}{}\n{}  residues   in {}\n{}{}",
            self.record_text(),
            response_text(&self.frf_csv, self.frequencies, coherence),
            pages_text(&self.pages),
            self.residue_unit(),
            modal_output::fit_text(&self.summary),
            modal_output::text(&self.summary, table_unit(self.output_kind))
        )
    }

    fn record_text(&self) -> String {
        let periods = self.periods_text().unwrap_or_default();
        format!(
            "  record     {}\n             {} samples at {} from `{}` to `{}`\n{}{}{}{}{}{}{}{}{}{periods}{}",
            self.recording,
            self.ticks,
            hertz(self.rate_hz),
            self.input,
            self.output,
            self.reference_text(),
            self.times_text(),
            self.clocks_text(),
            input_kind_text(self.input_kind),
            self.output_kind_text(),
            self.static_sign_text(),
            self.resolution_text(),
            self.readings_text(),
            self.corrections_text(),
            self.input_path.text()
        )
    }

    /// The reference of a closed loop.
    fn reference_text(&self) -> String {
        let name = self.reference.as_ref();
        let text = name.map(|name| format!("`{name}`, of a closed loop"));
        text.map_or_else(String::new, |text| labelled("reference", &text))
    }

    /// What the output measures, if it is no position.
    fn output_kind_text(&self) -> String {
        match self.output_kind {
            OutputKind::Position => String::new(),
            kind => labelled("output", kind.name()),
        }
    }

    /// An inverted sensor or drive.
    fn static_sign_text(&self) -> String {
        let text = self.static_sign.and_then(StaticSign::description);
        text.map_or_else(String::new, |text| labelled("sign", text))
    }

    /// The unit of the residues, in which a position is the output divided by s or s^2.
    fn residue_unit(&self) -> String {
        let (input, output) = (&self.input, &self.output);
        match self.output_kind {
            OutputKind::Position => format!("`{output}`/(`{input}` s^2)"),
            OutputKind::Velocity => format!("`{output}`/(`{input}` s)"),
            OutputKind::Acceleration => format!("`{output}`/`{input}`"),
        }
    }

    /// The unit of the times if it is assumed, and irregular times.
    fn times_text(&self) -> String {
        let assumed = "taken as seconds, because the file states no unit (--time-unit)";
        let unit = self.time_unit_assumed.then(|| labelled("times", assumed));
        let base = match self.times {
            TimeBase::Resampled { .. } => labelled("times", &self.times.to_string()),
            TimeBase::Given | TimeBase::Regular => String::new(),
        };
        unit.unwrap_or_default() + &base
    }

    /// The difference of the clocks, if there is one.
    fn clocks_text(&self) -> String {
        let text = self.clock_skew.map(|skew| skew.description());
        text.map_or_else(String::new, |text| labelled("clocks", &text))
    }

    /// Spikes and steps that were corrected, and samples that were left out.
    fn corrections_text(&self) -> String {
        let text = Correction::description(&self.corrections);
        text.map_or_else(String::new, |text| labelled("corrected", &text))
    }

    /// The resolution of the channels, if it exceeds their noise.
    fn resolution_text(&self) -> String {
        let text = self.resolution.description();
        text.map_or_else(String::new, |text| labelled("resolution", &text))
    }

    /// How the modes of readings were found.
    fn readings_text(&self) -> String {
        let text = self.readings_fit.map(|fit| fit.description());
        text.map_or_else(String::new, |text| labelled("readings", &text))
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
}

/// The unit of the residues in the table.
fn table_unit(kind: OutputKind) -> &'static str {
    match kind {
        OutputKind::Position => "output/input/s^2",
        OutputKind::Velocity => "output/input/s",
        OutputKind::Acceleration => "output/input",
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
