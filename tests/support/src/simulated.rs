//! Runs on the simulated stage, recorded and analysed as by the command line.
use std::path::{Path, PathBuf};

use bench_config::Config;
use bench_experiment::{Analysis, AnalysisError, Plan, ReadSignals, analyse, never_cancels};
use bench_recording::Recording;
use bench_rig::simulated::SimulatedRig;
use bench_rt::servo_run::ServoEnd;
use bench_rt::thread::Pace;

/// The recording of a run by `plan`, and how the run ended.
pub fn ended(plan: &Plan, folder: &Path) -> (PathBuf, ServoEnd) {
    let rig = Box::new(SimulatedRig::new(&plan.config).expect("a rig"));
    let run =
        bench_experiment::run(plan, rig, Pace::Virtual, folder, &mut |_, _| {}).expect("a run");
    let ended = (run.path.clone(), run.end.servo.clone());
    run.finish("{}").expect("a good disk");
    ended
}

/// The recording of a run by `plan`, which must complete.
pub fn recorded(plan: &Plan, folder: &Path) -> PathBuf {
    let (path, ended) = ended(plan, folder);
    assert!(ended.completed, "{ended:?}");
    path
}

/// Analyses a run of `plan` with the configuration `assumed`.
pub fn analysed(plan: &Plan, assumed: &Config) -> Result<Analysis, AnalysisError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    analyse(
        &Recording::open(&recorded(plan, folder.path())).expect("a recording"),
        ReadSignals::default(),
        assumed,
        &mut never_cancels,
    )
}
