//! Reduction of the data where the response is smooth.

use nalgebra::Complex;

use super::parameters::ModalParameters;
use crate::FrfDatum;
use bench_plant::zeros::ModalTerm;

/// Width of merged data as a ratio of their distance d from the nearest pole. The mean of 1/(s - p) over -+h and that at two
/// frequencies with the same spread differ by (1/5 - 1/9) (h/d)^4: 1e-8.
const POLE_DISTANCE_RATIO: f64 = 0.04;
/// Largest width as a ratio of frequency: two data still show an unknown mode of 0.4 % damping.
const FREQUENCY_RATIO: f64 = 0.004;

/// `data`, merged where the poles of `model` leave the response smooth.
pub fn merged(data: &[FrfDatum], model: &ModalParameters) -> Vec<FrfDatum> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn datum(frequency_hz: f64, spread_hz: f64, variance: f64) -> FrfDatum {
        FrfDatum {
            frequency_hz,
            spread_hz,
            response: Complex::new(frequency_hz, -2.0 * frequency_hz),
            variance,
        }
    }

    /// Data merged without a pole nearby.
    fn merged_far_from_poles(data: &[FrfDatum]) -> Vec<FrfDatum> {
        merged(data, &ModalParameters::default())
    }

    fn the_only(data: &[FrfDatum]) -> FrfDatum {
        assert_eq!(data.len(), 1, "{data:?}");
        data[0]
    }

    fn with_mode(omega_rad_s: f64, damping_ratio: f64) -> ModalParameters {
        let mode = ModalTerm {
            omega_rad_s,
            damping_ratio,
            residue_per_kg: 1.0,
        };
        ModalParameters::default().with_mode(mode)
    }

    #[test]
    fn mean_of_equal_data_has_their_variance_over_their_number() {
        for count in [1, 2, 4] {
            let data: Vec<FrfDatum> = (0..count).map(|_| datum(10.0, 0.0, 4.0)).collect();
            let mean = the_only(&merged_far_from_poles(&data));
            // Rounding.
            assert!((mean.variance - 4.0 / f64::from(count)).abs() < 1e-14);
            assert!((mean.response - data[0].response).norm() < 1e-13);
        }
    }

    #[test]
    fn data_count_by_the_inverse_of_their_variance() {
        // Weights 1 and 1/3: frequency (10 + 10.04/3)/(4/3) = 10.01, variance 1/(1 + 1/3) = 0.75.
        let data = [datum(10.0, 0.0, 1.0), datum(10.04 - 1e-9, 0.0, 3.0)];
        let mean = the_only(&merged_far_from_poles(&data));
        assert!((mean.frequency_hz - 10.01).abs() < 1e-9, "{mean:?}");
        assert!((mean.variance - 0.75).abs() < 1e-14, "{mean:?}");
        assert!((mean.response - Complex::new(10.01, -20.02)).norm() < 1e-8);
    }

    #[test]
    fn spread_of_a_mean_contains_distances_and_spreads_of_its_data() {
        // Mean square of the distances 0.01, and of the spreads (3^2 + 4^2)/2 mHz^2 = 12.5 mHz^2.
        let data = [datum(10.0, 0.003, 1.0), datum(10.02, 0.004, 1.0)];
        let mean = the_only(&merged_far_from_poles(&data));
        let expected = (1e-4_f64 + 12.5e-6).sqrt();
        // Rounding of frequencies of 10 Hz, 2e-15, over the distance of 0.01 Hz.
        assert!((mean.spread_hz / expected - 1.0).abs() < 1e-12, "{mean:?}");
        // The spread of one datum is its own.
        let single = the_only(&merged_far_from_poles(&[datum(10.0, 0.003, 1.0)]));
        assert!((single.spread_hz - 0.003).abs() < 1e-17, "{single:?}");
    }

    #[test]
    fn mean_of_means_is_the_mean_of_all() {
        let data = [
            datum(10.0, 0.001, 1.0),
            datum(10.01, 0.002, 2.0),
            datum(10.03, 0.0, 5.0),
        ];
        let all = mean(&data);
        let stepwise = mean(&[mean(&data[..2]), data[2]]);
        // Rounding, of the spread over the distance of 0.01 Hz.
        assert!((all.frequency_hz - stepwise.frequency_hz).abs() < 1e-13);
        assert!((all.variance - stepwise.variance).abs() < 1e-14);
        assert!((all.response - stepwise.response).norm() < 1e-12);
        assert!((all.spread_hz / stepwise.spread_hz - 1.0).abs() < 1e-11);
    }

    #[test]
    fn width_is_at_most_four_thousandths_of_the_frequency() {
        let count_at =
            |hz: f64| merged_far_from_poles(&[datum(10.0, 0.0, 1.0), datum(hz, 0.0, 1.0)]).len();
        assert_eq!((count_at(10.0399), count_at(10.0401)), (1, 2));
    }

    #[test]
    fn width_is_at_most_a_twenty_fifth_of_the_distance_from_the_nearest_pole() {
        let count_at = |model: &ModalParameters, hz: f64| {
            merged(&[datum(10.0, 0.0, 1.0), datum(hz, 0.0, 1.0)], model).len()
        };
        let hertz = std::f64::consts::TAU;
        // A pole at 10.5 Hz, 0.5 Hz away: 0.02 Hz. One at -0.3 + 9.6 j Hz is as far, 0.3^2 + 0.4^2 = 0.5^2.
        let size: f64 = 0.3_f64.hypot(9.6);
        for model in [
            with_mode(10.5 * hertz, 0.0),
            with_mode(size * hertz, 0.3 / size),
        ] {
            assert_eq!(count_at(&model, 10.0199), 1, "{model:?}");
            assert_eq!(count_at(&model, 10.0201), 2, "{model:?}");
        }
    }
}
