//! A run whose recording cannot be written: it ends, or goes on unrecorded. A limit of the size of files takes the place of a full
//! disk: every write beyond it fails.
use bench_recording::Recording;
use serde_json::Value;

use crate::daemon::common::Daemon;

/// 0.3 MB are some thousand ticks (2 or 4 times as much in a shell with larger blocks); the rate is 1 kHz.
const LIMIT_KB: u64 = 300;
const RUN: [&str; 5] = ["--slow", "--duration", "60s", "--seed", "4"];

fn metric(daemon: &Daemon) -> bool {
    let answer = daemon.ask("GET", "/metrics", "", None);
    let text = String::from_utf8(answer.body).expect("text");
    text.contains("\nbench_recording_defect 1\n")
}

fn says_so(state: &Value) -> bool {
    let defect = state["loop"]["recording_defect"].as_str();
    defect.is_some_and(|text| text.contains("could not be written"))
}

/// The run, and the ticks that can be read of its recording.
fn recorded_ticks(daemon: &Daemon) -> u64 {
    let names = std::fs::read_dir(daemon.recordings()).expect("a folder");
    let mut paths = names.map(|entry| entry.expect("an entry").path());
    let path = paths.find(|path| path.extension().is_some_and(|end| end == "mcap"));
    let recording = Recording::open(&path.expect("a recording")).expect("readable up to there");
    recording.tick_count()
}

#[test]
fn run_ends_if_its_recording_cannot_be_written() {
    let daemon = Daemon::start_with_file_limit(LIMIT_KB, &[]);
    let lease = daemon.take_lease("anna");
    let id = daemon.start_run(&lease, "control", &RUN);
    let run = daemon.wait_for_end(id, &lease);
    assert_eq!(
        (run["outcome"].as_str(), run["exit_code"].as_i64()),
        (Some("failed"), Some(1)),
        "{run}"
    );
    let message = run["message"].as_str().expect("a message");
    for part in [
        "File too large",
        "bench recover",
        "the run was stopped with zero current",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
    let state = daemon.wait("disarmed, with the defect", "", |state| {
        says_so(state) && state["loop"]["state"] == "disarmed"
    });
    assert!(metric(&daemon), "{state}");
    let ticks = recorded_ticks(&daemon);
    assert!((1_000..55_000).contains(&ticks), "{ticks}");
    // The next run has room for its recording.
    let id = daemon.start_run(&lease, "control", &["--slow", "--duration", "1s"]);
    let run = daemon.wait_for_end(id, &lease);
    assert_eq!(run["outcome"], "completed", "{run}");
    daemon.wait("no defect", "", |state| !says_so(state));
    assert!(!metric(&daemon));
}

#[test]
fn run_goes_on_unrecorded_if_the_configuration_says_so() {
    let settings = ["--set", "loop.on_recording_failure=continue"];
    let daemon = Daemon::start_with_file_limit(LIMIT_KB, &settings);
    let lease = daemon.take_lease("anna");
    let id = daemon.start_run(&lease, "control", &RUN);
    let run = daemon.wait_for_end(id, &lease);
    let message = run["message"].as_str().expect("a message");
    assert!(
        message.contains("File too large")
            && message.contains("the run went on to its end without a recording"),
        "{message}"
    );
    let state = daemon.wait("the defect is shown", "", says_so);
    assert!(metric(&daemon), "{state}");
    let ticks = recorded_ticks(&daemon);
    assert!((1_000..55_000).contains(&ticks), "{ticks}");
    // 60 s at 1 kHz: the loop made all ticks.
    daemon.wait("the ticks of the run are counted", "", |state| {
        state["loop"]["ticks"].as_u64() >= Some(60_000)
    });
}
