//! Loops that the measured response of a certificate does not allow are refused on devices.

use bench_experiment::Plan;
use bench_experiment::certificate::CertificateError;
use bench_experiment::evidence::Evidence;
use serde_json::json;

use crate::certificate::altered::{
    column, defect, defects, edited, only_defect, required, simulated, with_column, with_response,
};
use crate::certificate::stage::{config, plan, reversed_chirp};

#[test]
fn rejects_a_response_without_the_band_around_the_crossover() {
    // The crossover of the fast controller is 284 rad/s, 45 Hz (thesis: 287 rad/s).
    for (from_hz, to_hz) in [(0.0, 30.0), (38.0, 52.0)] {
        let gap = with_response(plan(&[]), |row| {
            let hz = column(row, 0);
            (!(from_hz..to_hz).contains(&hz)).then(|| row.to_string())
        });
        assert!(
            matches!(defect(&gap), CertificateError::Band { .. }),
            "{from_hz} to {to_hz}"
        );
    }
}

#[test]
fn rejects_a_margin_below_the_limit_with_95_percent_confidence() {
    // The loop has a modulus margin of 0.42 at 5 kHz (READING of the thesis).
    let high = plan(&["control.min_modulus_margin=0.9"]);
    assert!(matches!(
        defect(&high),
        CertificateError::LowMargin { least: 0.9, .. }
    ));
    // The same response with a large uncertainty.
    let limited = plan(&["control.min_modulus_margin=0.3"]);
    assert!(required(&limited, &simulated()).is_ok());
    let noisy = with_response(limited, |row| {
        Some(with_column(row, 4, 0.5 * column(row, 1)))
    });
    assert!(matches!(defect(&noisy), CertificateError::LowMargin { .. }));
}

#[test]
fn rejects_a_loop_that_encircles_minus_one_by_the_measured_response() {
    // The thesis, section 6.2.3: with D = -10 % the resonance circle of mode v encloses -1. The model has +10 %, where the loop is
    // stable.
    let mut config = config(&[]);
    config.control.certificate = Some(reversed_chirp().file("certificate").display().to_string());
    let plan = Plan::control(config).expect("a plan");
    let error = required(&plan, &simulated()).expect_err("refused");
    let [
        CertificateError::Signs { measured, .. },
        CertificateError::Unstable,
    ] = defects(&error)
    else {
        panic!("{error}");
    };
    assert_eq!(measured, "++-");
    // If the signs were not known, the response alone would be refused.
    let without_modes = edited(plan, |json| json["modes"] = json!([]));
    assert_eq!(defect(&without_modes), CertificateError::Unstable);
}

#[test]
fn rejects_a_margin_that_is_not_above_zero_or_not_a_number() {
    let unlimited = plan(&["control.min_modulus_margin=0"]);
    assert!(required(&unlimited, &simulated()).is_ok());
    // A standard deviation as large as the response leaves no margin.
    let noisy = with_response(unlimited.clone(), |row| {
        Some(with_column(row, 4, column(row, 1)))
    });
    assert!(matches!(
        defect(&noisy),
        CertificateError::LowMargin { margin, least: 0.0, .. } if margin <= 0.0
    ));
    let undefined = with_response(unlimited, |row| Some(with_column(row, 4, f64::NAN)));
    assert!(required(&undefined, &simulated()).is_err());
}

#[test]
fn rejects_a_response_without_frequencies() {
    let empty = with_response(plan(&[]), |_| None);
    let error = required(&empty, &simulated()).expect_err("refused");
    assert!(error.to_string().contains("no frequencies"), "{error}");
}

/// With growing noise the loop is first undecided, below 4 standard deviations from -1, and then too close to it, below 1.96.
#[test]
fn rejects_a_loop_whose_stability_is_hidden_by_noise() {
    let unlimited = plan(&["control.min_modulus_margin=0"]);
    let with_noise = |relative: f64| {
        let noisy = with_response(unlimited.clone(), |row| {
            Some(with_column(row, 4, relative * column(row, 1)))
        });
        required(&noisy, &simulated()).map_err(|error| only_defect(&error))
    };
    assert!(with_noise(0.01).is_ok());
    let found: Vec<_> = (0..30)
        .map(|k| with_noise(0.05 * 1.12f64.powi(k)))
        .collect();
    let is_undecided = |found: &Result<Evidence, CertificateError>| matches!(found, Err(CertificateError::Undecided { sigmas }) if *sigmas < 4.0);
    let is_low = |found: &Result<Evidence, CertificateError>| {
        matches!(found, Err(CertificateError::LowMargin { .. }))
    };
    let first = found.iter().position(is_undecided).expect("undecided");
    let low = found.iter().position(is_low).expect("too low");
    assert!(found[..first].iter().all(Result::is_ok), "{found:?}");
    assert!(found[first..low].iter().all(is_undecided), "{found:?}");
    assert!(found[low..].iter().all(is_low), "{found:?}");
}
