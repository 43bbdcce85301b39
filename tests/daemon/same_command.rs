//! A command gives the same output, files and exit code with and without a daemon.
use std::path::Path;
use std::process::Output;

use crate::daemon::common::{Daemon, bench_in};

/// Output without what differs between any two runs: times of day in file names.
fn comparable(text: &[u8]) -> String {
    let text = String::from_utf8_lossy(text).into_owned();
    let words = text.split_inclusive(['/', ' ', '\n', '"', '_']);
    let words = words.map(|word| {
        if word.len() >= 20 && word.starts_with("20") && word.contains('T') {
            "TIME"
        } else {
            word
        }
    });
    words.collect()
}

/// Names of the files in `recordings` without the times.
fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder.join("recordings")).expect("recordings");
    let mut names: Vec<String> = entries
        .map(|entry| {
            entry
                .expect("a file")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .map(|name| name.split_once('_').expect("a time").1.to_string())
        .collect();
    names.sort();
    names
}

fn outcome(output: &Output) -> (Option<i32>, String, String) {
    (
        output.status.code(),
        comparable(&output.stdout),
        comparable(&output.stderr),
    )
}

fn is_the_same(arguments: &[&str]) {
    let daemon = Daemon::start();
    let (alone, attached) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let expected = bench_in(alone.path(), arguments)
        .output()
        .expect("a process");
    let output = daemon
        .bench(attached.path(), arguments)
        .output()
        .expect("a process");
    assert_eq!(outcome(&output), outcome(&expected), "{arguments:?}");
    assert_eq!(files(attached.path()), files(alone.path()), "{arguments:?}");
    // The daemon notices the end of the process a moment later.
    daemon.wait("the command has ended", "", |state| state["run"].is_null());
    let runs = daemon.get("/api/v1/runs");
    let made = runs["finished"].as_array().expect("a list");
    assert_eq!(made.len(), 1, "the daemon made the run: {runs}");
    assert_eq!(made[0]["operator"], "tester");
}

#[test]
fn chirp_is_the_same_with_a_daemon() {
    is_the_same(&[
        "chirp",
        "--seed",
        "4",
        "--duration",
        "20s",
        "--start",
        "1Hz",
        "--stop",
        "100Hz",
    ]);
}

#[test]
fn control_is_the_same_with_a_daemon() {
    is_the_same(&["control", "--slow", "--seed", "4", "--duration", "3s"]);
}

#[test]
fn json_of_control_is_the_same_with_a_daemon() {
    is_the_same(&[
        "control",
        "--fast",
        "--seed",
        "4",
        "--duration",
        "2s",
        "--json",
    ]);
}

#[test]
fn trip_is_the_same_with_a_daemon() {
    // The reference is beyond the soft limit of 5 um.
    is_the_same(&[
        "control",
        "--slow",
        "--seed",
        "4",
        "--duration",
        "3s",
        "--amplitude",
        "4um",
        "--set",
        "interlock.soft_limit_m=4.2e-6",
        "--set",
        "control.min_modulus_margin=0",
    ]);
}

#[test]
fn calibration_with_its_two_runs_is_the_same_with_a_daemon() {
    is_the_same(&["calibrate", "--seed", "4"]);
}

#[test]
fn identify_is_the_same_with_a_daemon_and_does_not_wait_for_it() {
    let daemon = Daemon::start();
    let folder = tempfile::tempdir().unwrap();
    let chirp = ["chirp", "--seed", "4", "--duration", "20s", "--json"];
    let recorded = bench_in(folder.path(), &chirp).output().expect("a process");
    let result: serde_json::Value = serde_json::from_slice(&recorded.stdout).expect("JSON");
    let recording = result["recording"].as_str().expect("a path");
    for options in [&[][..], &["--json"]] {
        let arguments = [&["identify", recording][..], options].concat();
        let expected = bench_in(folder.path(), &arguments)
            .output()
            .expect("a process");
        let output = daemon
            .bench(folder.path(), &arguments)
            .output()
            .expect("a process");
        assert!(!expected.stdout.is_empty());
        assert_eq!(outcome(&output), outcome(&expected), "{arguments:?}");
    }
    let runs = daemon.get("/api/v1/runs");
    assert_eq!(runs["finished"].as_array().map(Vec::len), Some(0));
}

#[test]
fn refused_run_is_the_same_with_a_daemon() {
    let daemon = Daemon::start();
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["chirp", "--amplitude", "100A"][..],
        &["control", "--controller", "nothing.toml", "--json"],
        &["chirp", "--set", "calibration.file=nothing.toml"],
    ] {
        let expected = bench_in(folder.path(), arguments)
            .output()
            .expect("a process");
        let output = daemon
            .bench(folder.path(), arguments)
            .output()
            .expect("a process");
        assert_eq!(outcome(&output), outcome(&expected), "{arguments:?}");
        assert_ne!(output.status.code(), Some(0));
    }
}

#[test]
fn command_over_tcp_prints_what_it_prints_there() {
    let daemon = Daemon::start();
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["control", "--slow", "--seed", "4", "--duration", "2s"];
    let expected = bench_in(folder.path(), &arguments)
        .output()
        .expect("a process");
    let url = daemon.url();
    let remote = [&arguments[..], &["--connect", &url]].concat();
    let output = bench_in(folder.path(), &remote)
        .env("BENCH_TOKEN", daemon.token())
        .output()
        .expect("a process");
    let text = |output: &Output| {
        let text = comparable(&output.stdout);
        text.lines()
            .filter(|line| !line.contains("recording"))
            .map(String::from)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    // The daemon runs at another rate than the default configuration.
    assert_eq!(text(&output).len(), text(&expected).len());
    let listed = daemon.get("/api/v1/recordings");
    assert_eq!(listed["recordings"].as_array().map(Vec::len), Some(1));
    let without_token = format!("http://{}", daemon.address());
    let refused = [&arguments[..], &["--connect", &without_token]].concat();
    let output = bench_in(folder.path(), &refused)
        .output()
        .expect("a process");
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("needs the token"));
}

#[test]
fn daemon_checks_certificate_and_stage_of_an_order_and_records_the_reason_of_an_override() {
    let daemon = Daemon::start();
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| -> (serde_json::Value, String) {
        let mut command = daemon.bench(folder.path(), arguments);
        let output = command.output().expect("a process");
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {errors}");
        (
            serde_json::from_slice(&output.stdout).expect("JSON"),
            errors,
        )
    };
    let sweep = ["--duration", "20s", "--start", "1Hz", "--stop", "100Hz"];
    let (chirp, _) = run(&[&["chirp", "--json", "--out", "evidence"], &sweep[..]].concat());
    let certificate = chirp["certificate"].as_str().expect("a path");
    let control = ["control", "--slow", "--duration", "1s", "--json"];
    let other_load = ["--asymmetry", "5%", "--certificate", certificate];
    let (_, errors) = run(&[&control[..], &other_load].concat());
    assert!(errors.contains("plant.mass_asymmetry = 0.1"), "{errors}");
    let names = files(folder.path());
    assert!(names.contains(&"stage-check.mcap".into()), "{names:?}");
    let reason = "a reason of the operator";
    let (report, _) = run(&[&control[..], &["--override", reason]].concat());
    let path = folder
        .path()
        .join(report["recording"].as_str().expect("a path"));
    let recording = bench_recording::Recording::open(&path).expect("a recording");
    let recorded = recording.metadata().get("override").map(String::as_str);
    assert_eq!(recorded, Some(reason));
}
