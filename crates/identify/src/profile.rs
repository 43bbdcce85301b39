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
/// Number of the last values that are close to each other, if parabolas do not converge further.
const SETTLED_VALUES: usize = 4;
/// They are within this part of the first step.
const SETTLED: f64 = 0.05;
/// Step of the wide parabola around them, in their spread.
const WIDE: f64 = 3.0;
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
    let mut values = [value; SETTLED_VALUES];
    for _ in 0..MAX_PARABOLAS {
        let parabola = Parabola::around(value, step, &modes, &nearest);
        if !parabola.curvature.is_finite() {
            return None;
        }
        if parabola.curvature <= 0.0 {
            value -= step.copysign(parabola.slope);
        } else {
            let sigma = parabola.sigma();
            let shift = parabola.shift().clamp(-MAX_SHIFT * step, MAX_SHIFT * step);
            value += shift;
            if shift.abs() < NEGLIGIBLE_SIGMAS * sigma {
                let is_within = (low..=high).contains(&value);
                let value = Estimate { value, sigma };
                let modes = parabola.modes;
                return is_within.then_some(Best { value, modes });
            }
            step = step.min(shift.abs()).max(sigma);
        }
        modes = parabola.modes;
        if !(low..=high).contains(&value) {
            return None;
        }
        values.rotate_left(1);
        values[SETTLED_VALUES - 1] = value;
    }
    settled(start, values, &modes, nearest)
}

/// The value of least chi^2 by a wide parabola around the last values, if these are close to each other. (Fits of modes that are hardly
/// determined end with chi^2 a few units above its minimum, and narrow parabolas do not converge.)
fn settled(
    start: &Start<'_>,
    last: [f64; SETTLED_VALUES],
    modes: &ModalParameters,
    nearest: impl Fn(f64, &ModalParameters) -> Nearest,
) -> Option<Best> {
    let highest = last.into_iter().fold(f64::NEG_INFINITY, f64::max);
    let lowest = last.into_iter().fold(f64::INFINITY, f64::min);
    let spread = highest - lowest;
    if spread > SETTLED * start.step {
        return None;
    }
    let (middle, step) = (0.5 * (lowest + highest), WIDE * spread);
    let parabola = Parabola::around(middle, step, modes, nearest);
    let value = Estimate {
        value: middle + parabola.shift(),
        sigma: parabola.sigma().hypot(spread),
    };
    let is_minimum = parabola.curvature > 0.0 && parabola.shift().abs() < step;
    is_minimum.then_some(Best {
        value,
        modes: parabola.modes,
    })
}

/// chi^2 around a value of the parameter, by three fits.
struct Parabola {
    /// d chi^2/dx.
    slope: f64,
    /// d^2 chi^2/dx^2.
    curvature: f64,
    /// Reduced chi-square, at least 1.
    misfit: f64,
    /// The modes at the value.
    modes: ModalParameters,
}

impl Parabola {
    fn around(
        value: f64,
        step: f64,
        modes: &ModalParameters,
        nearest: impl Fn(f64, &ModalParameters) -> Nearest,
    ) -> Parabola {
        let [below, middle, above] =
            [value - step, value, value + step].map(|value| nearest(value, modes));
        Parabola {
            slope: (above.chi2 - below.chi2) / (2.0 * step),
            curvature: (below.chi2 + above.chi2 - 2.0 * middle.chi2) / (step * step),
            misfit: middle.chi2_per_freedom.max(1.0),
            modes: middle.parameters,
        }
    }

    /// From the value to the minimum, with a positive curvature.
    fn shift(&self) -> f64 {
        -self.slope / self.curvature
    }

    /// Standard deviation of the parameter, with a positive curvature; the misfit counts as noise.
    fn sigma(&self) -> f64 {
        (2.0 * self.misfit / self.curvature).sqrt()
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Least value of the parameter, and the standard deviation that belongs to the curvature of chi^2.
    const TRUE_VALUE: f64 = 0.3;
    const TRUE_SIGMA: f64 = 1e-3;

    /// chi^2 of a parabola with something up to `roughness` added, different at each value.
    fn rough(value: f64, roughness: f64) -> Nearest {
        let sigmas = (value - TRUE_VALUE) / TRUE_SIGMA;
        let mixed = value.to_bits().wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let part = (mixed >> 11) as f64 / (1u64 << 53) as f64;
        Nearest {
            parameters: ModalParameters::default(),
            chi2: 2000.0 + sigmas * sigmas + roughness * part,
            chi2_per_freedom: 1.0,
        }
    }

    /// From 100 starts: the values that are found.
    fn found(roughness: f64) -> Vec<Estimate> {
        let modes = ModalParameters::default();
        let from = |k: u32| {
            let start = Start {
                modes: &modes,
                value: TRUE_VALUE + 1e-3 * (f64::from(k) - 50.0) + 1e-6,
                step: 0.05,
                limits: (0.0, 1.0),
            };
            best(&start, |value, _| rough(value, roughness))
        };
        let found = (0..100).filter_map(from);
        found.map(|best| best.value).collect()
    }

    #[test]
    fn finds_the_minimum_of_a_smooth_parabola_from_every_start() {
        let found = found(0.0);
        assert_eq!(found.len(), 100);
        for value in found {
            // The search ends with a shift of 0.1 sigma; rounding of 2000 leaves 1e-12 of a curvature of 1.
            assert!(
                (value.value - TRUE_VALUE).abs() < 1e-6 * TRUE_SIGMA,
                "{value:?}"
            );
            assert!((value.sigma / TRUE_SIGMA - 1.0).abs() < 1e-3, "{value:?}");
        }
    }

    #[test]
    fn finds_the_minimum_where_chi2_is_rough() {
        let found = found(4.0);
        // Without the wide parabola about a quarter is found.
        assert!(found.len() >= 60, "{}", found.len());
        for value in found {
            assert!(
                (value.value - TRUE_VALUE).abs() < 5.0 * value.sigma,
                "{value:?}"
            );
            assert!(value.sigma < 10.0 * TRUE_SIGMA, "{value:?}");
        }
    }
}
