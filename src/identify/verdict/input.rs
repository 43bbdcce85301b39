//! Input of a verdict, and the certainty of a sign.

use crate::identify::FrfDatum;
use crate::identify::modal::{FittedMode, MeasurementChain, ModalFit};

/// A residue with a larger probability of the opposite sign has no certain sign.
const WRONG_SIGN_PROBABILITY: f64 = 1e-3;

/// Input of a verdict.
#[derive(Clone, Copy, Debug)]
pub struct VerdictInput<'a> {
    /// The fitted modes.
    pub fit: &'a ModalFit,
    /// The chain through which the mechanics were observed.
    pub chain: &'a MeasurementChain,
    /// The fitted data, frequencies rising.
    pub frf_data: &'a [FrfDatum],
    /// The verdict covers zeros and modes up to here, in rad/s.
    pub up_to_rad_s: f64,
    /// Number of modes of the model in that band with a residue between its actuator and its probe.
    pub expected_modes: Option<usize>,
}

impl VerdictInput<'_> {
    /// Whether the verdict covers an angular frequency: from the first datum to the upper limit.
    pub(super) fn covers(&self, omega_rad_s: f64) -> bool {
        let low_rad_s = self.frf_data.first().map_or(0.0, FrfDatum::omega_rad_s);
        omega_rad_s <= self.up_to_rad_s && omega_rad_s >= low_rad_s
    }
}

/// Whether the sign of a residue is certain.
pub(super) fn has_certain_sign(mode: &FittedMode) -> bool {
    is_certain_sign(mode.sign_error_probability())
}

/// Whether a sign with this probability of error is certain.
pub(super) fn is_certain_sign(error_probability: f64) -> bool {
    error_probability <= WRONG_SIGN_PROBABILITY
}
