//! The static steps: the fit estimates the errors of the rig.
use std::path::Path;

use bench_config::{Config, ScaleBy, Source, load};
use bench_experiment::Plan;
use bench_experiment::calibration::{StaircaseError, StaircaseFit, fit};
use bench_hal::Rig;
use bench_recording::Recording;
use bench_rig::calibration::{
    AmplifierCalibration, Calibration, ChainCalibration, ProbeCalibration,
};
use bench_rig::simulated::SimulatedRig;
use bench_rt::thread::Pace;

use crate::calibration::skewed_rig::{Skew, SkewedRig};

/// Static compliance of the stage in metres per ampere: Kf over the stiffness of Eq. (2-5), both bearings in parallel,
/// 11.12 N/A / (2 x 36,000 N/m).
const COMPLIANCE_M_PER_A: f64 = 11.12 / 72_000.0;

fn config() -> Config {
    load(&Source::default()).expect("the profile is valid")
}

fn recorded(rig: Box<dyn Rig>, config: &Config, folder: &Path) -> Recording {
    recording_of(&Plan::calibrate(config.clone()), rig, folder)
}

fn recording_of(plan: &Plan, rig: Box<dyn Rig>, folder: &Path) -> Recording {
    let run =
        bench_experiment::run(plan, rig, Pace::Virtual, folder, &mut |_, _| {}).expect("a run");
    let path = run.path.clone();
    assert!(run.end.servo.completed, "{:?}", run.end.servo);
    run.finish("{}").expect("a good disk");
    Recording::open(&path).expect("a recording")
}

fn fit_of(recording: &Recording, config: &Config) -> Result<StaircaseFit, StaircaseError> {
    fit(recording, &config.calibrate, config.servo.period_s())
}

fn fitted(skew: Skew, config: &Config) -> Result<StaircaseFit, StaircaseError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rig = SkewedRig::new(SimulatedRig::new(config).expect("a rig"), skew);
    fit_of(&recorded(Box::new(rig), config, folder.path()), config)
}

#[test]
fn static_compliance_is_estimated_with_sign_and_sigma() {
    for probe_gain in [1.0, -1.0] {
        let fit = fitted(
            Skew {
                probe_gain,
                ..Skew::default()
            },
            &config(),
        )
        .expect("a fit");
        let expected = probe_gain * COMPLIANCE_M_PER_A;
        // The unmodelled modes add 0.04 % to the static compliance.
        assert!(
            (fit.compliance_m_per_a / expected - 1.0).abs() < 1e-3,
            "{fit:?}"
        );
        let ratio = fit.compliance_sigma_m_per_a / COMPLIANCE_M_PER_A;
        assert!((1e-6..2e-4).contains(&ratio), "{fit:?}");
        assert!(
            fit.nonlinearity_ratio < 2e-4 && fit.hysteresis_ratio < 2e-4,
            "{fit:?}"
        );
        // Probe noise of 40 nm, quantisation, and floor vibration.
        assert!((40e-9..100e-9).contains(&fit.noise_rms_m), "{fit:?}");
        assert_eq!(fit.current, None);
    }
}

#[test]
fn gain_and_offset_of_amplifier_and_probe_are_estimated() {
    let skew = Skew {
        current_gain: 1.04,
        current_offset_a: 0.006,
        measures_current: true,
        probe_gain: -0.97,
        probe_offset_m: 12e-6,
        ..Skew::default()
    };
    let fit = fitted(skew, &config()).expect("a fit");
    let (gain, offset_a) = fit.current.expect("the amplifier measures");
    assert!(
        (gain - 1.04).abs() < 1e-9 && (offset_a - 0.006).abs() < 1e-9,
        "{gain} {offset_a}"
    );
    assert!(
        (fit.compliance_m_per_a / (-0.97 * 1.04 * COMPLIANCE_M_PER_A) - 1.0).abs() < 1e-3,
        "{fit:?}"
    );
    // At a command of zero 6 mA flow: the stage is at 0.93 um, and the probe adds its offset of 12 um.
    let rest_m = 12e-6 - 0.97 * 0.006 * COMPLIANCE_M_PER_A;
    assert!(
        (fit.rest_m - rest_m).abs() < 2e-8,
        "{} for {rest_m}",
        fit.rest_m
    );
    assert_eq!(fit.probe_gain(ScaleBy::Nothing, COMPLIANCE_M_PER_A), -1.0);
    assert!((fit.probe_gain(ScaleBy::Model, COMPLIANCE_M_PER_A) + 1.0 / 0.97).abs() < 1e-3);
}

#[test]
fn rejects_hysteresis_and_nonlinearity_with_their_figures() {
    let config = config();
    // The travel is 2 x 0.4 A x 154 um/A = 124 um. A play of 2 x 2 um is 3 % of it. The quadratic error is 6 % of 62 um at the
    // ends of the travel.
    let hysteresis = fitted(
        Skew {
            backlash_m: 2e-6,
            ..Skew::default()
        },
        &config,
    )
    .expect_err("hysteresis")
    .to_string();
    assert!(
        hysteresis.contains("between rising and falling current")
            && hysteresis.contains("above the limit of 0.01 "),
        "{hysteresis}"
    );
    let mut generous = config.clone();
    generous.calibrate.max_hysteresis_ratio = 0.05;
    generous.calibrate.max_nonlinearity_ratio = 0.05;
    let fit = fitted(
        Skew {
            backlash_m: 2e-6,
            ..Skew::default()
        },
        &generous,
    )
    .expect("allowed");
    // At most 4 um of 123.6 um; floor vibration reduces the play.
    assert!((0.025..0.0325).contains(&fit.hysteresis_ratio), "{fit:?}");
    let curved = fitted(
        Skew {
            quadratic_per_m: 1000.0,
            ..Skew::default()
        },
        &config,
    )
    .expect_err("curved")
    .to_string();
    assert!(
        curved.contains("straight line") && curved.contains("max_nonlinearity_ratio"),
        "{curved}"
    );
}

#[test]
fn rejects_a_stage_that_does_not_move() {
    let mut config = config();
    // The noise alone prevents a trip of the interlock against a stuck probe.
    let still = fitted(
        Skew {
            current_gain: 0.0,
            ..Skew::default()
        },
        &config,
    )
    .expect_err("nothing moves")
    .to_string();
    assert!(still.contains("does not follow the current"), "{still}");
    config.calibrate.amplitude_a = 3e-5; // 9 nm of travel; the mean of 5000 readings with 70 nm noise has a sigma of 1 nm
    assert!(
        matches!(
            fitted(Skew::default(), &config),
            Err(StaircaseError::NoMotion { .. })
        ),
        "the motion is below the noise"
    );
}

#[test]
fn calibrated_rig_has_unit_gain_and_no_offset() {
    let (config, folder) = (config(), tempfile::tempdir().expect("a temporary folder"));
    let skew = Skew {
        current_gain: 0.9,
        current_offset_a: -0.004,
        measures_current: true,
        probe_gain: -1.05,
        probe_offset_m: -30e-6,
        ..Skew::default()
    };
    let first = fitted(skew, &config).expect("a fit");
    let (current_gain, current_offset_a) = first.current.expect("the amplifier measures");
    let gain = first.probe_gain(ScaleBy::Model, COMPLIANCE_M_PER_A);
    let device = String::new;
    let calibration = Calibration {
        made: "2026-01-01T00:00:00Z".into(),
        recording: String::new(),
        amplifier: AmplifierCalibration {
            device: device(),
            current_gain,
            current_offset_a,
            measures_current: true,
        },
        probe: ProbeCalibration {
            device: device(),
            gain,
            offset_m: -gain * first.rest_m,
            noise_rms_m: 0.0,
        },
        chain: ChainCalibration {
            compliance_m_per_a: first.compliance_m_per_a,
            compliance_sigma_m_per_a: 0.0,
            model_m_per_a: COMPLIANCE_M_PER_A,
            nonlinearity_ratio: 0.0,
            hysteresis_ratio: 0.0,
            delay_s: None,
            delay_sigma_s: None,
        },
    };
    let rig = SkewedRig::new(SimulatedRig::new(&config).expect("a rig"), skew);
    let mut plan = Plan::calibrate(config.clone());
    plan.calibration = Some(calibration);
    let recording = recording_of(&plan, Box::new(rig), folder.path());
    let second = fit_of(&recording, &config).expect("a fit");
    assert!(
        (second.compliance_m_per_a / COMPLIANCE_M_PER_A - 1.0).abs() < 2e-4,
        "{second:?}"
    );
    let (gain, offset_a) = second.current.expect("the amplifier measures");
    // The calibrated command equals the actual current.
    assert!(
        (gain - 1.0).abs() < 1e-9 && offset_a.abs() < 1e-9,
        "{gain} {offset_a}"
    );
    // The zero is the rest position at a command of zero, that is at -4 mA.
    assert!(
        (second.rest_m - 0.004 * COMPLIANCE_M_PER_A).abs() < 3e-8,
        "{second:?}"
    );
}
