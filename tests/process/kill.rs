//! SIGKILL: the program cannot react, and the written part of the recording is still readable.
use std::time::Duration;

use bench_recording::Recording;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;

use crate::process::common::{LongRun, Running, arguments_of, bench, recording_in, stderr};

/// Kills of each kind of run; `BENCH_KILLS` sets another number.
const KILLS: u64 = 1;
/// Largest loss in seconds: the chunk of 0.1 s that is not complete, and as much again for the threads of loop and recorder.
const MAX_LOSS_S: f64 = 0.2;

/// Kills of each kind of run, and whether the machine is idle.
#[derive(Clone, Copy)]
struct Kills {
    count: u64,
    /// The recorder keeps up with the loop, so that a run may be killed at any moment. The threads of a busy machine have to wait for a
    /// processor: there the test first waits until the recorder has written what the loop had done.
    is_idle_machine: bool,
}

impl Kills {
    fn chosen() -> Kills {
        let chosen = std::env::var("BENCH_KILLS").ok();
        let chosen = chosen.and_then(|text| text.parse().ok());
        Kills {
            count: chosen.unwrap_or(KILLS),
            is_idle_machine: chosen.is_some(),
        }
    }
}

/// A real-time run is killed after `sleeps` sleeps of its loop; returns the lost time in seconds.
fn loss_s(run: LongRun, rate_hz: u64, sleeps: u64, is_idle_machine: bool) -> f64 {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rate = format!("loop.rate_hz={rate_hz}");
    let arguments = [arguments_of(run), vec!["--set", &rate]].concat();
    let mut running = Running::start(&arguments, folder.path());
    // The loop sleeps at most once per tick, and about ten times at its start, so at least `begun` ticks had begun at the kill.
    let begun = running.until_slept(sleeps).saturating_sub(10);
    let unwritten_s =
        |written: &Recording| begun.saturating_sub(written.last_tick()) as f64 / rate_hz as f64;
    if !is_idle_machine {
        running.until_recorded(folder.path(), "the recorder follows the loop", |written| {
            unwritten_s(written) <= MAX_LOSS_S
        });
    }
    running.signal(libc::SIGKILL);
    assert_eq!(running.end().status.code(), None, "killed");

    let path = recording_in(folder.path());
    let before = std::fs::read(&path).expect("a file");
    let output = bench(&["recover", "--json"])
        .arg(&path)
        .output()
        .expect("it runs");
    let report: serde_json::Value =
        serde_json::from_slice(&output.stdout).expect("one JSON object");
    // The ticks since the last complete chunk are lost.
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(
        report["cut"].is_object(),
        "the end of the file is reported: {report}"
    );
    assert_eq!(
        std::fs::read(&path).expect("still there"),
        before,
        "the original is not touched"
    );

    let recovered = Recording::open(report["recording"].as_str().expect("a path").as_ref())
        .expect("whole again");
    assert!(!recovered.truncated());
    assert_eq!(report["ticks"].as_u64(), Some(recovered.tick_count()));
    assert_eq!(
        recovered.tick_count() + recovered.overruns() + recovered.lost_records(),
        recovered.last_tick() + 1
    );
    let replay = bench(&["replay"]).arg(&path).output().expect("it runs");
    assert_eq!(
        replay.status.code(),
        Some(0),
        "the readable part replays: {}",
        stderr(&replay)
    );
    unwritten_s(&recovered)
}

#[test]
fn killed_run_is_recovered_except_for_its_end() {
    let kills = Kills::chosen();
    let mut random = Pcg64::seed_from_u64(13);
    let mut largest_s: f64 = 0.0;
    for kill in 0..kills.count {
        for (run, rate_hz) in [
            (LongRun::Control, 1000),
            (LongRun::Chirp, 1000),
            (LongRun::Control, 5000),
        ] {
            let sleeps = rate_hz / 2 + random.next_u64() % (2 * rate_hz);
            let lost_s = loss_s(run, rate_hz, sleeps, kills.is_idle_machine);
            assert!(
                lost_s <= MAX_LOSS_S,
                "kill {kill} at {rate_hz} Hz after {sleeps} sleeps: {lost_s} s lost"
            );
            largest_s = largest_s.max(lost_s);
        }
    }
    println!("largest loss of {} kills: {largest_s:.3} s", kills.count);
}

#[test]
fn killed_run_in_virtual_pace_is_recovered() {
    let mut random = Pcg64::seed_from_u64(14);
    for _ in 0..Kills::chosen().count {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let arguments = ["control", "--slow", "--duration", "3600", "--json"];
        let mut running = Running::start(&arguments, folder.path());
        running.until("some chunks are written", |_| has_chunk(folder.path()));
        std::thread::sleep(Duration::from_millis(random.next_u64() % 200));
        running.signal(libc::SIGKILL);
        running.end();
        let path = recording_in(folder.path());
        let output = bench(&["recover", "--json"]).arg(&path).output();
        assert_eq!(output.expect("it runs").status.code(), Some(3));
        let replay = bench(&["replay"]).arg(&path).output().expect("it runs");
        assert_eq!(replay.status.code(), Some(0), "{}", stderr(&replay));
    }
}

/// Whether the folder has a recording with some chunks.
fn has_chunk(folder: &std::path::Path) -> bool {
    let files = std::fs::read_dir(folder).expect("a folder");
    let lengths = files.filter_map(|file| Some(file.ok()?.metadata().ok()?.len()));
    lengths.max().is_some_and(|bytes| bytes > 200_000)
}
