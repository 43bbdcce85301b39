//! The check of the stage before a loop closes: it accepts the stage of the certificate and finds another one.
use bench_config::Config;
use bench_experiment::certificate::sha256;
use bench_experiment::stage_check::{
    PhaseComparison, StageCheck, StageCheckError, StaticComparison,
};
use bench_experiment::{ExperimentError, Plan, PlannedStageCheck};
use bench_hal::Rig;
use bench_recording::Recording;
use bench_rig::simulated::SimulatedRig;
use bench_rt::thread::Pace;

use crate::calibration::skewed_rig::{Skew, SkewedRig};
use crate::certificate::stage::{config, plan};

/// The check on a rig, with the certificate of the modelled stage.
fn checked(rig: Box<dyn Rig>) -> StageCheck {
    checked_of(&plan(&[]), rig)
}

/// The check before a plan.
fn checked_of(plan: &Plan, rig: Box<dyn Rig>) -> StageCheck {
    let planned = PlannedStageCheck::before(plan)
        .expect("a plan")
        .expect("a check");
    let folder = tempfile::tempdir().expect("a folder");
    let run = bench_experiment::run(
        &planned.plan,
        rig,
        Pace::Virtual,
        folder.path(),
        &mut |_, _| {},
    );
    let run = run.expect("a run");
    let path = run.path.clone();
    assert!(run.end.servo.completed, "{:?}", run.end.servo);
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

/// A check that could not tell another stage must not accept this one.
#[test]
fn refuses_a_check_that_noise_makes_inconclusive() {
    // 9 um of the step over the noise of a mean of 4000 samples: 120 um/63 = 1.9 um, three times as much is above half of the step.
    let noisy = config(&["sim.probe_noise_rms_m=1.2e-4"]);
    // The residual monitor would trip before.
    let unmonitored = plan(&["interlock.model_error_off=the noise is tested"]);
    let check = checked_of(&unmonitored, Box::new(simulated(&noisy)));
    assert!(
        matches!(check.refusal(), Some(StageCheckError::Inconclusive { .. })),
        "{check:?}"
    );
}

/// The plan with the response of its certificate above a frequency only.
fn without_static_response(mut plan: Plan) -> Plan {
    let text = plan.certificate.as_mut().expect("a certificate");
    let mut lines = text.frf_csv.lines();
    let header = lines.next().expect("a header").to_string();
    let high = lines.filter(|row| {
        let hz: f64 = row
            .split(',')
            .next()
            .expect("a column")
            .parse()
            .expect("Hz");
        hz > 10.0
    });
    let csv: String = std::iter::once(header.as_str())
        .chain(high)
        .map(|line| line.to_string() + "\n")
        .collect();
    text.json = text.json.replace(&sha256(&text.frf_csv), &sha256(&csv));
    text.frf_csv = csv;
    plan
}

#[test]
fn refuses_a_certificate_without_static_response_unless_an_operator_overrides() {
    let plan = without_static_response(plan(&[]));
    let refused = PlannedStageCheck::before(&plan).expect_err("a refusal");
    assert!(
        matches!(
            refused,
            ExperimentError::StageCheck(StageCheckError::NothingToCompare)
        ),
        "{refused}"
    );
    let reason = "a reason of an operator".parse().expect("long enough");
    let overridden = plan.with_override(Some(reason));
    assert!(matches!(PlannedStageCheck::before(&overridden), Ok(None)));
}

/// The model was made 100 times softer after the chirp: the step of 1 % of the travel would be all of it.
#[test]
fn refuses_a_check_that_would_trip_an_interlock_by_the_model() {
    let soft = plan(&[
        "plant.spring_stiffness_n_per_m=360",
        "control.controller=slow",
    ]);
    let refused = PlannedStageCheck::before(&soft).expect_err("a refusal");
    assert!(
        matches!(refused, ExperimentError::Excitation(_)),
        "{refused}"
    );
}

/// The loop closes only when the vibration of the check is below a tenth of the bound of the residual monitor.
#[test]
fn rest_after_the_check_lasts_until_its_vibration_has_decayed() {
    let plan = plan(&[]);
    let rest = plan.rest_after_check.expect("a rest");
    assert_eq!(plan.config.control.settle_s, rest.rest_s);
    // 2 % of 0.9 mm, a tenth of it.
    assert!((rest.permitted_m - 1.8e-6).abs() < 1e-12, "{rest:?}");
    // 1 % of 0.9 mm and two tones of 0.3 %, which are at most 530/184 times faster than the first mode.
    assert!((9e-6..25e-6).contains(&rest.vibration_m), "{rest:?}");
    // The first mode decays with 0.00878 x 183.9 = 1.61 1/s, the close ones with 2.07 and more (getting started): 1.0 to 1.6 s.
    let expected_s = (rest.vibration_m / 1.8e-6).ln() / 1.615;
    assert!((rest.rest_s / expected_s - 1.0).abs() < 0.1, "{rest:?}");
    assert!(
        rest.left_m < 1.01 * rest.permitted_m && !rest.is_limited,
        "{rest:?}"
    );
    // Without a certificate there is no check.
    let without = Plan::control(config(&[])).expect("a plan");
    assert_eq!(without.rest_after_check, None);
    assert_eq!(without.config.control.settle_s, 0.5);
}

/// Agreement within limits that are too wide to tell another stage is no agreement. Other signs change the phase by up to 180 degrees.
#[test]
fn each_comparison_with_too_wide_a_limit_is_inconclusive() {
    let check = |limit_ratio: f64, limit_deg: f64| StageCheck {
        compliance: StaticComparison {
            measured_m_per_a: 1e-4,
            certified_m_per_a: 1e-4,
            limit_ratio,
        },
        phases: vec![PhaseComparison {
            frequency_hz: 45.0,
            measured_deg: -90.0,
            certified_deg: -90.0,
            difference_deg: 0.0,
            limit_deg,
        }],
        agrees: true,
    };
    assert_eq!(check(0.05, 10.0).refusal(), None);
    for (limit_ratio, limit_deg, what) in [
        (0.51, 10.0, "the static compliance"),
        (f64::NAN, 10.0, "the static compliance"),
        (0.05, 76.0, "the phase at 45.00 Hz"),
        (0.05, f64::NAN, "the phase at 45.00 Hz"),
    ] {
        let inconclusive = StageCheckError::Inconclusive { what: what.into() };
        assert_eq!(check(limit_ratio, limit_deg).refusal(), Some(inconclusive));
    }
}
