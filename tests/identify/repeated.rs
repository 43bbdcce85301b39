//! Repetitions of one chirp, each at rest at its ends.

use bench_identify::{EstimatorSettings, Frf, Signals, local, repeated};

use crate::identify::stage::{self, Dice, RATE_HZ, SampledPlant};

const BAND_HZ: (f64, f64) = (2.0, 60.0);
const REPETITIONS: usize = 5;

/// One chirp of four seconds with six seconds of rest, without noise.
fn once() -> Signals {
    let input_a = stage::chirp_of(4.0, 0.5, 5.5);
    let output_m = SampledPlant::stage().simulate(&input_a);
    Signals {
        rate_hz: RATE_HZ,
        input: input_a,
        output: output_m,
    }
}

/// The chirp repeated, with white noise on input and output.
fn repetitions(seed: u64, noise_a: f64, noise_m: f64) -> Signals {
    let (once, mut dice) = (once(), Dice::new(seed));
    let mut noisy = |samples: &[f64], noise: f64| -> Vec<f64> {
        let all = std::iter::repeat_n(samples, REPETITIONS).flatten();
        all.map(|x| {
            x + if noise > 0.0 {
                noise * dice.normal()
            } else {
                0.0
            }
        })
        .collect()
    };
    Signals {
        rate_hz: RATE_HZ,
        input: noisy(&once.input, noise_a),
        output: noisy(&once.output, noise_m),
    }
}

fn estimate(signals: &Signals) -> Frf {
    let mean = repeated::mean(signals, once().len(), REPETITIONS);
    local::estimate(&mean, BAND_HZ, &EstimatorSettings::default()).unwrap()
}

/// Shares of magnitudes and phases within 1.96 sigma over seeds.
fn coverage(seeds: u64, noise_a: f64, noise_m: f64) -> [f64; 2] {
    let plant = SampledPlant::stage();
    let (mut covered, mut count) = ([0.0; 2], 0.0);
    for seed in 1..=seeds {
        let frf = estimate(&repetitions(seed, noise_a, noise_m));
        for (k, f) in frf.frequency_hz.iter().enumerate() {
            let truth = plant.response(*f);
            covered[0] += f64::from(
                (frf.response[k].norm() - truth.norm()).abs() <= 1.96 * frf.magnitude_sigma[k],
            );
            covered[1] +=
                f64::from((frf.response[k] / truth).arg().abs() <= 1.96 * frf.phase_sigma_rad[k]);
            count += 1.0;
        }
    }
    covered.map(|covered| covered / count)
}

/// 580 bins of 0.1 Hz, 11 per estimate, and 40 seeds give 2,100 independent estimates: the standard deviation of the share is 0.5 %.
#[test]
fn confidence_intervals_of_the_mean_of_repetitions_contain_the_truth() {
    let coverage = coverage(40, 0.0, 1e-6);
    println!("{coverage:?}");
    assert!(
        coverage.iter().all(|share| (0.93..0.97).contains(share)),
        "{coverage:?}"
    );
}

#[test]
fn confidence_intervals_include_noise_of_the_measured_input() {
    // The power of the input noise is 1e-4 of that of the chirp: the bias is negligible.
    let coverage = coverage(40, 2e-3, 1e-9);
    println!("{coverage:?}");
    assert!(
        coverage.iter().all(|share| (0.92..0.975).contains(share)),
        "{coverage:?}"
    );
}

/// 1/sqrt(5) = 0.447. The sigma of one record has an error of about 10 %; the median over the band is far more accurate.
#[test]
fn sigma_falls_with_the_square_root_of_the_number_of_repetitions() {
    let all = repetitions(7, 0.0, 1e-6);
    let length = once().len();
    let first = Signals {
        rate_hz: RATE_HZ,
        input: all.input[..length].to_vec(),
        output: all.output[..length].to_vec(),
    };
    let one = local::estimate(&first, BAND_HZ, &EstimatorSettings::default()).unwrap();
    let mean = estimate(&all);
    assert_eq!(mean.frequency_hz, one.frequency_hz);
    let mut ratios: Vec<f64> = mean
        .magnitude_sigma
        .iter()
        .zip(&one.magnitude_sigma)
        .map(|(mean, one)| mean / one)
        .collect();
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    assert!((0.40..0.49).contains(&median), "{median}");
}

#[test]
fn ignores_samples_after_the_last_whole_repetition() {
    let mut all = repetitions(7, 0.0, 1e-6);
    let whole = estimate(&all);
    all.input.extend([1.0; 100]);
    all.output.extend([1e-3; 100]);
    assert_eq!(estimate(&all), whole);
}

#[test]
fn mean_is_over_whole_repetitions() {
    let samples: Vec<f64> = (0..11).map(f64::from).collect();
    let signals = Signals {
        rate_hz: 1.0,
        input: samples.clone(),
        output: samples,
    };
    // Samples 0 to 3 and 4 to 7; 8 to 10 are not a whole repetition.
    assert_eq!(repeated::mean(&signals, 4, 3).input, [2.0, 3.0, 4.0, 5.0]);
    assert_eq!(repeated::mean(&signals, 4, 1).output, [0.0, 1.0, 2.0, 3.0]);
    assert_eq!(
        repeated::mean(&signals, 20, 1).len(),
        11,
        "a record without a whole repetition is unchanged"
    );
    assert_eq!(repeated::mean(&signals, 0, 1).len(), 11);
}
