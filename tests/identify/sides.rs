//! H1, H2 and Hv with noise on the output, on the input and on both.

use bench::identify::{
    Estimator, EstimatorSettings, Frf, IdentifyError, LocalModel, Signals, local, welch,
};
use nalgebra::Complex;

use crate::stage::Dice;

const GAIN: f64 = 1.5e-4;
const BAND_HZ: (f64, f64) = (5.0, 495.0);
/// Power of the noise over that of the signal, at every frequency.
const NOISE: f64 = 0.05;
const SEEDS: u64 = 10;
const ALL: [Estimator; 3] = [Estimator::H1, Estimator::H2, Estimator::Hv];

type Estimate = dyn Fn(&Signals, Estimator) -> Result<Frf, IdentifyError>;

/// White input through a gain: no leakage, no curvature. Noise on input and output with a given ratio of the signal's power.
fn signals(seed: u64, on_input: f64, on_output: f64) -> Signals {
    let mut dice = Dice::new(seed);
    let truth: Vec<f64> = (0..10_000).map(|_| dice.normal()).collect();
    let mut noisy = |gain: f64, noise: f64| -> Vec<f64> {
        truth
            .iter()
            .map(|u| gain * (u + noise.sqrt() * dice.normal()))
            .collect()
    };
    Signals {
        rate_hz: 1000.0,
        input_a: noisy(1.0, on_input),
        output_m: noisy(GAIN, on_output),
    }
}

fn by_curves(curve: LocalModel) -> impl Fn(&Signals, Estimator) -> Result<Frf, IdentifyError> {
    move |signals, estimator| {
        let settings = EstimatorSettings {
            curve,
            estimator,
            resolution_ratio: 0.0,
            ..EstimatorSettings::default()
        };
        local::estimate(signals, BAND_HZ, &settings)
    }
}

fn by_segments(signals: &Signals, estimator: Estimator) -> Result<Frf, IdentifyError> {
    welch::estimate(signals, BAND_HZ, 500, estimator)
}

fn every_way() -> [(&'static str, Box<Estimate>); 4] {
    [
        ("constant", Box::new(by_curves(LocalModel::Constant))),
        ("polynomial", Box::new(by_curves(LocalModel::Polynomial))),
        ("rational", Box::new(by_curves(LocalModel::Rational))),
        ("welch", Box::new(by_segments)),
    ]
}

/// Mean of H over the gain, and the shares of magnitudes and phases within 1.96 of their sigmas, over frequencies and seeds.
fn over_seeds(
    estimate: &Estimate,
    estimator: Estimator,
    on_input: f64,
    on_output: f64,
) -> (Complex<f64>, [f64; 2]) {
    let (mut sum, mut held, mut count) = (Complex::from(0.0), [0.0; 2], 0.0);
    for seed in 1..=SEEDS {
        let frf = estimate(&signals(seed, on_input, on_output), estimator).unwrap();
        for (k, h) in frf.response.iter().enumerate() {
            sum += h / GAIN;
            held[0] += f64::from((h.norm() - GAIN).abs() <= 1.96 * frf.magnitude_sigma[k]);
            held[1] += f64::from(h.arg().abs() <= 1.96 * frf.phase_sigma_rad[k]);
            count += 1.0;
        }
    }
    (sum / count, held.map(|held| held / count))
}

/// One estimate has some 11 bins: a sigma of sqrt(0.05/11) = 7 %; so many independent ones in ten records are 4,900/11 10 =
/// 4,400: 0.1 %. Four of that.
#[test]
fn bias_of_each_estimator_equals_the_closed_form_for_input_and_output_noise() {
    let bias = |estimator, on_input: f64, on_output: f64| match estimator {
        Estimator::H1 => 1.0 / (1.0 + on_input),
        Estimator::H2 => 1.0 + on_output,
        Estimator::Hv => ((1.0 + on_output) / (1.0 + on_input)).sqrt(),
    };
    for (name, estimate) in every_way() {
        for (on_input, on_output) in [(NOISE, 0.0), (0.0, NOISE), (NOISE, NOISE)] {
            for estimator in ALL {
                let (mean, _) = over_seeds(&*estimate, estimator, on_input, on_output);
                let expected = bias(estimator, on_input, on_output);
                println!("{name} {estimator:?} {on_input} {on_output}: {mean:.4} {expected:.4}");
                assert!(
                    (mean - expected).norm() < 0.004,
                    "{name} {estimator:?}: {mean} is not {expected}"
                );
            }
        }
    }
}

/// The unbiased estimate of each case. 4,400 independent ones: a standard deviation of 0.3 %. Sigma of the magnitude of Hv is
/// 1.05 times too large: 96 % in place of 95.
#[test]
fn confidence_intervals_of_each_unbiased_estimator_contain_the_truth() {
    for (name, estimate) in every_way() {
        for (estimator, on_input, on_output) in [
            (Estimator::H1, 0.0, NOISE),
            (Estimator::H2, NOISE, 0.0),
            (Estimator::Hv, NOISE, NOISE),
        ] {
            let (_, held) = over_seeds(&*estimate, estimator, on_input, on_output);
            println!("{name} {estimator:?}: {held:?}");
            assert!(
                held.iter().all(|share| (0.93..0.975).contains(share)),
                "{name} {estimator:?}: {held:?}"
            );
        }
    }
}

/// H1/H2 is the coherence; rounding is of sums of hundreds of terms.
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
        let [h1, h2, hv] = ALL.map(|estimator| estimate(&signals, estimator).unwrap());
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

/// Rounding of 1e-16 of each sample, over the least bin of a white spectrum, is below 1e-12.
#[test]
fn all_estimators_agree_without_noise() {
    for (name, estimate) in every_way() {
        for estimator in ALL {
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
