//! Sequential experiments on the simulated stage.
use std::path::Path;
use std::sync::atomic::AtomicBool;

use bench_config::Config;
use bench_experiment::sequential::{
    SequenceEnd, SequenceLimits, ShotSummary, default_max_motion_s, until_decided,
};
use bench_experiment::{Analysis, Plan, Runner, Setup, close};

/// A sequence whose recordings are complete.
pub struct Ended {
    pub shots: Vec<ShotSummary>,
    pub end: SequenceEnd,
    pub analysis: Analysis,
    pub motion_s: f64,
}

/// Shots until the verdict is certain, with the default limit.
pub fn decided(config: &Config) -> Ended {
    let folder = tempfile::tempdir().expect("a folder");
    let limit_s = default_max_motion_s(config).expect("a model");
    sequence(config, folder.path(), limit_s, |_, _| {})
}

/// Shots within a limit of motion, recorded in a folder. `watch` is called after each shot and may stop the sequence.
pub fn sequence(
    config: &Config,
    folder: &Path,
    max_motion_s: f64,
    watch: impl Fn(&ShotSummary, &AtomicBool),
) -> Ended {
    let runner = Runner::new(Setup::simulated(folder.into()));
    let mut make_run = |plan: &Plan| runner.run(plan, "shot");
    let stop = AtomicBool::new(false);
    let limits = SequenceLimits {
        max_motion_s,
        stop: &stop,
    };
    let mut watch = |shot: &ShotSummary| watch(shot, &stop);
    let sequence = until_decided(config, limits, &mut make_run, &mut watch).expect("shots");
    let motion_s = sequence.motion_s();
    close(sequence.last, &"end").expect("a good disk");
    Ended {
        shots: sequence.shots,
        end: sequence.end,
        analysis: sequence.analysis.expect("a first shot"),
        motion_s,
    }
}
