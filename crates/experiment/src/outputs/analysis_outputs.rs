//! The files and the numbers of an analysed run as stable JSON: FRFs as CSV, the certificate, modes, zeros and verdict.

use std::path::Path;

use serde::Serialize;

use super::page_files::PageFiles;
use super::result_files::{OutputError, ResultFiles};
use crate::analysis::{AnalysedRun, Analysis, ClosedResponses};
use crate::certificate::SignCheck;
use crate::evidence::{ResponseFile, certify};
use bench_identify::frf_csv::{self, METRES_PER_AMPERE, RATIO};
use bench_identify::linearity::Linearity;
use bench_identify::modal::{FittedMode, ModalFit, ModelOrder};
use bench_identify::verdict::{Cnmp, UncertainZero, Verdict};

/// Modes, zeros and verdict; the names in JSON must not change.
#[derive(Clone, Debug, Serialize)]
pub struct ModalSummary {
    /// The modes, lowest frequency first.
    pub modes: Vec<FittedMode>,
    /// Lowest and highest fitted frequency in hertz; modes elsewhere represent what lies beyond them. `null` without modes.
    pub fit_band_hz: Option<(f64, f64)>,
    /// `real` or `complex`; `null` without modes.
    pub residues: Option<&'static str>,
    /// Zeros of the fit, with damping, in the band of the verdict; of a conjugate pair the one above the real axis.
    pub zeros: Vec<UncertainZero>,
    /// The verdict.
    pub cnmp: Cnmp,
    /// Its reasons.
    pub why: String,
    /// Reduced chi-square: 1 if the residual of the fit is noise.
    pub fit_chi2_per_freedom: Option<f64>,
    /// Delay beyond that of the configuration, by the fit; `None` also with complex residues, which do not determine it.
    pub fit_delay_s: Option<f64>,
    /// Its standard deviation.
    pub fit_delay_sigma_s: Option<f64>,
    /// Phase drop over the modes: lag beyond that of a minimum-phase system of the same magnitude, 360 for each pair of CNMP
    /// zeros.
    #[serde(rename = "phase_fall_deg")]
    pub phase_drop_deg: Option<f64>,
    /// The modes of each significant model order: the stability chart.
    pub orders: Vec<ModelOrder>,
}

impl ModalSummary {
    /// The summary of a fit and its verdict.
    pub fn new(fit: Option<&ModalFit>, verdict: &Verdict) -> ModalSummary {
        let delay_s = fit.and_then(ModalFit::determined_delay_s);
        ModalSummary {
            modes: fit.map_or(Vec::new(), |fit| verdict.modes(fit)),
            fit_band_hz: fit.map(|fit| fit.band_hz),
            residues: fit.map(|fit| fit.parameters.residues.name()),
            zeros: verdict.zeros.clone(),
            cnmp: verdict.cnmp,
            why: verdict.why.clone(),
            fit_chi2_per_freedom: fit.map(|fit| fit.chi2_per_freedom),
            fit_delay_s: delay_s.map(|delay| delay.value),
            fit_delay_sigma_s: delay_s.map(|delay| delay.sigma),
            phase_drop_deg: verdict.phase_drop.map(|phase_drop| phase_drop.drop_deg),
            orders: fit.map_or(Vec::new(), |fit| fit.orders.clone()),
        }
    }
}

/// Responses and margins of a closed loop; the names in JSON must not change.
#[derive(Clone, Debug, Serialize)]
pub struct LoopOutputs {
    /// L = P C, from error to reading.
    pub loop_csv: String,
    /// S, from reference to error.
    pub sensitivity_csv: String,
    /// T, from reference to reading.
    pub complementary_csv: String,
    /// Lowest frequency at which the measured |L| falls through 1.
    pub crossover_rad_s: Option<f64>,
    /// 180 degrees + arg L there.
    pub phase_margin_deg: Option<f64>,
    /// Its standard deviation.
    pub phase_margin_sigma_deg: Option<f64>,
    /// Phase margin of smallest magnitude over all crossings of the measured |L| = 1.
    pub smallest_phase_margin_deg: Option<f64>,
    /// Its frequency.
    pub smallest_phase_margin_rad_s: Option<f64>,
    /// Number of these crossings.
    pub crossings: usize,
    /// 1/max |S| in the swept band.
    pub modulus_margin: f64,
    /// Its standard deviation.
    pub modulus_margin_sigma: f64,
    /// The modulus margin of the model.
    pub predicted_modulus_margin: f64,
}

impl LoopOutputs {
    fn write(
        closed: &ClosedResponses,
        results: ResultFiles<'_>,
    ) -> Result<LoopOutputs, OutputError> {
        let margins = &closed.margins;
        let phase_margin_deg = margins
            .crossover()
            .map(|crossing| crossing.phase_margin_deg);
        Ok(LoopOutputs {
            loop_csv: results.write_frf("loop", &closed.loop_gain, RATIO)?,
            sensitivity_csv: results.write_frf("sensitivity", &closed.sensitivity, RATIO)?,
            complementary_csv: results.write_frf("complementary", &closed.complementary, RATIO)?,
            crossover_rad_s: margins.crossover_rad_s.map(|crossover| crossover.value),
            phase_margin_deg: phase_margin_deg.map(|margin| margin.value),
            phase_margin_sigma_deg: phase_margin_deg.map(|margin| margin.sigma),
            smallest_phase_margin_deg: margins.phase_margin_deg.map(|margin| margin.value),
            smallest_phase_margin_rad_s: margins.phase_margin_rad_s,
            crossings: margins.crossings.len(),
            modulus_margin: margins.modulus_margin.value,
            modulus_margin_sigma: margins.modulus_margin.sigma,
            predicted_modulus_margin: closed.predicted.modulus_margin,
        })
    }
}

/// Whether a run was analysed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnalysisStatus {
    /// It was.
    Analysed,
    /// The run did not come to its end.
    RunIncomplete,
    /// The operator cancelled the analysis.
    Cancelled,
}

/// The files and the numbers of an analysed run; `None` where there is no response. The names in JSON must not
/// change.
#[derive(Clone, Debug, Serialize)]
pub struct AnalysisOutputs {
    /// Whether the run was analysed.
    #[serde(skip)]
    pub status: AnalysisStatus,
    /// The FRF.
    pub frf_csv: Option<String>,
    /// The FRF with the measured delay removed from its phases.
    pub frf_without_delay_csv: Option<String>,
    /// The certificate of a completed chirp.
    pub certificate: Option<String>,
    /// The signs of the residues beside those of the model.
    pub signs: Option<SignCheck>,
    /// Plots and page.
    #[serde(flatten)]
    pub pages: PageFiles,
    /// Number of frequencies.
    pub frequencies: usize,
    /// Median coherence over the band.
    pub coherence_median: Option<f64>,
    /// Number of missing ticks, whose positions were estimated.
    pub filled_ticks: u64,
    /// Mean time from a command to the position that its reading shows, by the model.
    pub delay_s: Option<f64>,
    /// Excess delay of the measured response over the model.
    pub delay_beyond_model_s: Option<f64>,
    /// Its standard deviation.
    pub delay_beyond_model_sigma_s: Option<f64>,
    /// Modes, zeros and verdict.
    #[serde(flatten)]
    pub summary: ModalSummary,
    /// The loop, if it was closed.
    #[serde(rename = "loop", skip_serializing_if = "Option::is_none")]
    pub closed: Option<LoopOutputs>,
    /// Distortion and noise, if a multisine omitted lines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub linearity: Option<Linearity>,
}

impl AnalysisOutputs {
    /// Writes the files of an analysed run, with the certificate of a completed chirp; plots and page are added by
    /// [`with_pages`](Self::with_pages).
    ///
    /// # Errors
    /// When the certificate cannot be made, or a file cannot be written.
    pub fn write(
        run: &AnalysedRun<'_>,
        results: ResultFiles<'_>,
    ) -> Result<AnalysisOutputs, OutputError> {
        let analysis = run.analysis;
        let without_delay = analysis.frf.without_delay(analysis.measured_delay_s());
        let csv = frf_csv::to_string(&analysis.frf, METRES_PER_AMPERE);
        let frf_csv = results.write("frf", "csv", &csv)?;
        let certificate = write_certificate(run, results, &frf_csv, &csv)?;
        let frf_without_delay_csv =
            results.write_frf("frf_without_delay", &without_delay, METRES_PER_AMPERE)?;
        let closed = analysis.closed.as_ref();
        Ok(AnalysisOutputs {
            frf_csv: Some(frf_csv),
            certificate,
            frf_without_delay_csv: Some(frf_without_delay_csv),
            closed: closed
                .map(|closed| LoopOutputs::write(closed, results))
                .transpose()?,
            ..AnalysisOutputs::numbers(analysis)
        })
    }

    /// The same outputs with the plots and the page of the run.
    pub fn with_pages(self, pages: PageFiles) -> AnalysisOutputs {
        AnalysisOutputs { pages, ..self }
    }

    fn numbers(analysis: &Analysis) -> AnalysisOutputs {
        AnalysisOutputs {
            frequencies: analysis.frf.len(),
            coherence_median: analysis.frf.median_coherence(),
            filled_ticks: analysis.filled_ticks,
            delay_s: Some(analysis.delay_s),
            delay_beyond_model_s: analysis.excess_delay.map(|delay| delay.value),
            delay_beyond_model_sigma_s: analysis.excess_delay.map(|delay| delay.sigma),
            signs: analysis.signs.clone(),
            summary: ModalSummary::new(analysis.fit.as_ref().ok(), &analysis.verdict),
            linearity: analysis.linearity.clone(),
            ..AnalysisOutputs::without_analysis(AnalysisStatus::Analysed, "")
        }
    }

    fn without_analysis(status: AnalysisStatus, why: &str) -> AnalysisOutputs {
        AnalysisOutputs {
            status,
            frf_csv: None,
            frf_without_delay_csv: None,
            certificate: None,
            signs: None,
            pages: PageFiles::default(),
            frequencies: 0,
            coherence_median: None,
            filled_ticks: 0,
            delay_s: None,
            delay_beyond_model_s: None,
            delay_beyond_model_sigma_s: None,
            summary: ModalSummary::new(None, &Verdict::undecided(why.into())),
            closed: None,
            linearity: None,
        }
    }

    /// The outputs of a run that did not come to its end.
    pub fn run_incomplete() -> AnalysisOutputs {
        let why = "the run did not come to its end; `bench identify` on its recording gives the response of the band that its sweep reached";
        AnalysisOutputs::without_analysis(AnalysisStatus::RunIncomplete, why)
    }

    /// The outputs of a run whose analysis was cancelled.
    pub fn cancelled() -> AnalysisOutputs {
        let why = "stopped before the analysis was done; the recording is complete: `bench identify` analyses it";
        AnalysisOutputs::without_analysis(AnalysisStatus::Cancelled, why)
    }

    /// Whether the operator cancelled the analysis.
    pub fn is_cancelled(&self) -> bool {
        self.status == AnalysisStatus::Cancelled
    }
}

/// Writes the certificate of a completed chirp beside its frequency response; returns its path.
fn write_certificate(
    run: &AnalysedRun<'_>,
    results: ResultFiles<'_>,
    frf_path: &str,
    csv: &str,
) -> Result<Option<String>, OutputError> {
    let name = Path::new(frf_path).file_name().unwrap_or_default();
    let response = ResponseFile {
        name: &name.to_string_lossy(),
        csv,
    };
    let certificate = certify(run, response)?;
    let written = certificate.map(|made| results.write("certificate", "json", &made.to_json()));
    written.transpose()
}
