//! The analysis of external signals: response, modes and verdict, and what was done to get them.

use core::f64::consts::TAU;

use crate::Frf;
use crate::clock_skew::ClockSkew;
use crate::fitted_lag::FittedLag;
use crate::in_time::ReadingsFit;
use crate::modal::{FitError, InputPath, MeasurementChain, ModalFit};
use crate::observation::Source;
use crate::periodic_part::PeriodicPart;
use crate::prepared::Prepared;
use crate::record_check::{Correction, Resolution};
use crate::static_sign::StaticSign;
use crate::sweep_harmonics::SweepHarmonic;
use crate::verdict::{Cnmp, Verdict};
use bench_plant::{InputKind, OutputKind};

/// The analysis of external signals.
#[derive(Clone, Debug)]
pub struct ExternalAnalysis {
    /// The response from input to output.
    pub frf: Frf,
    /// Its modes, or why none can be fitted.
    pub fit: Result<ModalFit, FitError>,
    /// The verdict on CNMP zeros.
    pub verdict: Verdict,
    /// The hold of the input, and its lag, which are stated or fitted.
    pub input_path: InputPath,
    /// The lag of the input, if it was fitted.
    pub fitted_lag: Option<FittedLag>,
    /// What the input is, if that is stated.
    pub input_kind: Option<InputKind>,
    /// What the output measures: as stated, or a position. The modes and zeros are those of the position.
    pub output_kind: OutputKind,
    /// The chain from the input to the force that follows from them.
    pub chain: MeasurementChain,
    /// The analysed band in hertz.
    pub band_hz: (f64, f64),
    /// The verdict covers modes and zeros up to here, the end of the band, in rad/s.
    pub judged_up_to_rad_s: f64,
    /// Periods and distortion of a periodic record.
    pub periodic: Option<PeriodicPart>,
    /// Spikes and steps of the output that were corrected before the analysis, and samples that were left out because they are no readings.
    pub corrections: Vec<Correction>,
    /// Steps of the values of input and output that exceed their noise.
    pub resolution: Resolution,
    /// How the modes were found in time, if the output has steps above its noise or lost readings, and they describe its readings.
    pub readings_fit: Option<ReadingsFit>,
    /// By how much the clocks of input and output differ, if the output was resampled for that.
    pub clock_skew: Option<ClockSkew>,
    /// Standard deviation of the times of the readings in seconds, if they are irregular and the record does not state them.
    pub jitter_s: Option<f64>,
    /// Harmonics of a sweep in the output, which a linear plant does not have.
    pub harmonics: Vec<SweepHarmonic>,
    /// Where the signals come from.
    pub(super) source: Source,
    /// Whether it is known why modes do not describe the response: a defect, a cut, or another kind of output.
    pub(super) is_explained: bool,
    /// Whether the signals can be those of input and output of a mechanical system, so that the fit is judged.
    pub(super) is_plausible: bool,
    /// The sinusoids that were subtracted, and other cautions of the verdict.
    pub(super) cautions: Vec<String>,
}

/// Modes of a record with their verdict.
pub(super) struct Judged {
    pub(super) frf: Frf,
    pub(super) fit: Result<ModalFit, FitError>,
    pub(super) chain: MeasurementChain,
    pub(super) band_hz: (f64, f64),
    pub(super) verdict: Verdict,
    pub(super) is_plausible: bool,
}

impl ExternalAnalysis {
    /// The analysis of a record that is used as it is, with its stated input path.
    pub(super) fn of(prepared: &Prepared<'_>, judged: Judged) -> ExternalAnalysis {
        let source = prepared.source;
        ExternalAnalysis {
            frf: judged.frf,
            fit: judged.fit,
            verdict: judged.verdict,
            input_path: source.input_path,
            fitted_lag: None,
            input_kind: source.input_kind,
            output_kind: prepared.stated.unwrap_or_default(),
            chain: judged.chain,
            band_hz: judged.band_hz,
            judged_up_to_rad_s: TAU * judged.band_hz.1,
            periodic: prepared.periodic.clone(),
            corrections: Vec::new(),
            resolution: prepared.resolution,
            readings_fit: None,
            clock_skew: None,
            jitter_s: prepared.jitter_s,
            harmonics: prepared.harmonics.clone(),
            source,
            is_explained: false,
            is_plausible: judged.is_plausible,
            cautions: Vec::new(),
        }
    }

    /// The analysis of a record in which spikes and steps were corrected before.
    pub(super) fn after(self, mut corrections: Vec<Correction>) -> ExternalAnalysis {
        let verdict = self.verdict.with(Correction::description(&corrections));
        corrections.extend(self.corrections);
        ExternalAnalysis {
            verdict,
            corrections,
            ..self
        }
    }

    /// The analysis with a reason not to decide.
    pub(super) fn undecided_by(self, why: String) -> ExternalAnalysis {
        let why = match self.verdict.cnmp {
            Cnmp::Undecided => self.verdict.why,
            Cnmp::Detected | Cnmp::Excluded => why,
        };
        ExternalAnalysis {
            verdict: Verdict {
                cnmp: Cnmp::Undecided,
                why,
                is_of_stage: false,
                ..self.verdict
            },
            ..self
        }
    }

    /// The number of fitted parameters of the modes; without a fit as if there were any number.
    pub(super) fn number_of_parameters(&self) -> usize {
        let fit = self.fit.as_ref();
        fit.map_or(usize::MAX, ModalFit::number_of_parameters)
    }

    /// The sign of the static response of the position; `None` if the modes do not tell it.
    pub fn static_sign(&self) -> Option<StaticSign> {
        let fit = self.fit.as_ref().ok();
        fit.filter(|_| self.verdict.is_of_stage)
            .and_then(StaticSign::of)
    }

    pub(super) fn has_real_residues(&self) -> bool {
        let fit = self.fit.as_ref();
        fit.map_or(true, |fit| fit.parameters.has_real_residues())
    }
}
