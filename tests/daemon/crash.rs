//! A daemon that is killed: the next one is disarmed, says why it started, and recovers the recording.
use bench::recording::Recording;

use crate::common::Daemon;

/// Number of kills, and the longest time that may be lost in seconds: 0.2 s on an idle machine, where BENCH_KILLS is set; tests that
/// run at the same time delay the recorder.
fn kills() -> (u64, f64) {
    let count = std::env::var("BENCH_KILLS").ok();
    match count.and_then(|text| text.parse().ok()) {
        Some(count) => (count, 0.2),
        None => (3, 1.0),
    }
}

#[test]
fn kill_at_any_moment_leaves_a_readable_recording_and_a_disarmed_bench() {
    let mut folder = tempfile::tempdir().expect("a folder");
    let (kills, most_lost_s) = kills();
    for number in 0..kills {
        let after_ms = 300 + (number * 617) % 1900;
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
        assert_eq!(copies.len() as u64, number + 1, "one copy for each kill");
        let newest = copies.last().expect("a copy");
        let recording = Recording::open(&next.recordings().join(newest)).expect("readable");
        let lost = ticks.saturating_sub(recording.tick_count());
        assert!(
            lost as f64 * 1e-3 <= most_lost_s,
            "{lost} of {ticks} ticks are lost"
        );
        println!("kill {number}: {lost} of {ticks} ticks are lost");
        folder = next.terminate().1;
    }
    let last = Daemon::start_in(folder);
    assert_eq!(
        last.state()["daemon"]["start_reason"],
        "started",
        "after a clean shutdown"
    );
    let (_, folder) = last.terminate();
    for left in ["bench.sock", "bench.token"] {
        assert!(!folder.path().join(left).exists(), "{left} is removed");
    }
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
