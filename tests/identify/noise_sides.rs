//! H1, H2 and Hv with noise on the output, on the input and on both.

use bench_test_support::gain_in_noise::{ESTIMATORS, GAIN, NOISE, every_way, signals};
use nalgebra::Complex;

/// |H1|/|H2| is the coherence. The sums have hundreds of terms, so that rounding is below 1e-9.
#[test]
fn magnitudes_of_h1_hv_and_h2_differ_by_the_coherence() {
    for (name, estimate) in
        [("constant", every_way()), ("welch", every_way())].map(|(name, ways)| {
            (
                name,
                ways.into_iter()
                    .find(|(other, _)| *other == name)
                    .unwrap()
                    .1,
            )
        })
    {
        let signals = signals(3, NOISE, NOISE);
        let [h1, h2, hv] = ESTIMATORS.map(|estimator| estimate(&signals, estimator).unwrap());
        for k in 0..h1.len() {
            let [low, high, middle] = [&h1, &h2, &hv].map(|frf| frf.response[k].norm());
            assert!(
                low < middle && middle < high,
                "{name}: {low} {middle} {high}"
            );
            assert!(
                (low / high / h1.coherence[k] - 1.0).abs() < 1e-9,
                "{name}: {}",
                low / high
            );
            assert!(
                (middle * middle / (low * high) - 1.0).abs() < 1e-9,
                "{name}"
            );
            assert!(
                (hv.response[k] / h1.response[k]).arg().abs() < 1e-9,
                "{name}"
            );
        }
    }
}

/// Rounding of 1e-16 per sample, relative to the smallest bin of a white spectrum, is below 1e-12.
#[test]
fn all_estimators_agree_without_noise() {
    for (name, estimate) in every_way() {
        for estimator in ESTIMATORS {
            let frf = estimate(&signals(4, 0.0, 0.0), estimator).unwrap();
            let off = frf
                .response
                .iter()
                .map(|h| (h / GAIN - 1.0).norm())
                .fold(0.0, f64::max);
            assert!(off < 1e-10, "{name} {estimator:?}: {off}");
        }
    }
}

/// Bias in the closed form. One record of the estimator `constant` has 4,900/11 = 450 independent estimates, each with a standard
/// deviation of sqrt(0.05/11) = 7 %: the standard error of the mean is 0.3 %. The bound is four times that; the largest bias is 5 %.
/// The statistical suite has a bound of 0.4 %, for all estimators.
#[test]
fn bias_of_h1_h2_and_hv_on_one_record_equals_the_closed_form() {
    let [(_, estimate), ..] = every_way();
    for (on_input, on_output) in [(NOISE, 0.0), (0.0, NOISE), (NOISE, NOISE)] {
        let expected = [
            1.0 / (1.0 + on_input),
            1.0 + on_output,
            ((1.0 + on_output) / (1.0 + on_input)).sqrt(),
        ];
        let signals = signals(1, on_input, on_output);
        for (estimator, expected) in ESTIMATORS.into_iter().zip(expected) {
            let frf = estimate(&signals, estimator).unwrap();
            let mean = frf.response.iter().sum::<Complex<f64>>() / (GAIN * frf.len() as f64);
            assert!(
                (mean - expected).norm() < 0.013,
                "{estimator:?} {on_input} {on_output}: {mean} is not {expected}"
            );
        }
    }
}
