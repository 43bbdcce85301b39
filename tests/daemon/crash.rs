//! A daemon that is killed: the next one is disarmed, says why it started, and recovers the recording.
use bench::recording::Recording;

use crate::common::Daemon;

const MOST_LOST_S: f64 = 1.0;

/// Moments of the kill in milliseconds after the start of the run: 3 in each test run, 20 with BENCH_KILLS=20.
fn kills() -> impl Iterator<Item = u64> {
    let count: u64 = std::env::var("BENCH_KILLS")
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(3);
    (0..count).map(|number| 300 + (number * 617) % 1900)
}

#[test]
fn kill_at_any_moment_leaves_a_readable_recording_and_a_disarmed_bench() {
    let mut folder = tempfile::tempdir().expect("a folder");
    for (number, after_ms) in kills().enumerate() {
        let daemon = Daemon::start_in(folder);
        let lease = daemon.take_lease("anna");
        let args = ["--slow", "--duration", "60s", "--pace", "realtime"];
        daemon.start_run(&lease, "control", &args);
        daemon.wait("running", &lease, |state| {
            state["loop"]["state"] == "running"
        });
        std::thread::sleep(std::time::Duration::from_millis(after_ms));
        let ticks = daemon.state()["run"]["progress"]["done"]
            .as_u64()
            .expect("ticks");
        folder = daemon.kill();

        let next = Daemon::start_in(folder);
        let state = next.state();
        let reason = state["daemon"]["start_reason"].as_str().expect("a reason");
        assert!(
            reason.contains("after a crash") && reason.contains("-recovered.mcap"),
            "{reason}"
        );
        assert_eq!(state["loop"]["state"], "disarmed");
        assert!(state["run"].is_null() && state["lease"].is_null());
        let copies = recovered(&next);
        assert_eq!(copies.len(), number + 1, "one copy for each kill");
        let newest = copies.last().expect("a copy");
        let recording = Recording::open(&next.recordings().join(newest)).expect("readable");
        let lost = ticks.saturating_sub(recording.tick_count());
        assert!(
            lost as f64 * 1e-3 <= MOST_LOST_S,
            "{lost} of {ticks} ticks are lost"
        );
        folder = next.terminate().1;
    }
    let last = Daemon::start_in(folder);
    assert_eq!(
        last.state()["daemon"]["start_reason"],
        "started",
        "after a clean shutdown"
    );
}

fn recovered(daemon: &Daemon) -> Vec<String> {
    let listed = daemon.get("/api/v1/recordings");
    let names = listed["recordings"].as_array().expect("a list").iter();
    let names = names.map(|listed| listed["file"].as_str().expect("a name").to_string());
    let mut copies: Vec<String> = names
        .filter(|name| name.ends_with("-recovered.mcap"))
        .collect();
    copies.sort();
    copies
}
