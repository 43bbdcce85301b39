//! The check of the stage before a loop closes, over seeds: no false refusals, and no stage with the other sign sequence passes.

use std::path::Path;

use bench_config::{Config, Purpose, Source, load};
use bench_experiment::certificate::CertificateText;
use bench_experiment::evidence::{ResponseFile, certify};
use bench_experiment::stage_check::StageCheck;
use bench_experiment::{
    AnalysedRun, Plan, PlannedStageCheck, ReadSignals, Run, analyse, never_cancels,
};
use bench_identify::frf_csv::{self, METRES_PER_AMPERE};
use bench_recording::Recording;
use bench_rig::simulated::SimulatedRig;
use bench_rt::thread::Pace;

/// The stage with the fast controller, D = +10 %, and a chirp of 40 s.
fn config(more: &[String]) -> Config {
    let sets = ["chirp.duration_s=40", "control.controller=fast"].map(String::from);
    load(&Source {
        sets: sets.iter().chain(more).cloned().collect(),
        purpose: Purpose::Control,
        ..Source::default()
    })
    .expect("valid settings")
}

fn run(plan: &Plan, rig: &Config, folder: &Path) -> Recording {
    let rig = Box::new(SimulatedRig::new(rig).expect("a rig"));
    let run: Run =
        bench_experiment::run(plan, rig, Pace::Virtual, folder, &mut |_, _| {}).expect("a run");
    let path = run.path.clone();
    run.finish("{}").expect("a good disk");
    Recording::open(&path).expect("a recording")
}

/// A closed loop with the certificate of the modelled stage.
fn certified_plan() -> Plan {
    let folder = tempfile::tempdir().expect("a folder");
    let config = config(&["sim.seed=1000".into()]);
    let recording = run(&Plan::chirp(config.clone()), &config, folder.path());
    let analysis = analyse(
        &recording,
        ReadSignals::default(),
        &config,
        &mut never_cancels,
    )
    .expect("an analysis");
    let csv = frf_csv::to_string(&analysis.frf, METRES_PER_AMPERE);
    let response = ResponseFile {
        name: "frf.csv",
        csv: &csv,
    };
    let certificate = certify(&AnalysedRun::new(&recording, &analysis, &config), response);
    let certificate = certificate.expect("TOML").expect("a completed chirp");
    let mut plan = Plan::control(config).expect("a plan");
    plan.certificate = Some(CertificateText {
        name: "certificate.json".into(),
        json: certificate.to_json(),
        frf_csv: csv,
    });
    plan
}

fn check(planned: &PlannedStageCheck, rig: &Config) -> StageCheck {
    let folder = tempfile::tempdir().expect("a folder");
    let recording = run(&planned.plan, rig, folder.path());
    planned.evaluated(&recording).expect("a result")
}

#[test]
fn at_most_1_of_200_checks_refuses_the_stage_of_the_certificate() {
    let planned = PlannedStageCheck::before(&certified_plan())
        .expect("a plan")
        .expect("a check");
    let refused: Vec<u64> = (0..200)
        .filter(|seed| !check(&planned, &config(&[format!("sim.seed={seed}")])).agrees)
        .collect();
    assert!(refused.len() <= 1, "{refused:?}");
}

#[test]
fn a_stage_with_the_other_sign_sequence_never_passes() {
    let planned = PlannedStageCheck::before(&certified_plan())
        .expect("a plan")
        .expect("a check");
    // D = -10 % in the stage, +10 % in the model and in the certificate.
    let passed: Vec<u64> = (0..50)
        .filter(|seed| {
            let sets = [
                format!("sim.seed={seed}"),
                "sim.asymmetry_offset=-0.2".into(),
            ];
            check(&planned, &config(&sets)).agrees
        })
        .collect();
    assert_eq!(passed, [0; 0]);
}
