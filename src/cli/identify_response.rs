//! `bench identify --frf`: the modes of a frequency response of another program.

use std::path::Path;

use serde::Serialize;

use super::analysis_output::{in_folder, pages_text};
use super::error::CliError;
use super::exit::Exit;
use super::figure_options::magnitude_axis;
use super::input_path_text::{InputPathReport, input_kind_text};
use super::measured_margins::sigma_text;
use super::modal_output;
use super::output::{print_result, warn};
use super::table::labelled;
use bench_experiment::ExternalResponse;
use bench_experiment::outputs::{ExistingFile, ModalSummary, PageFiles, ResultFiles};
use bench_external::frf::OutputStated;
use bench_identify::frf_csv;
use bench_identify::scatter::SigmaSource;
use bench_identify::{InputKind, OutputKind, ResponseAnalysis};
use bench_order::IdentifyOrder;
use bench_report::run_pages::{ResponseReport, write_page};

/// The JSON object of the command: as for an external CSV, with fields of a response in place of those of signals.
#[derive(Debug, Serialize)]
struct Report {
    /// Always `null`, as is the trip: the file does not state how the run ended.
    outcome: Option<&'static str>,
    trip: Option<&'static str>,
    recording: String,
    /// Unit of the response, such as `um/N`; `null` if the file does not state it.
    unit: Option<String>,
    #[serde(skip)]
    residue_unit: String,
    /// Where the standard deviations come from.
    sigma: SigmaSource,
    /// What the file does not state and was assumed.
    assumptions: Vec<String>,
    /// Whether the response is negative at its lowest frequencies.
    negative: bool,
    #[serde(skip)]
    negative_text: Option<String>,
    band_hz: (f64, f64),
    /// Hold and lag of the input that were assumed; 0 without them.
    #[serde(flatten)]
    input_path: InputPathReport,
    /// What the input is, as stated; `null` if it is not.
    input_kind: Option<InputKind>,
    /// What the output was taken as.
    output_kind: OutputKind,
    frf_csv: String,
    #[serde(flatten)]
    pages: PageFiles,
    /// Number of frequencies in the band.
    frequencies: usize,
    /// Those with independent errors, to which the modes are fitted.
    independent_frequencies: usize,
    /// Median coherence over the band; `null` if the file has no coherence.
    coherence_median: Option<f64>,
    #[serde(flatten)]
    summary: ModalSummary,
}

/// Analyses a response and writes the results under the name of its file: beside it, or to the requested folder. Existing files are
/// kept: they may be the results of another band or of another file.
pub(super) fn run(
    path: &Path,
    out: Option<&Path>,
    order: &IdentifyOrder,
) -> Result<Exit, CliError> {
    let identification = order.table.response_identification()?;
    let output = match order.table.output_kind {
        None => OutputStated::No,
        Some(_) => OutputStated::Yes,
    };
    let response = ExternalResponse::read(path, order.response.frf_phase, output)?;
    warn(&response.assumptions);
    let analysis = identification.run(&response.frf);
    let analysis = analysis.map_err(|error| order.table.response_refused(error))?;
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let page = ResponseReport {
        response: &response,
        analysis: &analysis,
        file: &file,
        magnitude_axis: magnitude_axis(order.figures),
    };
    let results = ResultFiles {
        beside: &in_folder(out, path)?,
        existing: ExistingFile::Keep,
    };
    let report = Report::write(&page, path, results)?;
    print_result(order.json, &report, Report::text)?;
    Ok(Exit::Done)
}

impl Report {
    /// Writes the files of an analysed response.
    fn write(
        page: &ResponseReport<'_>,
        path: &Path,
        results: ResultFiles<'_>,
    ) -> Result<Report, CliError> {
        let ResponseReport {
            response, analysis, ..
        } = page;
        let unit = response.unit();
        let magnitude = frf_csv::external_magnitude(&unit.input, &unit.output);
        Ok(Report {
            outcome: None,
            trip: None,
            recording: path.display().to_string(),
            unit: response.unit.as_ref().map(ToString::to_string),
            residue_unit: unit.of_residue(analysis.output_kind),
            sigma: response.sigma,
            assumptions: response.assumptions.clone(),
            negative: response.negative.is_some(),
            negative_text: response.negative.map(|found| found.description()),
            band_hz: analysis.band_hz,
            input_path: InputPathReport::new(analysis.input_path, analysis.fitted_lag),
            input_kind: analysis.input_kind,
            output_kind: analysis.output_kind,
            frf_csv: results.write_frf("frf", &analysis.frf, &magnitude)?,
            pages: write_page(&page.report(), results)?,
            frequencies: analysis.frf.len(),
            independent_frequencies: analysis.frf.data.len(),
            coherence_median: median_coherence(response, analysis),
            summary: ModalSummary::new(analysis.fit.as_ref().ok(), &analysis.verdict),
        })
    }

    fn text(&self) -> String {
        [
            format!("  response   {}\n", self.recording),
            self.points_text(),
            self.unit_text(),
            input_kind_text(self.input_kind),
            self.output_kind_text(),
            sigma_text(self.sigma).map_or(String::new(), |text| labelled("sigma", text)),
            self.negative_text
                .as_ref()
                .map_or(String::new(), |text| labelled("sign", text)),
            self.input_path.text(),
            format!("  written    {}\n", self.frf_csv),
            modal_output::fit_text(&self.summary),
            pages_text(&self.pages),
            modal_output::text(&self.summary, &self.residue_unit),
        ]
        .concat()
    }

    fn points_text(&self) -> String {
        let (low_hz, high_hz) = self.band_hz;
        let (points, independent) = (self.frequencies, self.independent_frequencies);
        let coherence = self.coherence_median.map_or(String::new(), |median| {
            format!(", median coherence {median:.4}")
        });
        let fitted = if independent < points {
            format!(", {independent} of them with independent errors")
        } else {
            String::new()
        };
        labelled(
            "points",
            &format!("{points} from {low_hz:.4} to {high_hz:.4} Hz{fitted}{coherence}"),
        )
    }

    fn unit_text(&self) -> String {
        match &self.unit {
            Some(unit) => labelled("unit", unit),
            None => labelled(
                "unit",
                "not stated by the file: output per input (name the column, as in magnitude_um_per_n)",
            ),
        }
    }

    /// What the output is, if it is no displacement.
    fn output_kind_text(&self) -> String {
        match self.output_kind {
            OutputKind::Position => String::new(),
            kind => labelled("output", kind.name()),
        }
    }
}

/// The median of the coherence that the file has.
fn median_coherence(response: &ExternalResponse, analysis: &ResponseAnalysis) -> Option<f64> {
    let median = analysis.frf.median_coherence();
    median.filter(|_| response.has_coherence)
}
