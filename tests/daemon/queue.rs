//! Queue, lease, stops, and lost clients.
use std::process::Stdio;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::daemon::common::{Daemon, TIME_LIMIT};

const CONTROL: [&str; 8] = [
    "--slow",
    "--reference",
    "sine",
    "--amplitude",
    "20um",
    "--duration",
    "60s",
    "--pace",
];

fn control() -> Vec<&'static str> {
    [&CONTROL[..], &["realtime"]].concat()
}

fn is_running(state: &Value) -> bool {
    state["loop"]["state"] == "running" && state["run"]["phase"] == "running"
}

fn is_idle(state: &Value) -> bool {
    state["run"].is_null() && state["loop"]["state"] == "disarmed"
}

#[test]
fn run_under_a_lease_is_tuned_and_settles_at_a_stop() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    let id = daemon.start_run(&lease, "control", &control());
    daemon.wait("running", &lease, is_running);
    let tune =
        |lease: &str, body: Value| daemon.ask("POST", "/api/v1/tune", lease, Some(body)).status;
    assert_eq!(tune(&lease, json!({ "reference": 0.5 })), 204);
    assert_eq!(tune("wrong", json!({ "reference": 0.5 })), 403);
    assert_eq!(
        tune(&lease, json!({ "gain": 9.0 })),
        422,
        "the margins of this gain are too small"
    );
    assert_eq!(tune(&lease, json!({ "gain": -1.0 })), 400);
    // The loop is closed after 0.5 s; then the current is not zero.
    daemon.wait("closed", &lease, |state| {
        !state["loop"]["error_m"].is_null()
    });
    let answer = daemon.raw("POST", "/api/v1/stop", &[], b"{}");
    assert_eq!(answer.status, 200, "anyone may stop, without a token");
    let run = daemon.wait_for_end(id, &lease);
    assert_eq!(
        (&run["outcome"], &run["exit_code"]),
        (&json!("stopped"), &json!(1))
    );
    let state = daemon.wait("disarmed", "", is_idle);
    assert_eq!(state["loop"]["current_a"], 0.0);
    let events: Vec<String> = recorded_events(&daemon, &run);
    for wanted in ["running -> settling", "settling -> disarmed"] {
        assert!(
            events.iter().any(|event| event == wanted),
            "{wanted}: {events:?}"
        );
    }
    assert!(
        events.iter().any(|event| event.contains("tune")),
        "{events:?}"
    );
}

fn recorded_events(daemon: &Daemon, run: &Value) -> Vec<String> {
    let file = run["recording"].as_str().expect("a recording");
    let recording =
        bench_recording::Recording::open(&daemon.recordings().join(file)).expect("readable");
    recording
        .events()
        .iter()
        .map(bench_recording::event_text)
        .collect()
}

#[test]
fn lost_lease_stops_control_and_not_a_chirp() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    let id = daemon.start_run(&lease, "control", &control());
    daemon.wait("running", &lease, is_running);
    assert_eq!(
        daemon.ask("DELETE", "/api/v1/lease", &lease, None).status,
        204
    );
    let run = daemon.wait_for_end(id, "");
    assert_eq!(
        (&run["outcome"], &run["is_orphan"]),
        (&json!("stopped"), &json!(true))
    );

    let lease = daemon.take_lease("anna");
    let chirp = [
        "--duration",
        "6s",
        "--start",
        "20Hz",
        "--stop",
        "100Hz",
        "--amplitude",
        "0.1A",
        "--pace",
        "realtime",
    ];
    let id = daemon.start_run(&lease, "chirp", &chirp);
    daemon.wait("running", &lease, is_running);
    daemon.ask("DELETE", "/api/v1/lease", &lease, None);
    let state = daemon.state();
    assert_eq!(
        state["lease"]["expires_in_s"],
        Value::Null,
        "the run keeps the lease"
    );
    let run = daemon.wait_for_end(id, "");
    // A busy machine misses ticks, and the analysis may then refuse the recording. The run itself comes to its end.
    let events = recorded_events(&daemon, &run);
    assert!(
        events.iter().any(|event| event.contains("came to its end")),
        "{run} {events:?}"
    );
    daemon.wait("the lease ends with the run", "", |state| {
        state["lease"].is_null()
    });
}

#[test]
fn killed_command_stops_control() {
    let daemon = Daemon::start();
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        &["control"][..],
        &control(),
        &["--set", "interlock.overruns_per_s=1000000"],
    ]
    .concat();
    let mut child = daemon
        .bench(folder.path(), &arguments)
        .stdout(Stdio::null())
        .spawn()
        .expect("a process");
    daemon.wait("running", "", is_running);
    child.kill().expect("it runs");
    let _ = child.wait();
    daemon.wait("disarmed", "", is_idle);
    let run = daemon.run(1);
    assert_eq!(
        (&run["outcome"], &run["is_orphan"]),
        (&json!("stopped"), &json!(true))
    );
    let file = folder
        .path()
        .join("recordings")
        .join(run["recording"].as_str().expect("a recording"));
    let recording = bench_recording::Recording::open(&file).expect("a complete recording");
    assert!(!recording.truncated());
}

#[test]
fn queue_holds_several_commands_and_cancels_them() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    let first = daemon.start_run(&lease, "control", &control());
    let second = daemon.start_run(&lease, "chirp", &[]);
    let third = daemon.start_run(&lease, "chirp", &[]);
    let state = daemon.wait("running", &lease, is_running);
    let queue = state["queue"].as_array().expect("a list");
    assert_eq!(queue.len(), 2);
    let stop = |id: u64| {
        daemon
            .ask(
                "POST",
                &format!("/api/v1/runs/{id}/stop"),
                "",
                Some(json!({})),
            )
            .status
    };
    assert_eq!(stop(third), 200);
    assert_eq!(daemon.run(third)["outcome"], "stopped");
    assert_eq!(
        daemon.run(first)["phase"],
        "running",
        "only that command is stopped"
    );
    assert_eq!(stop(first), 200);
    assert_eq!(daemon.wait_for_end(first, &lease)["outcome"], "stopped");
    assert_eq!(daemon.run(second)["phase"], "held");
    daemon.resume(&lease);
    assert_eq!(daemon.wait_for_end(second, &lease)["outcome"], "completed");
    assert_eq!(stop(999), 404);
}

#[test]
fn second_operator_is_refused_while_the_lease_is_held() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    let other = daemon.ask(
        "POST",
        "/api/v1/lease",
        "",
        Some(json!({ "operator": "ben" })),
    );
    assert_eq!(other.status, 409);
    assert!(
        other.json()["error"]["message"]
            .as_str()
            .expect("a text")
            .contains("anna")
    );
    let refused = daemon.ask(
        "POST",
        "/api/v1/runs",
        "",
        Some(json!({ "command": "chirp" })),
    );
    assert_eq!(refused.status, 403);
    daemon.ask("DELETE", "/api/v1/lease", &lease, None);
    daemon.take_lease("ben");
}

#[test]
fn sigterm_settles_the_run_and_completes_its_recording() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    daemon.start_run(&lease, "control", &control());
    daemon.wait("running", &lease, is_running);
    // The loop is closed after 0.5 s; then the current is not zero.
    std::thread::sleep(Duration::from_millis(1200));
    let begun = Instant::now();
    let (output, folder) = daemon.terminate();
    assert!(begun.elapsed() < TIME_LIMIT);
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let files: Vec<_> = std::fs::read_dir(folder.path().join("recordings"))
        .unwrap()
        .collect();
    let mcap = files.iter().map(|entry| entry.as_ref().unwrap().path());
    let mcap: Vec<_> = mcap
        .filter(|path| path.extension().is_some_and(|e| e == "mcap"))
        .collect();
    assert_eq!(mcap.len(), 1);
    let recording = bench_recording::Recording::open(&mcap[0]).expect("a complete recording");
    assert!(!recording.truncated(), "the file has its end");
    let events: Vec<String> = recording
        .events()
        .iter()
        .map(bench_recording::event_text)
        .collect();
    assert!(
        events.iter().any(|event| event == "settling -> disarmed"),
        "{events:?}"
    );
    assert!(!folder.path().join("bench.sock").exists());
}
