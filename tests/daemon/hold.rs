//! After a stop or a trip nothing begins until the holder of the lease resumes; a client that hangs leaves no run.
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use serde_json::{Value, json};

use crate::daemon::common::{Daemon, NO_OVERRUN_LIMIT, freeze, signal, thaw};

const SLOW: [&str; 5] = ["--slow", "--duration", "60s", "--pace", "realtime"];
/// A closed loop that is unstable with this asymmetry, so that an interlock trips.
const TRIPS: [&str; 6] = [
    "--fast",
    "--asymmetry",
    "-10%",
    "--duration",
    "60s",
    "--pace",
];
/// Time in which a command that may begin does so (review: 0.2 to 1.1 s).
const WATCHED: Duration = Duration::from_secs(3);

fn is_running(state: &Value) -> bool {
    state["loop"]["state"] == "running" && state["run"]["phase"] == "running"
}

fn is_free(state: &Value) -> bool {
    state["run"].is_null() && state["loop"]["state"] == "disarmed"
}

/// Watches a held bench: no command gets its turn, and no current flows.
fn stays_held(daemon: &Daemon, lease: &str) {
    let begun = Instant::now();
    while begun.elapsed() < WATCHED {
        let state = daemon.state();
        assert!(is_free(&state) && !state["held"].is_null(), "{state}");
        assert_eq!(state["loop"]["current_a"], 0.0, "{state}");
        if !lease.is_empty() {
            assert_eq!(daemon.ask("PUT", "/api/v1/lease", lease, None).status, 200);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn terminal(daemon: &Daemon, user: &str, arguments: &[&str]) -> Child {
    let mut command: Command = daemon.bench(daemon.path(), arguments);
    command.args(NO_OVERRUN_LIMIT).env("USER", user);
    let command = command.stdout(Stdio::null()).stderr(Stdio::piped());
    command.spawn().expect("a process")
}

fn resume(daemon: &Daemon, arguments: &[&str]) -> (Option<i32>, Value) {
    let arguments = [&["resume", "--json"], arguments].concat();
    let mut command = daemon.bench(daemon.path(), &arguments);
    let output = command.env("BENCH_TOKEN", daemon.token()).output();
    let output = output.expect("a process");
    let json = serde_json::from_slice(&output.stdout).expect("JSON");
    (output.status.code(), json)
}

#[test]
fn stop_holds_the_queue_of_every_operator_until_a_resume() {
    for how in ["settle", "cut"] {
        let daemon = Daemon::start();
        let lease = daemon.take_lease("anna");
        let first = daemon.start_run(&lease, "control", &SLOW);
        let second = daemon.start_run(&lease, "control", &SLOW);
        daemon.wait("running", &lease, is_running);
        let mut other = terminal(&daemon, "ben", &[&["control"], &SLOW[..]].concat());
        daemon.wait("ben waits", &lease, |state| {
            state["queue"].as_array().map(Vec::len) == Some(2)
        });
        let body = json!({ "how": how }).to_string();
        let stopped = daemon.raw("POST", "/api/v1/stop", &[], body.as_bytes());
        assert_eq!(stopped.status, 200);
        let state = daemon.wait("free", &lease, is_free);
        let held = &state["held"];
        assert_eq!(
            (&held["cause"], &held["how"], &held["run"], &held["by"]),
            (
                &json!("stop"),
                &json!(how),
                &json!(first),
                &json!("a client at 127.0.0.1")
            )
        );
        let phases = state["queue"].as_array().expect("a list").iter();
        assert!(phases.clone().all(|run| run["phase"] == "held"), "{state}");
        let metrics = daemon.ask("GET", "/metrics", "", None).body;
        assert!(String::from_utf8_lossy(&metrics).contains("\nbench_held 1\n"));
        let third = daemon.start_run(&lease, "control", &SLOW);
        assert_eq!(daemon.run(third)["phase"], "held");
        stays_held(&daemon, &lease);
        for wrong in ["", "0123456789abcdef"] {
            let refused = daemon.ask("POST", "/api/v1/resume", wrong, None);
            assert_eq!(refused.status, 403);
        }
        daemon.resume(&lease);
        daemon.resume(&lease); // nothing is held any more
        let state = daemon.wait("the next command runs", &lease, is_running);
        assert_eq!(
            (&state["run"]["id"], &state["held"]),
            (&json!(second), &Value::Null)
        );
        other.kill().expect("it waits");
        let _ = other.wait();
    }
}

#[test]
fn stop_without_a_run_holds_the_bench_and_resume_at_a_terminal_releases_it() {
    let daemon = Daemon::start();
    assert_eq!(daemon.raw("POST", "/api/v1/stop", &[], b"").status, 200);
    let mut waiting = terminal(&daemon, "ben", &["control", "--slow", "--duration", "1s"]);
    daemon.wait("ben waits", "", |state| {
        state["queue"][0]["phase"] == "held"
    });
    stays_held(&daemon, "");
    let lease = daemon.take_lease("anna");
    let (code, refused) = resume(&daemon, &[]);
    assert_eq!(code, Some(1), "{refused}");
    let message = refused["error"]["message"].as_str().expect("a message");
    assert!(message.contains("anna holds the arm lease"), "{message}");
    daemon.ask("DELETE", "/api/v1/lease", &lease, None);
    let (code, released) = resume(&daemon, &["--connect", &daemon.url()]);
    assert_eq!(
        (code, &released["held"]["cause"]),
        (Some(0), &json!("stop"))
    );
    assert_eq!(waiting.wait().expect("it ends").code(), Some(0));
    let mut text = String::new();
    let errors = waiting.stderr.as_mut().expect("a pipe");
    std::io::Read::read_to_string(errors, &mut text).expect("text");
    for part in ["stopped by a client at 127.0.0.1 at 20", "bench resume"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert_eq!(
        resume(&daemon, &[]),
        (Some(0), json!({ "held": null, "trip": null }))
    );
    assert!(
        daemon.state()["lease"].is_null(),
        "resume releases the lease"
    );
}

#[test]
fn trip_holds_the_queue_and_stays_in_the_state_until_it_is_acknowledged() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    // At 1 kHz the fast controller trips as well; the second command must not begin.
    let trips = [&TRIPS[..], &["realtime", "--set", "loop.rate_hz=5000"]].concat();
    let first = daemon.start_run(&lease, "control", &trips);
    let second = daemon.start_run(&lease, "control", &SLOW);
    daemon.wait("tripped", &lease, |state| state["held"]["cause"] == "trip");
    daemon.wait("free", &lease, is_free);
    stays_held(&daemon, &lease);
    let state = daemon.state();
    let remedy = state["trip"]["remedy"].as_str();
    assert!(remedy.is_some_and(|text| !text.is_empty()), "{state}");
    assert_eq!(state["held"]["run"], first);
    assert_eq!(
        daemon.ask("POST", "/api/v1/clear", &lease, None).status,
        204
    );
    let state = daemon.state();
    assert!(
        state["trip"].is_null() && !state["held"].is_null(),
        "{state}"
    );
    daemon.resume(&lease);
    let state = daemon.wait("the next command runs", &lease, is_running);
    assert_eq!(state["run"]["id"], second);
}

#[test]
fn ctrl_c_at_a_terminal_holds_the_others_and_cancels_a_command_that_waits() {
    let daemon = Daemon::start();
    let run = [&["control"], &SLOW[..]].concat();
    let mut first = terminal(&daemon, "anna", &run);
    daemon.wait("running", "", is_running);
    let mut second = terminal(&daemon, "ben", &run);
    let mut third = terminal(&daemon, "carl", &run);
    let waits = |count| move |state: &Value| state["queue"].as_array().map(Vec::len) == Some(count);
    daemon.wait("both wait", "", waits(2));
    signal(&third, Signal::SIGINT);
    let _ = third.wait();
    let state = daemon.wait("carl has left", "", waits(1));
    assert!(state["held"].is_null(), "a cancelled command is no stop");
    signal(&first, Signal::SIGINT);
    let state = daemon.wait("free", "", is_free);
    let by = state["held"]["by"].as_str().expect("a text");
    assert!(by.contains("bench control by anna"), "{by}");
    assert_eq!(first.wait().expect("it ends").code(), Some(1));
    stays_held(&daemon, "");
    second.kill().expect("it waits");
    let _ = second.wait();
}

#[test]
fn suspended_command_leaves_no_run_and_no_taken_bench() {
    let daemon = Daemon::start();
    let mut command = terminal(&daemon, "anna", &[&["control"], &SLOW[..]].concat());
    daemon.wait("running", "", is_running);
    freeze(&command);
    daemon.wait("the loop ends by its lease", "", |state| {
        state["loop"]["state"] == "disarmed"
    });
    daemon.wait("another operator may have the bench", "", |state| {
        state["run"].is_null() && state["lease"].is_null()
    });
    let lease = daemon.take_lease("zoe");
    let id = daemon.start_run(&lease, "control", &["--slow", "--duration", "1s"]);
    assert_eq!(daemon.wait_for_end(id, &lease)["outcome"], "completed");
    // The command continues, and its results complete its recording.
    thaw(&command);
    assert_eq!(command.wait().expect("it ends").code(), Some(1));
}

#[test]
fn stop_frees_the_bench_of_a_suspended_command_before_and_after_its_run() {
    // A chirp goes on without its client, and its analysis does not come.
    let daemon = Daemon::start();
    let chirp = [
        "chirp",
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
    let mut command = terminal(&daemon, "anna", &chirp);
    daemon.wait("running", "", is_running);
    freeze(&command);
    let state = daemon.wait("analysing", "", |state| {
        state["run"]["phase"] == "analysing"
    });
    let path = format!("/api/v1/runs/{}/stop", state["run"]["id"]);
    assert_eq!(daemon.ask("POST", &path, "", None).status, 200);
    daemon.wait("free", "", |state| {
        is_free(state) && state["lease"].is_null()
    });
    let _ = daemon.take_lease("zoe");
    command.kill().expect("it is suspended");
    let _ = command.wait();
}
