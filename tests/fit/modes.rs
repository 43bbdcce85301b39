//! Number, frequencies and signs of the fitted modes.
use bench_identify::FrfDatum;
use bench_identify::modal::{FitError, MeasurementChain, fit};
use nalgebra::Complex;

use crate::fit::synthetic::{frf_data, stage, term};

/// About 0.1 % of the response above the modes.
const SIGMA_M_PER_N: f64 = 1e-9;

#[test]
fn finds_exactly_the_modes_of_a_close_pair_with_their_signs() {
    for (ratio, relative_sign) in [(1.043, -1.0), (1.02, -1.0), (1.02, 1.0), (1.01, -1.0)] {
        let (low, high) = (
            term(82.0, 0.004, -0.03),
            term(82.0 * ratio, 0.004, -0.02 * relative_sign),
        );
        let truth = [term(29.0, 0.009, 0.47), low, high];
        let fit = fit(
            &frf_data(&truth, 0.0, SIGMA_M_PER_N, 3),
            &MeasurementChain::Direct,
        )
        .unwrap();
        let modes = fit.modes();
        assert_eq!(modes.len(), 3, "{ratio}: {modes:?}");
        for (mode, truth) in modes.iter().zip(truth) {
            let in_sigmas = |estimate: bench_identify::modal::Estimate, truth: f64| {
                (estimate.value - truth).abs() / estimate.sigma
            };
            // The probability that one of nine normally distributed errors exceeds 5 sigma is 1 in 200,000.
            assert!(
                in_sigmas(mode.omega_rad_s, truth.omega_rad_s) < 5.0,
                "{ratio}: {mode:?}"
            );
            assert!(
                in_sigmas(mode.damping_ratio, truth.damping_ratio) < 5.0,
                "{ratio}: {mode:?}"
            );
            assert!(
                in_sigmas(mode.residue_per_kg, truth.residue_per_kg) < 5.0,
                "{ratio}: {mode:?}"
            );
            assert!(mode.sign_error_probability() < 1e-6);
        }
        assert!(
            (0.9..1.1).contains(&fit.chi2_per_freedom),
            "{}",
            fit.chi2_per_freedom
        );
    }
}

/// Two modes closer than their widths: of one mode for both, a second beside it becomes a pair of large residues that cancel.
#[test]
fn separates_two_modes_within_one_peak() {
    for (second, ratio) in [(2.4, 1.0015), (-1.1, 1.0015), (2.4, 1.003), (-2.4, 1.002)] {
        let truth = [
            term(35.7, 0.0023, 2.47),
            term(99.3, 0.0013, 2.8),
            term(99.3 * ratio, 0.001, second),
        ];
        let data = frf_data(&truth, 0.0, SIGMA_M_PER_N, 11);
        let modes = fit(&data, &MeasurementChain::Direct).unwrap().modes();
        assert_eq!(modes.len(), 3, "{second} {ratio}: {modes:?}");
        for (mode, truth) in modes.iter().zip(truth) {
            let errors = [
                (mode.omega_rad_s, truth.omega_rad_s),
                (mode.residue_per_kg, truth.residue_per_kg),
            ];
            for (found, truth) in errors {
                let in_sigmas = (found.value - truth) / found.sigma;
                // One of 24 normally distributed errors exceeds 5 sigma with a probability of 1 in 70,000.
                assert!(in_sigmas.abs() < 5.0, "{second} {ratio}: {mode:?}");
            }
        }
    }
}

#[test]
fn separates_a_delay_of_many_milliseconds_from_the_modes() {
    for delay_s in [0.0, 1e-4, 1.7e-3, 6e-3, -2e-3] {
        let fit = fit(
            &frf_data(&stage(), delay_s, SIGMA_M_PER_N, 5),
            &MeasurementChain::Direct,
        )
        .unwrap();
        let delay = fit.delay_s();
        assert!(
            (delay.value - delay_s).abs() < 5.0 * delay.sigma,
            "{delay_s}: {delay:?}"
        );
        assert!(delay.sigma < 1e-5, "{delay:?}");
        assert_eq!(fit.modes().len(), 3, "{delay_s}: {:?}", fit.modes());
    }
}

#[test]
fn does_not_report_a_mode_below_the_noise() {
    // The peak of the second mode is 1e-7/(2 x 0.004 x 515^2) = 5e-11 m/N, 1/20 of the noise of one frequency.
    let truth = [term(29.0, 0.009, 0.47), term(82.0, 0.004, 1e-7)];
    for seed in 0..20 {
        let modes = fit(
            &frf_data(&truth, 0.0, SIGMA_M_PER_N, seed),
            &MeasurementChain::Direct,
        )
        .unwrap()
        .modes();
        assert_eq!(modes.len(), 1, "{seed}: {modes:?}");
    }
}

#[test]
fn free_body_with_flexible_mode_gives_one_double_integrator_and_one_mode() {
    let truth = [term(0.0, 0.0, 2.0), term(48.0, 0.01, -1.2)];
    let fit = fit(
        &frf_data(&truth, 0.0, SIGMA_M_PER_N, 8),
        &MeasurementChain::Direct,
    )
    .unwrap();
    let modes = fit.modes();
    assert_eq!(modes.len(), 2, "{modes:?}");
    assert_eq!(modes[0].omega_rad_s.value, 0.0);
    for (mode, truth) in modes.iter().zip(truth) {
        assert!(
            (mode.residue_per_kg.value - truth.residue_per_kg).abs()
                < 5.0 * mode.residue_per_kg.sigma,
            "{mode:?}"
        );
    }
}

#[test]
fn rejects_noise_zero_response_and_too_few_frequencies() {
    let noise: Vec<FrfDatum> = frf_data(&[], 0.0, 1e-6, 4);
    assert!(
        matches!(
            fit(&noise, &MeasurementChain::Direct),
            Err(FitError::NoMode { .. })
        ),
        "{:?}",
        fit(&noise, &MeasurementChain::Direct)
    );
    assert!(matches!(
        fit(&noise[..1], &MeasurementChain::Direct),
        Err(FitError::TooFew { frequencies: 1 })
    ));
    assert!(matches!(
        fit(&[], &MeasurementChain::Direct),
        Err(FitError::TooFew { frequencies: 0 })
    ));
    let zero: Vec<FrfDatum> = noise
        .iter()
        .map(|datum| FrfDatum {
            response: Complex::new(0.0, 0.0),
            ..*datum
        })
        .collect();
    assert!(fit(&zero, &MeasurementChain::Direct).is_err());
}
