//! Fewer frf_data where the response is smooth.

use nalgebra::Complex;

use super::refine::Parameters;
use crate::identify::FrfDatum;

/// Width of a merged block as a ratio of its distance d from the nearest pole. The mean of 1/(s - p) over -+h and that at two
/// frequencies of the same spread differ by (1/5 - 1/9) (h/d)^4: 1e-8.
const OF_DISTANCE: f64 = 0.04;
/// Width at most, as a ratio of frequency: two of them still show a mode of 0.4 % damping that nobody knows of.
const OF_FREQUENCY: f64 = 0.004;

/// `frf_data` merged as far as the poles of `sum` leave the response smooth.
pub(super) fn merged(frf_data: &[FrfDatum], sum: &Parameters) -> Vec<FrfDatum> {
    let mut merged = Vec::new();
    let mut rest = frf_data;
    while let Some(first) = rest.first() {
        let widest_hz = widest_hz(first.frequency_hz, sum);
        let count = rest
            .iter()
            .take_while(|b| b.frequency_hz - first.frequency_hz <= widest_hz)
            .count();
        merged.push(one(&rest[..count]));
        rest = &rest[count..];
    }
    merged
}

fn widest_hz(frequency_hz: f64, sum: &Parameters) -> f64 {
    let s = Complex::new(0.0, 2.0 * std::f64::consts::PI * frequency_hz);
    let distance = |w: f64, zeta: f64| {
        (s - Complex::new(-zeta * w, w * (1.0 - zeta * zeta).max(0.0).sqrt())).norm()
    };
    let nearest = sum
        .modes
        .iter()
        .map(|mode| distance(mode.omega_rad_s, mode.damping_ratio))
        .fold(f64::INFINITY, f64::min);
    (OF_DISTANCE * nearest / (2.0 * std::f64::consts::PI)).min(OF_FREQUENCY * frequency_hz)
}

/// The mean of some frf_data, each with the weight that its error leaves it.
fn one(frf_data: &[FrfDatum]) -> FrfDatum {
    let weight: f64 = frf_data.iter().map(|b| 1.0 / b.variance).sum();
    let mean = |of: &dyn Fn(&FrfDatum) -> f64| {
        frf_data.iter().map(|b| of(b) / b.variance).sum::<f64>() / weight
    };
    let frequency_hz = mean(&|b| b.frequency_hz);
    let square = |b: &FrfDatum| (b.frequency_hz - frequency_hz).powi(2) + b.spread_hz * b.spread_hz;
    FrfDatum {
        frequency_hz,
        spread_hz: mean(&square).sqrt(),
        response: Complex::new(mean(&|b| b.response.re), mean(&|b| b.response.im)),
        variance: 1.0 / weight,
    }
}
