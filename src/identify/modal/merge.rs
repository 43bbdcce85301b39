//! Reduction of the data where the response is smooth.

use nalgebra::Complex;

use super::parameters::ModalParameters;
use crate::identify::FrfDatum;
use crate::model::zeros::ModalTerm;

/// Width of merged data as a ratio of their distance d from the nearest pole. The mean of 1/(s - p) over -+h and that at two
/// frequencies with the same spread differ by (1/5 - 1/9) (h/d)^4: 1e-8.
const POLE_DISTANCE_RATIO: f64 = 0.04;
/// Largest width as a ratio of frequency: two data still show an unknown mode of 0.4 % damping.
const FREQUENCY_RATIO: f64 = 0.004;

/// `data`, merged where the poles of `model` leave the response smooth.
pub(crate) fn merged(data: &[FrfDatum], model: &ModalParameters) -> Vec<FrfDatum> {
    let mut merged = Vec::new();
    let mut rest = data;
    while let Some(first) = rest.first() {
        let width_hz = max_width_hz(first, model);
        let within = rest
            .iter()
            .take_while(|datum| datum.frequency_hz - first.frequency_hz <= width_hz);
        let (group, remainder) = rest.split_at(within.count());
        merged.push(mean(group));
        rest = remainder;
    }
    merged
}

fn max_width_hz(datum: &FrfDatum, model: &ModalParameters) -> f64 {
    let nearest = nearest_pole_rad_s(datum, model);
    let by_pole_hz = POLE_DISTANCE_RATIO * nearest / (2.0 * std::f64::consts::PI);
    by_pole_hz.min(FREQUENCY_RATIO * datum.frequency_hz)
}

/// Distance of the nearest pole from a datum on the imaginary axis, in rad/s; infinite without modes.
fn nearest_pole_rad_s(datum: &FrfDatum, model: &ModalParameters) -> f64 {
    let s = Complex::new(0.0, datum.omega_rad_s());
    let distances = model.modes.iter().map(|mode| (s - pole(mode)).norm());
    distances.fold(f64::INFINITY, f64::min)
}

/// The pole of a mode above the real axis; on the axis beyond critical damping.
fn pole(mode: &ModalTerm) -> Complex<f64> {
    let (w, zeta) = (mode.omega_rad_s, mode.damping_ratio);
    Complex::new(-zeta * w, w * (1.0 - zeta * zeta).max(0.0).sqrt())
}

/// The mean of some data, weighted with the inverse of their variances.
fn mean(data: &[FrfDatum]) -> FrfDatum {
    let weight = weighted_sum(data, |_| 1.0);
    let frequency_hz = weighted_sum(data, |datum| datum.frequency_hz) / weight;
    let square = weighted_sum(data, |datum| {
        (datum.frequency_hz - frequency_hz).powi(2) + datum.spread_hz * datum.spread_hz
    });
    let re = weighted_sum(data, |datum| datum.response.re);
    let im = weighted_sum(data, |datum| datum.response.im);
    FrfDatum {
        frequency_hz,
        spread_hz: (square / weight).sqrt(),
        response: Complex::new(re / weight, im / weight),
        variance: 1.0 / weight,
    }
}

/// The sum of a value over its variance.
fn weighted_sum(data: &[FrfDatum], value: impl Fn(&FrfDatum) -> f64) -> f64 {
    data.iter().map(|datum| value(datum) / datum.variance).sum()
}
