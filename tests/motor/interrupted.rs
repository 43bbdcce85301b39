//! A run whose process is killed, and a wait that a signal ends. The process is this test program, which runs one test again.
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use bench_experiment::{ExperimentError, MotorError, MotorHandling, Runner, Setup};
use bench_rig::motor::{Moment, MotorOrigin};
use bench_rt::thread::Pace;
use bench_test_support::program::waits_for_signals;

use crate::motor::common::{LIMIT_A, hot, memory, refusal, run};

/// Names the folder of a child process.
const FOLDER: &str = "BENCH_TEST_MOTOR_FOLDER";
/// A test that waits longer than this has failed. It is not a requirement.
const TIME_LIMIT: Duration = Duration::from_secs(120);

fn setup(folder: &Path, motor: MotorHandling) -> Setup {
    let mut setup = Setup::simulated(folder.join("recordings"));
    setup.conditions.pace = Pace::Realtime;
    setup.conditions.motor = motor;
    setup
}

fn folder_of_child() -> Option<PathBuf> {
    std::env::var_os(FOLDER).map(PathBuf::from)
}

/// Starts this program again with one test of this module only.
fn child(test: &str, folder: &Path) -> Child {
    // A test is named by its path without the program.
    let (_program, module) = module_path!().split_once("::").expect("a module");
    let test = format!("{module}::{test}");
    let program = std::env::current_exe().expect("this program");
    let mut command = Command::new(program);
    command.args(["--exact", test.as_str(), "--test-threads", "1"]);
    command.env(FOLDER, folder).stdout(Stdio::null());
    command.spawn().expect("it starts")
}

fn until(what: &str, mut is_true: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !is_true() {
        assert!(begun.elapsed() < TIME_LIMIT, "waited for: {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn signal(child: &Child, signal: i32) {
    // SAFETY: a child that was not waited for yet, so its id is not reused.
    let result = unsafe { libc::kill(child.id() as libc::pid_t, signal) };
    assert_eq!(result, 0, "{}", std::io::Error::last_os_error());
}

#[test]
fn in_a_child_a_long_run() {
    let Some(folder) = folder_of_child() else {
        return;
    };
    let mut config = hot(&folder);
    config.interlock.overruns_per_s = 1_000_000;
    config.chirp.amplitude[0].current_a = 0.5;
    config.chirp.duration_s = 60.0;
    let runner = Runner::new(setup(&folder, MotorHandling::Remembered));
    run(&runner, &config).expect("killed before");
}

#[test]
fn killed_run_leaves_a_hot_motor() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = hot(folder.path());
    memory(&config).state_cold(&Moment::now()).expect("a file");
    let mut child = child("in_a_child_a_long_run", folder.path());
    until("the start of the run", || {
        matches!(
            memory(&config).read(None, &Moment::now()).known,
            Ok((MotorOrigin::Running, _))
        )
    });
    signal(&child, libc::SIGKILL);
    child.wait().expect("killed");

    let state = memory(&config).read(None, &Moment::now());
    // The run may last 60.2 s; beside it are two ramps of at most 2 s, 0.1 s at zero current and 10 s for enabling.
    assert!((0.0..74.4).contains(&state.busy_s), "{state:?}");
    assert!(
        (state.thermal_a2.sqrt() - LIMIT_A).abs() < 1e-9,
        "{state:?}"
    );
    let runner = Runner::new(setup(folder.path(), MotorHandling::Remembered));
    let text = refusal(run(&runner, &config));
    assert!(text.contains("has no stored end"), "{text}");
}

#[test]
fn in_a_child_a_wait() {
    let Some(folder) = folder_of_child() else {
        return;
    };
    let mut config = hot(&folder);
    config.motor.thermal_time_constant_s = 10_000.0;
    config.chirp.amplitude[0].current_a = 100.0;
    (config.motor.peak_force_n, config.chirp.duration_s) = (1e5, 5.0);
    let runner = Runner::new(setup(&folder, MotorHandling::WaitUntilCool));
    let ended = run(&runner, &config);
    let stopped = matches!(ended, Err(ExperimentError::Motor(MotorError::Stopped)));
    assert!(stopped, "{ended:?}");
}

#[test]
fn signal_ends_the_wait_without_a_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut child = child("in_a_child_a_wait", folder.path());
    until("the wait", || waits_for_signals(child.id()));
    signal(&child, libc::SIGINT);
    assert!(child.wait().expect("it ends").success());
    assert!(!folder.path().join("recordings").exists());
}
