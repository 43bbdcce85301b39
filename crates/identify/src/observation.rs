//! A response with the modes that were fitted to it, and how it was observed.

use bench_plant::{InputKind, OutputKind};

use crate::chi2_limits::MAX_CHI2_PER_FREEDOM;
use crate::modal::{FitError, InputPath, MeasurementChain, ModalFit};
use crate::part::{Part, fit_part, part};
use crate::remedies::Remedies;
use crate::{Frf, FrfDatum};

/// Where signals come from, apart from the kind of the output.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    /// Samples per second.
    pub(super) rate_hz: f64,
    /// What lies between the samples of the input and the force.
    pub(super) input_path: InputPath,
    /// What the input is, if that is stated.
    pub(super) input_kind: Option<InputKind>,
    /// Whether a lag may be fitted: none is stated.
    pub(super) fits_lag: bool,
}

impl Source {
    /// The chain of an output of this kind. An acceleration that steps with its input may have been read before the step or after it: the
    /// chain is the one that describes a part of the data better.
    pub(super) fn chain(&self, kind: OutputKind, data: &[FrfDatum]) -> MeasurementChain {
        let before = self.input_path.chain(self.rate_hz).observing(kind);
        let Some(after) = self.input_path.chain_after_step(self.rate_hz, kind) else {
            return before;
        };
        if cost(data, &after) < cost(data, &before) {
            after
        } else {
            before
        }
    }
}

/// chi^2 of a part and a penalty for each mode, as for a mode that is significant: modes may take the place of another chain.
fn cost(data: &[FrfDatum], chain: &MeasurementChain) -> f64 {
    let Ok(fit) = fit_part(data, chain) else {
        return f64::INFINITY;
    };
    let n = part(data).len() as f64;
    2.0 * n * fit.chi2_per_freedom + 5.0 * n.ln() * fit.parameters.modes.len() as f64
}

/// A response with its modes.
#[derive(Clone, Copy)]
pub(super) struct Observation<'a> {
    pub(super) source: Source,
    pub(super) frf: &'a Frf,
    pub(super) fit: &'a Result<ModalFit, FitError>,
    /// The chain of the fit.
    pub(super) chain: &'a MeasurementChain,
    /// The kind of the output, if the user states it.
    pub(super) stated: Option<OutputKind>,
    /// The kind of an output that is clearly another one.
    pub(super) clear_kind: Option<OutputKind>,
    /// A part of the response, through the chain of the stated kind, or of a position.
    pub(super) part: &'a Part,
    /// Step of the output, if it exceeds its noise: its errors are no noise, and fewer modes of another kind may describe them by chance.
    pub(super) output_step: Option<f64>,
    /// What to do about implausible data.
    pub(super) remedies: &'a Remedies,
}

impl Observation<'_> {
    /// Whether the fit describes the response.
    pub(super) fn is_described(&self) -> bool {
        self.fit.as_ref().is_ok_and(describes)
    }
}

/// Whether the fit describes the data.
pub(super) fn describes(fit: &ModalFit) -> bool {
    fit.chi2_per_freedom <= MAX_CHI2_PER_FREEDOM
}
