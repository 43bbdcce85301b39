//! Runs on the simulated stage: the motor is cold in each process and needs no file.
use bench_experiment::{Runner, Setup};
use bench_recording::Recording;

use crate::motor::common::{hot, run};

#[test]
fn simulated_motor_carries_heat_from_run_to_run_and_is_never_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = hot(folder.path());
    let runner = Runner::new(Setup::simulated(folder.path().join("recordings")));
    let mut starts_a = Vec::new();
    for _ in 0..3 {
        let summary = run(&runner, &config).expect("no refusal");
        assert!(summary.is_completed(), "{summary:?}");
        starts_a.push(summary.motor.thermal_start_a);
    }
    // The first is cold. The later ones rest until the run is allowed: (2.338^2 - 2.085^2) e^1.01 0.98 = 3.01 A^2.
    assert_eq!(starts_a[0], 0.0);
    assert!(
        starts_a[1..].iter().all(|a| (1.70..1.76).contains(a)),
        "{starts_a:?}"
    );
    assert!(!folder.path().join("motor.json").exists());
}

#[test]
fn small_runs_carry_their_heat_without_a_rest() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut config = hot(folder.path());
    config.chirp.amplitude[0].current_a = 1.0;
    let runner = Runner::new(Setup::simulated(folder.path().join("recordings")));
    let first = run(&runner, &config).expect("a run");
    let second = run(&runner, &config).expect("a run");
    assert_eq!(second.motor.thermal_start_a, first.motor.thermal_end_a);
    assert!((0.5..0.6).contains(&first.motor.thermal_end_a));
}

#[test]
fn recording_contains_the_thermal_state_at_the_start() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut config = hot(folder.path());
    (config.chirp.duration_s, config.chirp.amplitude[0].current_a) = (1.0, 1.0);
    let runner = Runner::new(Setup::simulated(folder.path().join("recordings")));
    let first = run(&runner, &config).expect("a run");
    let second = run(&runner, &config).expect("a run");
    let recorded = |path: &str| {
        let recording = Recording::open(path.as_ref()).expect("a recording");
        recording.metadata()["motor_thermal_a2"].clone()
    };
    assert_eq!(recorded(&first.recording), "0");
    let second_a2: f64 = recorded(&second.recording).parse().expect("a number");
    assert_eq!(second_a2.sqrt(), second.motor.thermal_start_a);
}
