//! Sigma and coherence with noise, and frequencies without input.

use bench_identify::{EstimatorSettings, Frf, PHASE_SIGMA_LIMIT_RAD, Signals, local};

use crate::identify::stage::{self, Dice, RATE_HZ};

fn estimate(signals: &Signals, band_hz: (f64, f64)) -> Frf {
    local::estimate(signals, band_hz, &EstimatorSettings::default()).unwrap()
}

#[test]
fn sigma_is_above_zero_and_below_one_percent_from_1_to_200_hz() {
    let frf = estimate(&stage::with_noise(&stage::clean_run(), 3), (1.0, 200.0));
    for (k, f) in frf.frequency_hz.iter().enumerate() {
        let relative = frf.magnitude_sigma[k] / frf.response[k].norm();
        // The smallest is that at 1 Hz: 50 nm of noise against 0.4 A of chirp, over 11 bins.
        assert!(
            (5e-6..0.01).contains(&relative),
            "{} % at {f} Hz",
            100.0 * relative
        );
    }
}

#[test]
fn coherence_is_low_if_the_output_is_only_noise() {
    let input_a = stage::chirp_of(20.0, 1.0, 2.0);
    let mut dice = Dice::new(9);
    let output_m = input_a.iter().map(|_| 1e-6 * dice.normal()).collect();
    let frf = estimate(
        &Signals {
            rate_hz: RATE_HZ,
            input: input_a,
            output: output_m,
        },
        (1.0, 400.0),
    );
    let count = frf.len() as f64;
    let beyond = (0..frf.len())
        .filter(|k| frf.response[*k].norm() > 4.0 * frf.magnitude_sigma[*k])
        .count() as f64;
    // |H| has a Rayleigh distribution: it exceeds 4 sigma with the probability exp(-8) = 1/3000, and somewhat more often because sigma
    // itself has an error of 15 %.
    assert!(beyond / count < 0.01, "{beyond} of {count} exceed 4 sigma");
    // A fit with 3 parameters to 16 bins explains 3/16 of the output by chance, and less with more bins.
    let coherence = frf.coherence.iter().sum::<f64>() / count;
    assert!(
        (0.05..0.2).contains(&coherence),
        "mean coherence {coherence}"
    );
    assert!(
        frf.phase_sigma_rad
            .iter()
            .all(|sigma| (0.1..=PHASE_SIGMA_LIMIT_RAD).contains(sigma))
    );
}

/// Cosines of 20 to 40 Hz, with whole cycles in one second: all other bins have no input.
fn band_of_cosines() -> Signals {
    let mut dice = Dice::new(4);
    let cosines = |k: usize| {
        let turns = |bin: usize| (bin * k % 5000) as f64 / RATE_HZ;
        (20..=40)
            .map(|bin| 0.1 * (std::f64::consts::TAU * turns(bin) + (bin * bin) as f64).cos())
            .sum::<f64>()
    };
    let input_a: Vec<f64> = (0..5000).map(cosines).collect();
    let output_m = input_a
        .iter()
        .map(|u| 1.5e-4 * u + 40e-9 * dice.normal())
        .collect();
    Signals {
        rate_hz: RATE_HZ,
        input: input_a,
        output: output_m,
    }
}

#[test]
fn omits_frequencies_without_input() {
    let frf = estimate(&band_of_cosines(), (1.0, 2000.0));
    assert_eq!(
        (frf.frequency_hz[0], frf.frequency_hz[frf.len() - 1]),
        (20.0, 40.0)
    );
    for (k, h) in frf.response.iter().enumerate() {
        let off = (h.norm() - 1.5e-4).abs();
        assert!(
            off < 5.0 * frf.magnitude_sigma[k] && frf.magnitude_sigma[k] < 1e-6,
            "{} Hz: {h}",
            frf.frequency_hz[k]
        );
    }
}

#[test]
fn rejects_band_without_input_with_its_limits() {
    let error = local::estimate(
        &band_of_cosines(),
        (100.0, 200.0),
        &EstimatorSettings::default(),
    )
    .unwrap_err();
    assert!(
        error
            .to_string()
            .contains("no energy between 100 and 200 Hz"),
        "{error}"
    );
}
