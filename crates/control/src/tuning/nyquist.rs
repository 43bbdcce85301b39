//! Stability from the number of turns of the Nyquist curve around -1.

use nalgebra::Complex;

use super::cascade::Cascade;
use super::sampled::SampledPlant;

/// Whether the closed loop of a stable plant and a cascade with one integrator is stable, by the Nyquist criterion.
///
/// From w = 0, where the integrator gives 1 + L the argument -90 deg, to pi/T, where 1 + L is real, the argument changes by
/// +90 deg if the curve does not turn around -1. The change is the sum of those between neighbouring frequencies, each within
/// +-180 deg: the grid must resolve the resonances.
pub fn is_stable(plant: &SampledPlant, cascade: &Cascade) -> bool {
    let points = 0..plant.omega_rad_s.len();
    let difference = |point| plant.response[point] * cascade.response(plant.warped[point]) + 1.0;
    let differences: Vec<Complex<f64>> = points.map(difference).collect();
    turns_to_zero(&differences)
}

/// Whether the argument, followed from its principal value at the first point, ends within +-90 deg of zero.
fn turns_to_zero(values: &[Complex<f64>]) -> bool {
    let Some(first) = values.first() else {
        return false;
    };
    let changes = values.windows(2).map(|pair| (pair[1] / pair[0]).arg());
    let last = first.arg() + changes.sum::<f64>();
    last.abs() < std::f64::consts::FRAC_PI_2
}
