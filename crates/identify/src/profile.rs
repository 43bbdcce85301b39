//! One parameter beside those of the modes: its value of least chi^2, and its error in a fit.
//!
//! ```text
//! chi^2(x) = min over the modes of chi^2(x, modes)         (profile of the likelihood)
//! sigma_x^2 = 2/(d^2 chi^2/d x^2)
//! ```
//!
//! The minimum is found by parabolas through three fits of the same number of modes.

use crate::Estimate;
use crate::modal::{ModalFit, ModalParameters, Nearest};

/// Largest shift of a parabola in steps.
const MAX_SHIFT: f64 = 4.0;
/// Largest number of parabolas.
const MAX_PARABOLAS: usize = 10;
/// A better value of the parameter decreases chi^2 at least to this part of it, while modes do not describe the data.
const MAX_REMAINDER: f64 = 0.9;
/// A change by fewer standard deviations is negligible.
pub(crate) const NEGLIGIBLE_SIGMAS: f64 = 0.1;

/// Where the search begins.
pub(crate) struct Start<'a> {
    /// The modes.
    pub(crate) modes: &'a ModalParameters,
    /// The value of the parameter.
    pub(crate) value: f64,
    /// The first step to either side.
    pub(crate) step: f64,
    /// The limits of the parameter.
    pub(crate) limits: (f64, f64),
}

/// The value of least chi^2, and its modes.
pub(crate) struct Best {
    pub(crate) value: Estimate,
    pub(crate) modes: ModalParameters,
}

/// The value of least chi^2 near the start; `None` without one between the limits. `nearest` gives the modes of least chi^2 at a value
/// of the parameter, near given ones.
pub(crate) fn best(
    start: &Start<'_>,
    nearest: impl Fn(f64, &ModalParameters) -> Nearest,
) -> Option<Best> {
    let (low, high) = start.limits;
    let (mut modes, mut value, mut step) = (start.modes.clone(), start.value, start.step);
    for _ in 0..MAX_PARABOLAS {
        let [below, middle, above] =
            [value - step, value, value + step].map(|value| nearest(value, &modes));
        let curvature = (below.chi2 + above.chi2 - 2.0 * middle.chi2) / (step * step);
        let slope = (above.chi2 - below.chi2) / (2.0 * step);
        modes = middle.parameters;
        if !curvature.is_finite() {
            return None;
        }
        if curvature <= 0.0 {
            value -= step.copysign(slope);
        } else {
            let misfit = middle.chi2_per_freedom.max(1.0);
            let sigma = (2.0 * misfit / curvature).sqrt();
            let shift = (-slope / curvature).clamp(-MAX_SHIFT * step, MAX_SHIFT * step);
            value += shift;
            if shift.abs() < NEGLIGIBLE_SIGMAS * sigma {
                let is_within = (low..=high).contains(&value);
                let value = Estimate { value, sigma };
                return is_within.then_some(Best { value, modes });
            }
            step = step.min(shift.abs()).max(sigma);
        }
        if !(low..=high).contains(&value) {
            return None;
        }
    }
    None
}

/// Whether a fit with a better value of the parameter describes the data better than the one before.
pub(crate) fn is_progress(before: &ModalFit, next: &ModalFit) -> bool {
    next.chi2_per_freedom < MAX_REMAINDER * before.chi2_per_freedom
}

/// A fit with the error of the parameter in its covariance: that of the modes if it changes by a standard deviation, d, adds d d'.
pub(crate) fn with_error(
    fit: ModalFit,
    of: Estimate,
    nearest: impl Fn(f64, &ModalParameters) -> Nearest,
) -> ModalFit {
    let at = |value| nearest(value, &fit.parameters).parameters.free_values();
    let change = (at(of.value + of.sigma) - at(of.value - of.sigma)) * 0.5;
    ModalFit {
        covariance: &fit.covariance + &change * change.transpose(),
        ..fit
    }
}
