//! A daemon that is killed: the next one is disarmed, says why it started, and recovers the recording.
use std::path::{Path, PathBuf};

use bench_recording::Recording;

use crate::daemon::common::Daemon;

/// The longest time that may be lost, in seconds: the chunk of 0.1 s that is not complete, and as much again for the threads of loop and
/// recorder.
const MAX_LOSS_S: f64 = 0.2;

/// Number of kills, and whether the machine is idle, which is so where BENCH_KILLS is set.
fn kills() -> (u64, bool) {
    let count = std::env::var("BENCH_KILLS").ok();
    match count.and_then(|text| text.parse().ok()) {
        Some(count) => (count, true),
        None => (3, false),
    }
}

/// Time in seconds of the `ticks` of a run at 1 kHz that its recording lacks.
fn lost_s(ticks: u64, recording: &Path) -> f64 {
    let written = Recording::open(recording).map_or(0, |recording| recording.tick_count());
    ticks.saturating_sub(written) as f64 * 1e-3
}

/// The recording that was begun last.
fn begun_last(folder: &Path) -> PathBuf {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let recordings = paths.filter(|path| path.extension().is_some_and(|ending| ending == "mcap"));
    recordings
        .max_by_key(|path| {
            std::fs::metadata(path)
                .and_then(|file| file.modified())
                .ok()
        })
        .expect("a recording")
}

#[test]
fn kill_at_any_moment_leaves_a_readable_recording_and_a_disarmed_bench() {
    let mut folder = tempfile::tempdir().expect("a folder");
    let (kills, is_idle_machine) = kills();
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
        if !is_idle_machine {
            // The threads of a busy machine have to wait for a processor: the recorder may be behind the loop.
            let path = begun_last(&daemon.recordings());
            daemon.wait("the recorder follows the loop", &lease, |_| {
                lost_s(ticks, &path) <= MAX_LOSS_S
            });
        }
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
        // Two recordings may have begun within one second, so that their names do not tell which one is newer.
        let newest = reason.rsplit("recovered: ").next().expect("a name");
        assert!(copies.iter().any(|copy| copy == newest), "{reason}");
        let lost = lost_s(ticks, &next.recordings().join(newest));
        assert!(lost <= MAX_LOSS_S, "{lost} s of {ticks} ticks are lost");
        println!("kill {number}: {lost} s of {ticks} ticks are lost");
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
