//! Which modes of two runs are the same mode of the stage.

use bench_identify::modal::{Estimate, FittedMode};

/// Two modes are the same if they differ by no more than this ratio of their frequency, and by no more than half the distance to
/// the next mode.
const SAME_MODE_RATIO: f64 = 0.05;

/// The index in `modes`, of another run, of the mode that is mode `k` of the first run; `None` if it is not there.
pub(crate) fn same_mode(first: &[FittedMode], k: usize, modes: &[FittedMode]) -> Option<usize> {
    let here = first.get(k)?.omega_rad_s.value;
    let distance = |mode: &FittedMode| (mode.omega_rad_s.value - here).abs();
    let distances = first.iter().map(distance).filter(|away| *away > 0.0);
    let to_next = distances.fold(f64::INFINITY, f64::min);
    let (found, mode) = modes
        .iter()
        .enumerate()
        .min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)))?;
    // A rigid-body mode is at 0 in each run.
    let limit = (0.5 * to_next).min(SAME_MODE_RATIO * here);
    (distance(mode) <= limit).then_some(found)
}

/// The probability that two independent, normally distributed estimates of the same value differ at least as much as these:
/// erfc(|z|/sqrt 2) with z = (x_1 - x_2)/sqrt(sigma_1^2 + sigma_2^2).
pub(crate) fn probability_of_difference(a: Estimate, b: Estimate) -> f64 {
    let z = (a.value - b.value).abs() / libm::hypot(a.sigma, b.sigma);
    // 0/0: both without error, and equal.
    if z.is_nan() {
        return 1.0;
    }
    libm::erfc(z * std::f64::consts::FRAC_1_SQRT_2)
}
