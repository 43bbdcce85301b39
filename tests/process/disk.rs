//! Full disks and folders that cannot be written to.
use std::path::Path;
use std::process::{Command, Output, Stdio};

use bench_recording::Recording;
use bench_rt::record::flag;

use crate::process::common::{
    AT_1_KHZ, NO_OVERRUN_LIMIT, Running, bench, recording_in, stderr, stdout, without_daemon,
};

/// The program with a limit of `blocks` for the size of a file, so that writing fails half-way.
fn command_with_file_limit(blocks: u32, arguments: &[&str], out: &Path) -> Command {
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
    let mut command = without_daemon("sh");
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
        assert_eq!(recover.status.code(), Some(3), "{}", stderr(&recover));
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
fn run_that_does_not_fit_on_the_disk_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let disk = nix::sys::statvfs::statvfs(folder.path()).expect("a disk");
    let free_bytes = disk.blocks_available() * disk.fragment_size();
    // 120 bytes in each of 5000 ticks of a second; twice the free space.
    let duration = (2 * free_bytes / (120 * 5000)).to_string();
    let arguments = ["control", "--slow", "--duration", &duration, "--out"];
    let output = bench(&arguments).arg(&out).output().expect("it runs");
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    for part in [
        "MB are free",
        "must leave 100 MB",
        "--out",
        "nothing was moved",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
    assert!(!out.exists(), "no folder is created");
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

#[test]
fn file_size_limit_stops_the_run_instead_of_killing_the_program() {
    // SIGXFSZ has its default action, which ends a process.
    let folder = tempfile::tempdir().expect("a temporary folder");
    let script = "ulimit -f 2048; exec \"$0\" \"$@\"";
    let output = without_daemon("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_bench"), "chirp", "--out"])
        .arg(folder.path())
        .output()
        .expect("a shell");
    let message = stderr(&output);
    assert_eq!(
        output.status.code(),
        Some(1),
        "{:?}: {message}",
        output.status
    );
    assert!(
        message.contains("File too large")
            && message.contains("the run was stopped with zero current"),
        "{message}"
    );
}

#[test]
fn runs_started_at_the_same_time_get_names_of_their_own() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = ["control", "--slow", "--duration", "1", "--out"];
    let start = |_| {
        let mut command = bench(&arguments);
        command.arg(folder.path()).stdout(Stdio::null());
        command.stderr(Stdio::piped()).spawn().expect("it starts")
    };
    let started: Vec<_> = (0..12).map(start).collect();
    for child in started {
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
    let entries = std::fs::read_dir(folder.path()).expect("the folder");
    let names = entries.map(|entry| entry.expect("an entry").path());
    let recordings = names.filter(|path| path.extension().is_some_and(|e| e == "mcap"));
    assert_eq!(recordings.count(), 12);
}

#[test]
fn recording_removed_during_a_run_is_reported_as_removed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let arguments = [
        &["control", "--slow", "--duration", "3"][..],
        &AT_1_KHZ,
        &NO_OVERRUN_LIMIT,
    ];
    let mut running = Running::start(&arguments.concat(), &out);
    running.until_slept(100);
    std::fs::remove_dir_all(&out).expect("the folder");
    running.until_ended();
    let output = running.end();
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(
        message.contains("the recording was removed during the run")
            && !message.contains("complete"),
        "{message}"
    );
}

#[test]
fn full_disk_leaves_no_incomplete_results() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (runs, results) = (folder.path().join("runs"), folder.path().join("results"));
    let arguments = [
        &["chirp", "--duration", "8", "--start", "5Hz"][..],
        &AT_1_KHZ[..4],
    ]
    .concat();
    let run = bench(&arguments).arg("--out").arg(&runs).output();
    let run = run.expect("it runs");
    assert_eq!(run.status.code(), Some(0), "{}", stderr(&run));
    let recording = recording_in(&runs);
    // Four blocks are 2 or 4 KiB; the response has some hundred lines of more than 50 bytes.
    let recording = recording.to_str().expect("text");
    let output = run_with_file_limit(4, &["identify", recording], &results);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("File too large"), "{message}");
    let left = std::fs::read_dir(&results).expect("the folder");
    let names: Vec<_> = left.map(|entry| entry.expect("an entry").path()).collect();
    assert!(names.is_empty(), "{names:?}");
}
