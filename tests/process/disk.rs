//! Full disks and folders that cannot be written to.
use std::path::Path;
use std::process::{Command, Output, Stdio};

use bench::recording::Recording;
use bench::rt::record::flag;

use crate::common::{AT_1_KHZ, NO_OVERRUN_LIMIT, Running, bench, recording_in, stderr, stdout};

/// The program with a limit of `blocks` for the size of a file, so that writing fails half-way.
fn command_with_file_limit(blocks: u32, arguments: &[&str], out: &Path) -> Command {
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
    let mut command = Command::new("sh");
    command
        .args(["-c", &script, env!("CARGO_BIN_EXE_bench")])
        .args(arguments)
        .arg("--out")
        .arg(out);
    command
}

fn run_with_file_limit(blocks: u32, arguments: &[&str], out: &Path) -> Output {
    command_with_file_limit(blocks, arguments, out)
        .output()
        .expect("a shell")
}

#[test]
fn disk_full_stops_the_run_and_keeps_the_written_part() {
    for arguments in [&["chirp"][..], &["control", "--fast", "--duration", "100"]] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        // 2048 blocks of 512 bytes (1024 in some shells): 1 or 2 MiB of some 25 MiB.
        let output = run_with_file_limit(2048, arguments, folder.path());
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(
            !stdout(&output).contains("overruns"),
            "the plan, but no results of a run that failed"
        );
        let path = recording_in(folder.path());
        assert!(
            message.contains(path.to_str().expect("text")) && message.contains("File too large"),
            "reason and file: {message}"
        );
        assert!(message.contains("bench recover"), "the remedy: {message}");
        assert!(
            message.contains("the run was stopped with zero current"),
            "{message}"
        );
        assert!(!message.contains("panicked"), "{message}");

        let recover = bench(&["recover"]).arg(&path).output().expect("it runs");
        assert_eq!(recover.status.code(), Some(0), "{}", stderr(&recover));
        let stem = path.file_stem().expect("a name").to_str().expect("text");
        let saved =
            Recording::open(&path.with_file_name(format!("{stem}_recovered.mcap"))).expect("whole");
        // 1 MiB at 30 to 100 bytes a tick, less a chunk of 2500.
        assert!(
            (5_000..80_000).contains(&saved.tick_count()),
            "{}",
            saved.tick_count()
        );
        assert!(
            saved
                .ticks()
                .expect("readable")
                .any(|r| r.is_ok_and(|r| r.flags & flag::ACTIVE != 0))
        );
    }
}

#[test]
fn disk_full_stops_a_real_time_run() {
    // The run takes an hour, and 64 blocks are full within seconds. If the run is not stopped, this test times out.
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = [
        &["control", "--slow", "--duration", "3600"][..],
        &AT_1_KHZ,
        &NO_OVERRUN_LIMIT,
    ]
    .concat();
    let mut command = command_with_file_limit(64, &arguments, folder.path());
    let mut running = Running::of(command.stdout(Stdio::piped()).stderr(Stdio::piped()));
    running.until_ended();
    let output = running.end();
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(
        message.contains("File too large")
            && message.contains("the run was stopped with zero current"),
        "{message}"
    );
}

#[test]
fn disk_full_at_start_prevents_motion() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = run_with_file_limit(0, &["chirp"], folder.path());
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(
        message.contains("File too large") && message.contains("nothing was moved"),
        "{message}"
    );
}

#[test]
fn unwritable_folder_is_reported_before_any_motion() {
    // No user, not even root, can create a file in /proc.
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("a_file");
    std::fs::write(&file, "a file instead of a folder").expect("a file");
    for out in [
        Path::new("/proc"),
        Path::new("/proc/recordings"),
        &file,
        &file.join("below"),
    ] {
        for command in ["chirp", "control"] {
            let output = bench(&[command])
                .arg("--out")
                .arg(out)
                .output()
                .expect("it runs");
            let message = stderr(&output);
            assert_eq!(output.status.code(), Some(1), "{message}");
            assert!(
                message.contains(out.to_str().expect("text"))
                    && message.contains("nothing was moved"),
                "{message}"
            );
            assert!(
                message.contains("--out") || message.contains("check that"),
                "the remedy: {message}"
            );
            assert!(
                !stdout(&output).contains("overruns") && !message.contains("panicked"),
                "{message}"
            );
        }
    }
    assert_eq!(
        std::fs::read_to_string(&file).expect("still there"),
        "a file instead of a folder"
    );
}
