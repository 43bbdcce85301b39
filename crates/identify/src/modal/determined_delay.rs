//! The delay of a fit with complex residues.
//!
//! exp(-s d) (r + q s) = r + (q - r d) s + ...: complex residues represent a delay as well, and the data determine neither
//! their common part nor the delay. The search varies both. For the result the delay is fixed where the imaginary parts are smallest:
//!
//! ```text
//! sum of w^2 (q + r d)^2 = min!           d = -sum of w^2 q r/sum of w^2 r^2
//! ```
//!
//! which is the delay itself if the residues are real. Poles and zeros in the band do not depend on d.

use super::parameters::ModalParameters;
use super::refine::refine;
use super::solution::Problem;
use crate::FrfDatum;

/// Largest number of changes of the delay.
const MAX_DELAY_CHANGES: usize = 4;
/// A change that turns the response by less than this angle in radians at the end of the band is negligible.
const NEGLIGIBLE_ANGLE_RAD: f64 = 1e-3;

/// Parameters with complex residues, refined at a fixed delay for which their imaginary parts are smallest; those with real residues as
/// they are.
pub(super) fn with_determined_delay(
    problem: Problem<'_>,
    start: ModalParameters,
) -> ModalParameters {
    if start.has_real_residues() {
        return start;
    }
    let start = ModalParameters {
        has_fixed_delay: true,
        ..start
    };
    let mut best = refine(problem, start, 0.0);
    let last_rad_s = problem.data.last().map_or(0.0, FrfDatum::omega_rad_s);
    for _ in 0..MAX_DELAY_CHANGES {
        let change_s = smallest_imaginary_parts_s(&best.parameters);
        let moved = best.parameters.clone().with_longer_delay(change_s);
        let next = refine(problem, moved, 0.0);
        let increase = next.chi2 - best.chi2;
        // The delay is worth one parameter, chi^2 a half of one each.
        let is_as_good = increase <= problem.misfit(best.chi2);
        if !is_as_good {
            break;
        }
        best = next;
        if (change_s * last_rad_s).abs() < NEGLIGIBLE_ANGLE_RAD {
            break;
        }
    }
    best.parameters
}

/// d in seconds: the change of the delay with the smallest imaginary parts; 0 if all real parts are 0.
fn smallest_imaginary_parts_s(parameters: &ModalParameters) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for (k, mode) in parameters.modes.iter().enumerate() {
        let (w2, r) = (mode.omega_rad_s.powi(2), mode.residue_per_kg);
        product += w2 * parameters.rate_s_per_kg(k) * r;
        square += w2 * r * r;
    }
    if square > 0.0 { -product / square } else { 0.0 }
}
