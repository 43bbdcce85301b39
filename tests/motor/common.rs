//! A hot excitation, a file for the motor, and a clock that the tests set.
use std::cell::Cell;
use std::path::Path;

use bench_config::{Config, ExcitationKind, Source, load};
use bench_excitation::AmplitudePoint;
use bench_experiment::{
    ExperimentError, MotorHandling, Plan, Run, RunSummary, Runner, Setup, close,
};
use bench_rig::motor::{Moment, MotorMemory};

/// Continuous current of the motor: 26 N over 11.12 N/A.
pub const LIMIT_A: f64 = 26.0 / 11.12;
/// Thermal time constant of the profile `stage`.
pub const TAU_S: f64 = 10.0;
/// Length of the excitation.
pub const SWEEP_S: f64 = 10.0;
/// Zero current before and after it.
pub const QUIET_S: f64 = 0.1;
/// The amplitude of [`hot`]: i^2 has the mean A^2/2, so a cold motor reaches A^2/2 (1 - exp(-1)) = 2.085^2 A^2 after tau.
pub const AMPLITUDE_A: f64 = 3.708;

thread_local! {
    static UNIX_S: Cell<f64> = const { Cell::new(1_000_000.0) };
}

/// The time of the test's clock.
pub fn now() -> Moment {
    let unix_s = UNIX_S.get();
    Moment {
        unix_s,
        boot: "boot".into(),
        since_boot_s: unix_s,
    }
}

/// Lets time pass on the test's clock.
pub fn pass(seconds: f64) {
    UNIX_S.set(UNIX_S.get() + seconds);
}

/// A chirp between 300 and 450 Hz, where the stage hardly moves, with a thermal current of 2.085 A from a cold motor.
pub fn hot(folder: &Path) -> Config {
    let mut config = load(&Source::default()).expect("the default profile");
    config.interlock.heat_file = Some(folder.join("motor.json").display().to_string());
    config.excitation.kind = ExcitationKind::Chirp;
    let chirp = &mut config.chirp;
    (chirp.start_hz, chirp.stop_hz, chirp.duration_s) = (300.0, 450.0, SWEEP_S);
    (chirp.quiet_before_s, chirp.quiet_after_s) = (QUIET_S, QUIET_S);
    (chirp.fade_in_s, chirp.fade_out_s) = (0.01, 0.01);
    chirp.amplitude = vec![AmplitudePoint {
        frequency_hz: 1.0,
        current_a: AMPLITUDE_A,
    }];
    config
}

/// The simulated stage as fast as possible, whose motor is known by a file like that of a real one.
pub fn remembered(folder: &Path) -> Setup {
    let mut setup = Setup::simulated(folder.join("recordings"));
    setup.conditions.motor = MotorHandling::Remembered;
    Setup { now, ..setup }
}

/// A run in a new process: nothing but the file is known of earlier ones.
pub fn run_anew(config: &Config, folder: &Path) -> Result<RunSummary, ExperimentError> {
    run(&Runner::new(remembered(folder)), config)
}

pub fn run(runner: &Runner, config: &Config) -> Result<RunSummary, ExperimentError> {
    finished(runner.run(&Plan::chirp(config.clone()), "chirp")?)
}

pub fn finished(mut run: Run) -> Result<RunSummary, ExperimentError> {
    let summary = RunSummary::of(&mut run)?;
    close(run, &summary)?;
    Ok(summary)
}

pub fn memory(config: &Config) -> MotorMemory {
    MotorMemory::of(config).expect("heat_file is set")
}

/// The text of a refusal.
pub fn refusal(result: Result<RunSummary, ExperimentError>) -> String {
    match result {
        Err(error @ ExperimentError::Motor(_)) => error.to_string(),
        other => panic!("expected a refusal because of the motor: {other:?}"),
    }
}
