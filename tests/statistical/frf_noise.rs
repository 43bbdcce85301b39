//! The standard deviations of a frequency response match its errors.

use bench_identify::{EstimatorSettings, Frf, Signals, local};
use bench_test_support::stage::{self, RATE_HZ, SampledPlant};

fn estimate(signals: &Signals, band_hz: (f64, f64)) -> Frf {
    local::estimate(signals, band_hz, &EstimatorSettings::default()).unwrap()
}

/// Errors of magnitude and phase in units of their sigmas, with their frequency.
fn errors(frf: &Frf, plant: &SampledPlant) -> Vec<(f64, f64, f64)> {
    let error = |k: usize| {
        let truth = plant.response(frf.frequency_hz[k]);
        let magnitude = (frf.response[k].norm() - truth.norm()) / frf.magnitude_sigma[k];
        let phase = (frf.response[k] / truth).arg() / frf.phase_sigma_rad[k];
        (frf.frequency_hz[k], magnitude, phase)
    };
    (0..frf.len()).map(error).collect()
}

fn share(errors: &[(f64, f64, f64)], of: impl Fn(&(f64, f64, f64)) -> f64) -> f64 {
    errors.iter().filter(|e| of(e).abs() <= 2.0).count() as f64 / errors.len() as f64
}

/// Normally distributed errors are within 2 sigma with a probability of 95.4 %. Neighbouring frequencies are correlated: about 2000 of
/// the 8700 are independent, so that the standard deviation of the share is 0.5 %. The requirement is 90 % to 99.9 %.
fn assert_sigma_matches(errors: &[(f64, f64, f64)], what: &str) {
    let (magnitude, phase) = (share(errors, |e| e.1), share(errors, |e| e.2));
    println!(
        "{what}: {} frequencies, within 2 sigma: magnitude {magnitude:.4}, phase {phase:.4}",
        errors.len()
    );
    assert!(
        (0.90..=0.999).contains(&magnitude),
        "{what}: magnitude within 2 sigma at {magnitude} of the frequencies"
    );
    assert!(
        (0.90..=0.999).contains(&phase),
        "{what}: phase within 2 sigma at {phase} of the frequencies"
    );
}

#[test]
fn at_least_90_percent_of_errors_are_within_two_sigma_for_every_seed() {
    let (clean, plant) = (stage::clean_run(), SampledPlant::stage());
    for seed in 1..=5 {
        let errors = errors(
            &estimate(&stage::with_noise(&clean, seed), (0.5, 450.0)),
            &plant,
        );
        assert_sigma_matches(&errors, &format!("seed {seed}"));
        // Sigma is neither too large nor too small: the root mean square of error/sigma is 1, within 10 %.
        let square = errors
            .iter()
            .map(|e| (e.1 * e.1 + e.2 * e.2) / 2.0)
            .sum::<f64>()
            / errors.len() as f64;
        assert!(
            (0.9..1.1).contains(&square.sqrt()),
            "seed {seed}: error/sigma is {} RMS",
            square.sqrt()
        );
    }
}

/// Frequencies within 3 zeta f0 of a mode: there the bias by smoothing would be larger than the noise.
#[test]
fn at_least_90_percent_of_errors_are_within_two_sigma_around_resonances() {
    let (clean, plant) = (stage::clean_run(), SampledPlant::stage());
    let mut near = Vec::new();
    for seed in 1..=5 {
        near.extend(errors(
            &estimate(&stage::with_noise(&clean, seed), (0.5, 450.0)),
            &plant,
        ));
    }
    near.retain(|(f, _, _)| {
        let close = |(omega, _, damping): &(f64, f64, f64)| {
            let f0 = omega / std::f64::consts::TAU;
            (f - f0).abs() < 3.0 * damping * f0
        };
        stage::MODES.iter().skip(1).any(close)
    });
    assert_sigma_matches(&near, "around resonances");
}

/// The errors of runs of 8.5 s with a chirp of 2 s and 1.2 mA: 185 nm of motion in 50 nm of noise.
fn short_runs(seeds: u64, min_half_width_bins: usize) -> Vec<(f64, f64, f64)> {
    let plant = SampledPlant::stage();
    let input_a: Vec<f64> = stage::chirp_of(2.0, 0.5, 6.0)
        .iter()
        .map(|u| 0.003 * u)
        .collect();
    let output_m = plant.simulate(&input_a);
    let clean = Signals {
        rate_hz: RATE_HZ,
        input: input_a,
        output: output_m,
    };
    let settings = EstimatorSettings {
        min_half_width_bins,
        ..EstimatorSettings::default()
    };
    let run = |seed| {
        errors(
            &local::estimate(&stage::with_noise(&clean, seed), (2.0, 25.0), &settings).unwrap(),
            &plant,
        )
    };
    (1..=seeds).flat_map(run).collect()
}

#[test]
fn sigmas_of_short_noisy_record_match_errors() {
    assert_sigma_matches(&short_runs(8, 16), "short records");
}

/// The noise of the floor has a peak at 5 Hz that is four bins wide to either side, while the noise is estimated from 16 bins:
/// sigma is too small there by at most a quarter. With the default half-width of 16 bins the noise would be estimated from 32 bins,
/// and sigma would be smaller still. The remedy is a longer record or a smaller half-width.
#[test]
fn at_least_80_percent_of_errors_are_within_two_sigma_at_the_floor_peak_of_a_short_record() {
    let mut peak = short_runs(100, 8);
    peak.retain(|(f, _, _)| (4.5..5.5).contains(f));
    let (magnitude, phase) = (share(&peak, |e| e.1), share(&peak, |e| e.2));
    println!(
        "at the floor's peak: {} frequencies, magnitude {magnitude:.4}, phase {phase:.4}",
        peak.len()
    );
    assert!(
        (0.80..0.96).contains(&magnitude) && (0.80..0.96).contains(&phase),
        "magnitude {magnitude}, phase {phase}"
    );
}
