//! Welch's estimator against scipy.

use bench_identify::{Estimator, Signals, welch};
use nalgebra::Complex;

use crate::identify::python;
use crate::identify::stage::{self, Dice, SampledPlant};

/// The stage with white input and probe noise: every bin of every spectrum has energy.
fn noisy_run(samples: usize, noise_m: f64) -> Signals {
    let mut dice = Dice::new(11);
    let input_a: Vec<f64> = (0..samples).map(|_| 0.3 * dice.normal() + 0.05).collect();
    let output_m = SampledPlant::stage().simulate(&input_a);
    let output_m = output_m
        .iter()
        .map(|y| y + noise_m * dice.normal() + 2e-4)
        .collect();
    Signals {
        rate_hz: stage::RATE_HZ,
        input: input_a,
        output: output_m,
    }
}

fn assert_equals_scipy(signals: &Signals, segment: usize) {
    let samples = signals.input.iter().zip(&signals.output);
    let text: String = samples.map(|(u, y)| format!("{u:e} {y:e}\n")).collect();
    let Some(rows) = python::numbers("welch.py", &["5000", &segment.to_string()], &text) else {
        return;
    };
    let spectra = welch::spectra(signals, segment).unwrap();
    assert_eq!(rows.len(), spectra.frequency_hz.len());
    for (k, row) in rows.iter().enumerate() {
        let cross = Complex::new(row[3], row[4]);
        let own = [spectra.frequency_hz[k], spectra.input[k], spectra.output[k]];
        for (own, theirs) in own.iter().zip(row) {
            assert!(
                (own - theirs).abs() <= 1e-9 * theirs.abs(),
                "bin {k}: {own} is not {theirs}"
            );
        }
        assert!(
            (spectra.cross[k] - cross).norm() <= 1e-9 * cross.norm(),
            "bin {k}: {} is not {cross}",
            spectra.cross[k]
        );
    }
}

#[test]
fn welch_spectra_equal_scipy_for_an_even_segment() {
    assert_equals_scipy(&noisy_run(20_000, 40e-9), 1024);
}

#[test]
fn welch_spectra_equal_scipy_for_an_odd_segment_and_a_partial_last_segment() {
    assert_equals_scipy(&noisy_run(7_777, 40e-9), 375);
}

#[test]
fn simulated_stage_equals_the_discretisation_by_scipy() {
    let Some(modes) = python::numbers("stage.py", &["modes"], "") else {
        return;
    };
    for (row, (omega, residue, damping)) in modes.iter().zip(stage::MODES) {
        // The residue of the first mode is a difference of terms that are 1e5 times larger: its relative error is about 1e-16/1e-5.
        assert!(
            (row[0] / omega - 1.0).abs() < 1e-9
                && (row[1] - residue).abs() < 1e-10
                && (row[2] / damping - 1.0).abs() < 1e-9
        );
    }
    let frequencies: Vec<f64> = (0..400)
        .map(|k| 0.5 * 1000_f64.powf(k as f64 / 399.0))
        .collect();
    let text: String = frequencies.iter().map(|f| format!("{f}\n")).collect();
    let rows = python::numbers("stage.py", &["response"], &text).unwrap();
    let plant = SampledPlant::stage();
    for (f, row) in frequencies.iter().zip(rows) {
        let (own, theirs) = (plant.response(*f), Complex::new(row[0], row[1]));
        assert!(
            (own / theirs - 1.0).norm() < 1e-6,
            "{f} Hz: {own} is not {theirs}"
        );
    }
}

/// The plant is a constant, so that segments have no leakage and the error is noise only.
#[test]
fn welch_errors_are_within_two_sigma_in_95_percent_of_the_bins() {
    let mut dice = Dice::new(5);
    let input_a: Vec<f64> = (0..200_000).map(|_| dice.normal()).collect();
    let output_m = input_a
        .iter()
        .map(|u| 1e-4 * u + 0.5e-4 * dice.normal())
        .collect();
    let frf = welch::estimate(
        &Signals {
            rate_hz: 1000.0,
            input: input_a,
            output: output_m,
        },
        (1.0, 499.0),
        2000,
        Estimator::H1,
    )
    .unwrap();
    let within =
        |k: &usize| (frf.response[*k].norm() - 1e-4).abs() <= 2.0 * frf.magnitude_sigma[*k];
    let share = (0..frf.len()).filter(within).count() as f64 / frf.len() as f64;
    // Expected: 95.4 % of 997 bins, of which neighbours are correlated. +- 2.5 % is more than three standard deviations.
    assert!((0.93..0.98).contains(&share), "{share} of the bins");
    // The noise has 1/4 of the power of the signal: the coherence is 1/(1 + 0.25). The resolution is 1.5 bins of 0.5 Hz.
    let coherence = frf.coherence.iter().sum::<f64>() / frf.len() as f64;
    assert!((0.79..0.81).contains(&coherence), "{coherence}");
    assert!(
        frf.resolution_hz
            .iter()
            .all(|width| (width - 0.75).abs() < 1e-12)
    );
}
