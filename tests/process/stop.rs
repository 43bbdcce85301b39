//! The signals that stop a run.
use std::path::Path;
use std::process::Stdio;

use bench_recording::Recording;
use bench_rt::arming::State;
use bench_rt::record::{Event, EventKind, RequestKind, TickRecord};

use crate::process::common::{
    LongRun, RATE_HZ, Running, arguments_of, bench, recording_in, stderr, ticks, without_daemon,
};

/// Starts a run through `env`, which sets whether SIGHUP is ignored.
fn start_with(run: LongRun, disposition: &str, folder: &Path) -> Running {
    let mut command = without_daemon("env");
    command
        .arg(disposition)
        .arg(env!("CARGO_BIN_EXE_bench"))
        .args(arguments_of(run))
        .arg("--out")
        .arg(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    Running::of(&mut command)
}

/// The tick of an event.
fn tick_of(recording: &Recording, kind: EventKind) -> u64 {
    let mut events = recording.events().iter();
    let event = events.find(|event| event.kind == kind);
    event.unwrap_or_else(|| panic!("{kind:?} is recorded")).tick
}

/// The tick at which the loop took the first request of a kind.
fn tick_of_request(recording: &Recording, kind: RequestKind) -> u64 {
    let mut events = recording.events().iter();
    let event = events.find(|event| is_request(event, kind));
    event.unwrap_or_else(|| panic!("{kind:?} is recorded")).tick
}

fn is_request(event: &Event, kind: RequestKind) -> bool {
    matches!(event.kind, EventKind::Request(request) if request.kind == kind)
}

/// A run stopped by a signal ends at zero current, with a complete recording and report.
fn stopped_by(signal: i32, run: LongRun) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // These tests may themselves run with SIGHUP ignored.
    let mut running = start_with(run, "--default-signal=HUP", folder.path());
    // The loop closes half a second after the start, the chirp begins after a tenth.
    running.until_slept(RATE_HZ);
    running.signal(signal);
    let output = running.end();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let report: serde_json::Value =
        serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(
        (report["outcome"].as_str(), report["trip"].is_null()),
        (Some("stopped"), true)
    );

    let path = recording_in(folder.path());
    let recording = Recording::open(&path).expect("a recording");
    assert!(!recording.truncated() && recording.lost_records() == 0);
    let results = recording
        .attachment("results.json")
        .expect("the results are in the recording");
    let results: serde_json::Value = serde_json::from_slice(&results.data).expect("JSON");
    assert_eq!(
        results, report,
        "the recording has the results of the program"
    );
    assert_eq!(results["ticks"].as_u64(), Some(recording.tick_count()));

    let stop = tick_of_request(&recording, RequestKind::Finish);
    assert_eq!(tick_of(&recording, SETTLING), stop);
    let off = EventKind::State {
        from: State::Settling,
        to: State::Disarmed,
    };
    let off = tick_of(&recording, off);
    let ramp_ticks: u64 = recording.metadata()["ramp_ticks"]
        .parse()
        .expect("a number");
    assert!(
        (stop + ramp_ticks..=stop + 2 * ramp_ticks + recording.overruns()).contains(&off),
        "{stop} to {off}, ramps of {ramp_ticks}"
    );
    let ticks = ticks(&recording);
    let (before, after): (Vec<TickRecord>, Vec<TickRecord>) =
        ticks.into_iter().partition(|r| r.tick < off);
    assert!(
        before.iter().any(|record| record.command_a != 0.0),
        "a current flowed before the end"
    );
    assert!(
        after.iter().all(|record| record.command_a.to_bits() == 0),
        "no current after the ramps"
    );
    // A tenth of a second is recorded after the run, including late ticks.
    let after_end = recording.last_tick() - off;
    assert!(
        (RATE_HZ / 10 - 1..60 * RATE_HZ).contains(&after_end) && after.len() as u64 >= RATE_HZ / 10,
        "{after_end}"
    );
    assert_eq!(
        recording.tick_count() + recording.overruns(),
        recording.last_tick() + 1
    );

    let replay = bench(&["replay", "--json"])
        .arg(&path)
        .output()
        .expect("it runs");
    assert_eq!(replay.status.code(), Some(0), "{}", stderr(&replay));
}

#[test]
fn ctrl_c_stops_a_closed_loop_with_zero_current_and_complete_recording() {
    stopped_by(libc::SIGINT, LongRun::Control);
}

#[test]
fn ctrl_c_stops_a_chirp_with_zero_current_and_complete_recording() {
    stopped_by(libc::SIGINT, LongRun::Chirp);
}

#[test]
fn sigterm_stops_a_closed_loop_with_zero_current_and_complete_recording() {
    stopped_by(libc::SIGTERM, LongRun::Control);
}

#[test]
fn sigterm_stops_a_chirp_with_zero_current_and_complete_recording() {
    stopped_by(libc::SIGTERM, LongRun::Chirp);
}

#[test]
fn a_dropped_connection_stops_a_closed_loop_with_zero_current_and_complete_recording() {
    stopped_by(libc::SIGHUP, LongRun::Control);
}

#[test]
fn sigquit_stops_a_closed_loop_with_zero_current_and_complete_recording() {
    stopped_by(libc::SIGQUIT, LongRun::Control);
}

#[test]
fn hang_up_does_not_stop_a_run_that_ignores_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut running = start_with(LongRun::Control, "--ignore-signal=HUP", folder.path());
    running.until_slept(RATE_HZ / 10);
    running.signal(libc::SIGHUP);
    running.until_slept(RATE_HZ);
    running.signal(libc::SIGINT);
    let output = running.end();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let recording = Recording::open(&recording_in(folder.path())).expect("a recording");
    assert!(!recording.truncated());
    assert!(
        recording.last_tick() > RATE_HZ / 2,
        "{}",
        recording.last_tick()
    );
}

/// A closed loop with ramps of a minute: a test ends only if a second signal cuts the current.
fn start_with_long_ramps(folder: &Path) -> Running {
    let ramps = ["--set", "loop.stop_ramp_s=60"];
    let arguments = [arguments_of(LongRun::Control), ramps.to_vec()].concat();
    Running::start(&arguments, folder)
}

const SETTLING: EventKind = EventKind::State {
    from: State::Running,
    to: State::Settling,
};

#[test]
fn repeated_signals_cut_the_current_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut running = start_with_long_ramps(folder.path());
    running.until_slept(RATE_HZ);
    for _ in 0..3 {
        running.signal(libc::SIGINT);
        running.signal(libc::SIGTERM);
    }
    let output = running.end();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let recording = Recording::open(&recording_in(folder.path())).expect("a recording");
    assert!(!recording.truncated());
    let stops = recording
        .events()
        .iter()
        .filter(|e| is_request(e, RequestKind::Stop))
        .count();
    assert_eq!(stops, 1);
}

#[test]
fn second_signal_cuts_the_current() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut running = start_with_long_ramps(folder.path());
    running.until_slept(RATE_HZ);
    running.signal(libc::SIGINT);
    running.until_recorded(folder.path(), "the run settles", |written| {
        written.events().iter().any(|event| event.kind == SETTLING)
    });
    running.signal(libc::SIGINT);
    let output = running.end();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let recording = Recording::open(&recording_in(folder.path())).expect("a recording");
    assert!(!recording.truncated());
    let finish = tick_of_request(&recording, RequestKind::Finish);
    let stop = tick_of_request(&recording, RequestKind::Stop);
    assert!(stop > finish, "{stop} after {finish}");
    let ticks = ticks(&recording);
    let settled = ticks.iter().filter(|r| r.state == State::Settling);
    assert!(settled.count() > 0);
    let mut after = ticks.iter().filter(|r| r.tick >= stop);
    assert!(after.all(|r| r.command_a == 0.0 && r.state == State::Disarmed));
}
