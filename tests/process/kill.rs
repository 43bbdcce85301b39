//! SIGKILL: the program cannot react, and the written part of the recording is still readable.
use bench::recording::Recording;

use crate::common::{LongRun, RATE_HZ, Running, arguments_of, bench, recording_in, stderr};

#[test]
fn killed_run_is_recovered_except_for_the_last_second() {
    for run in [LongRun::Control, LongRun::Chirp] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut running = Running::start(&arguments_of(run), folder.path());
        let sleeps = running.until_slept(5 * RATE_HZ / 2);
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
        // The loop sleeps at most once per tick, and about ten times at its start, so at least `begun` ticks had begun at the
        // kill. Up to 0.5 s of ticks are on the way to the recorder, and up to 0.5 s are in the open chunk.
        let begun = sleeps - 10;
        assert!(
            recovered.last_tick() + RATE_HZ >= begun,
            "{} of {begun} ticks",
            recovered.last_tick()
        );
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
    }
}
