//! The check of the stage before a loop closes: it accepts the stage of the certificate and finds another one.
use bench::config::Config;
use bench::experiment;
use bench::experiment::stage_check::{PlannedStageCheck, StageCheck, StageCheckError};
use bench::recording::Recording;
use bench::rig::simulated::SimulatedRig;
use bench::rt::thread::Pace;
use bench_hal::Rig;

use crate::skewed_rig::{Skew, SkewedRig};
use crate::stage::{config, plan};

/// The check on a rig, with the certificate of the modelled stage.
fn checked(rig: Box<dyn Rig>) -> StageCheck {
    let planned = PlannedStageCheck::before(&plan(&[]))
        .expect("a plan")
        .expect("a check");
    let folder = tempfile::tempdir().expect("a folder");
    let run = experiment::run(
        &planned.plan,
        rig,
        Pace::Virtual,
        folder.path(),
        &mut |_, _| {},
    );
    let run = run.expect("a run");
    let path = run.path.clone();
    assert!(run.ended.completed, "{:?}", run.ended);
    run.finish("{}").expect("a good disk");
    planned
        .evaluated(&Recording::open(&path).expect("a recording"))
        .expect("a result")
}

fn simulated(config: &Config) -> SimulatedRig {
    SimulatedRig::new(config).expect("a rig")
}

#[test]
fn accepts_the_stage_of_the_certificate() {
    for seed in 1..=5 {
        let check = checked(Box::new(simulated(&config(&[&format!("sim.seed={seed}")]))));
        assert!(check.agrees, "{seed}: {check:?}");
        // Kf over the stiffness of Eq. (2-5): 11.12 N/A / (2 x 36,000 N/m).
        let ratio = check.compliance.measured_m_per_a / (11.12 / 72_000.0);
        assert!((ratio - 1.0).abs() < 0.01, "{check:?}");
        assert_eq!(check.phases.len(), 2);
    }
}

#[test]
fn finds_reversed_probe_or_leads() {
    let skew = Skew {
        probe_gain: -1.0,
        ..Skew::default()
    };
    let check = checked(Box::new(SkewedRig::new(simulated(&config(&[])), skew)));
    assert!(
        matches!(check.refusal(), Some(StageCheckError::Reversed(_))),
        "{check:?}"
    );
}

#[test]
fn finds_another_compliance() {
    for probe_gain in [0.93, 1.07] {
        let skew = Skew {
            probe_gain,
            ..Skew::default()
        };
        let check = checked(Box::new(SkewedRig::new(simulated(&config(&[])), skew)));
        assert!(
            matches!(check.refusal(), Some(StageCheckError::Compliance(_))),
            "{check:?}"
        );
    }
}

#[test]
fn finds_a_stage_with_another_asymmetry() {
    let check = checked(Box::new(simulated(&config(&["sim.asymmetry_offset=-0.2"]))));
    assert!(
        matches!(check.refusal(), Some(StageCheckError::Phase(_))),
        "{check:?}"
    );
}

#[test]
fn finds_a_stage_with_another_load() {
    let check = checked(Box::new(simulated(&config(&[
        "plant.operating_point_m=0.0",
    ]))));
    assert!(!check.agrees, "{check:?}");
}
