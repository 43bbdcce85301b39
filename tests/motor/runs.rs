//! Runs in a row, with the clock of the test.
use std::sync::atomic::{AtomicU64, Ordering};

use bench_experiment::{MotorHandling, Plan, Runner, Setup};
use bench_rig::motor::Moment;

use crate::motor::common::{
    LIMIT_A, QUIET_S, SWEEP_S, TAU_S, hot, memory, now, pass, refusal, remembered, run, run_anew,
};

/// `start after TIME (in N s)`: N.
fn wait_s(text: &str) -> f64 {
    let after = text.split("(in ").nth(1).expect("a time");
    let seconds = after.split(" s)").next().expect("seconds");
    seconds.parse().expect("a number")
}

#[test]
fn refuses_the_next_of_four_hot_runs_until_the_motor_has_cooled() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = hot(folder.path());
    memory(&config).state_cold(&now()).expect("a file");
    let first = run_anew(&config, folder.path()).expect("cold motor");
    assert!(first.is_completed() && first.motor.thermal_start_a == 0.0);

    // The state falls from 2.085^2 A^2 in the quiet end and the recorded 0.1 s after it.
    let peak_a2 = 2.085 * 2.085;
    let end_a2 = peak_a2 * (-(QUIET_S + 0.1) / TAU_S).exp();
    let measured_a2 = first.motor.thermal_end_a * first.motor.thermal_end_a;
    assert!((measured_a2 / end_a2 - 1.0).abs() < 0.005, "{measured_a2}");

    // A start with s reaches s exp(-T/tau) + 2.085^2 after T = 10.1 s; that is the limit squared for the largest s.
    let largest_a2 = (LIMIT_A * LIMIT_A - peak_a2) * ((QUIET_S + SWEEP_S) / TAU_S).exp();
    let cooling_s = TAU_S * (end_a2 * (-0.05f64).exp() / largest_a2).ln();
    for _ in 0..3 {
        pass(0.5);
        let text = refusal(run_anew(&config, folder.path()));
        for part in [
            "above the limit of 2.338 A; start after",
            " UTC (in ",
            "--wait-for-motor",
        ] {
            assert!(text.contains(part), "{text}");
        }
    }
    pass(-1.0);
    let wait_s = wait_s(&refusal(run_anew(&config, folder.path())));
    // 2 % reserve are 0.2 s; the time is rounded up to a second; 0.5 % of heat are 0.05 s at a ratio.
    let range = cooling_s..cooling_s + 2.0;
    assert!(range.contains(&wait_s), "{wait_s} s in {range:?}");

    pass(wait_s);
    let second = run_anew(&config, folder.path()).expect("cooled");
    assert!(second.is_completed());
    assert!(second.motor.thermal_start_a > 0.5, "{:?}", second.motor);
}

#[test]
fn first_run_on_unknown_motor_waits_from_the_first_attempt_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = hot(folder.path());
    let text = refusal(run_anew(&config, folder.path()));
    for part in [
        "was unknown at",
        "--motor-cold if the motor has had no current for 47 s",
    ] {
        assert!(text.contains(part), "{text}");
    }
    let first_s = wait_s(&text);
    pass(2.0);
    let second_s = wait_s(&refusal(run_anew(&config, folder.path())));
    assert_eq!(second_s, first_s - 2.0, "the time does not start again");
    pass(second_s);
    assert!(
        run_anew(&config, folder.path())
            .expect("cooled")
            .is_completed()
    );
}

#[test]
fn clock_set_back_is_a_hot_motor() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = hot(folder.path());
    memory(&config).state_cold(&now()).expect("a file");
    pass(-1.0);
    refusal(run_anew(&config, folder.path()));
}

#[test]
fn damaged_file_is_a_hot_motor() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = hot(folder.path());
    std::fs::write(memory(&config).path(), "{").expect("a file");
    refusal(run_anew(&config, folder.path()));
}

#[test]
fn file_that_cannot_be_written_refuses_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut config = hot(folder.path());
    config.interlock.heat_file = Some("/proc/motor.json".into());
    let text = refusal(run_anew(&config, folder.path()));
    assert!(
        text.contains("/proc/motor.json") && text.ends_with("nothing was moved"),
        "{text}"
    );
    assert!(
        !folder.path().join("recordings").exists(),
        "nothing was recorded"
    );
}

#[test]
fn run_that_overheats_a_cold_motor_is_refused_without_a_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut config = hot(folder.path());
    memory(&config).state_cold(&now()).expect("a file");
    config.chirp.amplitude[0].current_a = 4.5;
    let text = refusal(run_anew(&config, folder.path()));
    assert!(text.contains("also with a cold motor; lower"), "{text}");
}

/// Milliseconds of a clock that runs a hundred times as fast as its reader looks at it.
static MILLISECONDS: AtomicU64 = AtomicU64::new(1_000_000_000);

fn fast_clock() -> Moment {
    let unix_s = MILLISECONDS.fetch_add(1000, Ordering::Relaxed) as f64 / 1000.0;
    Moment {
        unix_s,
        boot: "boot".into(),
        since_boot_s: unix_s,
    }
}

#[test]
fn waits_until_the_motor_is_cool() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = hot(folder.path());
    let mut setup = remembered(folder.path());
    setup.conditions.motor = MotorHandling::WaitUntilCool;
    setup.now = fast_clock;
    let runner = Runner::new(setup);
    let begun = runner.progress.clone();
    let summary = run(&runner, &config).expect("it waits");
    assert!(summary.is_completed() && summary.motor.thermal_start_a > 0.5);
    assert_eq!(begun.snapshot().stage, "chirp", "the wait is over");
}

#[test]
fn later_runs_of_a_command_wait() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = hot(folder.path());
    memory(&config).state_cold(&fast_clock()).expect("a file");
    let runner = Runner::new(Setup {
        now: fast_clock,
        ..remembered(folder.path())
    });
    for _ in 0..2 {
        assert!(run(&runner, &config).expect("it waits").is_completed());
    }
}

#[test]
fn run_without_a_recording_leaves_the_motor_as_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = hot(folder.path());
    memory(&config).state_cold(&now()).expect("a file");
    let mut setup = remembered(folder.path());
    setup.conditions.folder = "/proc/recordings".into();
    let failed = Runner::new(setup).run(&Plan::chirp(config.clone()), "chirp");
    assert!(failed.is_err(), "there is no such folder");
    let state = memory(&config).read(Some("simulated"), &now());
    assert_eq!((state.thermal_a2, state.busy_s), (0.0, 0.0));
}
