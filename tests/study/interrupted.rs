//! Ctrl-C, SIGTERM, SIGKILL, two processes with one file, a full disk.

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::study::figures::XY;
use crate::study::program::{Bench, waits_for_signals};

/// More draws than a test lets the program complete.
const LONG: &str = "--draws 3000000 --threads 2";
/// A test that waits longer than this has failed. It is not a requirement.
const TIME_LIMIT: Duration = Duration::from_secs(120);

/// The running program. It is killed if a test ends early.
struct Running(Option<Child>);

impl Running {
    fn child(&mut self) -> &mut Child {
        self.0.as_mut().expect("running")
    }

    fn signal(&mut self, number: i32) {
        // SAFETY: a child of ours that was not waited for yet, so its id is not reused.
        let result = unsafe { libc::kill(self.child().id() as libc::pid_t, number) };
        assert_eq!(result, 0, "{}", std::io::Error::last_os_error());
    }

    fn end(mut self) -> Output {
        let child = self.0.take().expect("running");
        child.wait_with_output().expect("a child of ours")
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(child) = self.0.as_mut() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn start(bench: &Bench, arguments: &str) -> Running {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bench"));
    command
        .current_dir(bench.path(""))
        .args(arguments.split_whitespace())
        .stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    Running(Some(command.spawn().expect("it starts")))
}

/// Waits until a state is reached, while the program runs.
fn until(running: &mut Running, what: &str, is_reached: impl Fn(&Child) -> bool) {
    let deadline = Instant::now() + TIME_LIMIT;
    let child = running.child();
    while !is_reached(child) {
        let ended = child.try_wait().expect("a child of ours");
        assert!(ended.is_none(), "{what}: the program ended early");
        assert!(Instant::now() < deadline, "not reached: {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Waits until the file contains its header and several blocks of about 1.1 kB.
fn until_written(running: &mut Running, file: &Path) {
    until(running, "some blocks are written", |_| {
        std::fs::metadata(file).is_ok_and(|file| file.len() >= 10_000)
    });
}

/// Number of draws in complete blocks, and number of damaged lines.
fn lines(text: &str) -> (u64, usize) {
    let blocks: Vec<Option<u64>> = text
        .split_inclusive('\n')
        .skip(1)
        .map(|line| {
            let block: serde_json::Value =
                serde_json::from_str(line.strip_suffix('\n')?.split_once(' ')?.1).ok()?;
            Some(block["cnmp_pairs"].as_array()?.len() as u64)
        })
        .collect();
    (
        blocks.iter().flatten().sum(),
        blocks.iter().filter(|block| block.is_none()).count(),
    )
}

#[test]
fn signals_leave_a_complete_file_and_report_how_to_continue() {
    for number in [libc::SIGINT, libc::SIGTERM] {
        let bench = Bench::new();
        let mut running = start(&bench, &format!("{XY} {LONG} --file a.study --json"));
        until_written(&mut running, &bench.path("a.study"));
        running.signal(number);
        let output = running.end();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(
            (output.status.code(), output.stdout.len()),
            (Some(1), 0),
            "{message}"
        );
        let (draws, damaged) = lines(&bench.read("a.study"));
        assert_eq!(damaged, 0, "{message}");
        assert!(
            message.contains(&format!("stopped after {draws} of 3000000 draws")) && draws >= 1000,
            "{message}"
        );
        assert!(
            message.contains("started again with the same arguments it continues from a.study"),
            "{message}"
        );
    }
    // Without a file the message states that nothing was stored.
    let bench = Bench::new();
    let mut running = start(&bench, &format!("{XY} {LONG} --csv draws.csv"));
    until(&mut running, "the program handles signals", |child| {
        waits_for_signals(child.id())
    });
    running.signal(libc::SIGINT);
    let output = running.end();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.code() == Some(1) && message.contains("nothing was stored"),
        "{message}"
    );
    assert_eq!(bench.files(), [""; 0]);
}

#[test]
fn continues_after_a_killed_process() {
    let bench = Bench::new();
    let arguments = format!("{XY} --draws 40000 --threads 2 --json");
    let mut running = start(&bench, &format!("{arguments} --file a.study"));
    until_written(&mut running, &bench.path("a.study"));
    running.signal(libc::SIGKILL);
    assert_eq!(running.end().status.code(), None);
    let (kept, damaged) = lines(&bench.read("a.study"));
    assert!(
        (1000..40_000).contains(&kept) && damaged <= 1,
        "{kept} {damaged}"
    );
    let answer = bench.run(&format!("{arguments} --file a.study"));
    assert!(
        answer
            .err
            .contains(&format!("{kept} of 40000 draws are done already")),
        "{}",
        answer.err
    );
    assert_eq!((answer.code, answer.out), (0, bench.run(&arguments).out));
}

#[test]
fn rejects_a_file_that_another_process_uses() {
    let bench = Bench::new();
    let mut running = start(&bench, &format!("{XY} {LONG} --file a.study"));
    until_written(&mut running, &bench.path("a.study"));
    for arguments in [
        format!("{XY} {LONG} --file a.study"),
        "model study --join a.study".into(),
    ] {
        let answer = bench.run(&arguments);
        assert!(
            answer.code == 1 && answer.err.contains("another `bench` is using it"),
            "{answer:?}"
        );
    }
    running.signal(libc::SIGKILL);
    running.end();
    assert!(
        bench
            .run("model study --join a.study")
            .err
            .contains("lacks")
    );
}

#[test]
fn reports_a_full_disk_and_keeps_completed_draws() {
    let bench = Bench::new();
    let arguments = format!("{XY} --draws 30000 --file a.study --json");
    // 32 blocks of 512 bytes (1024 in some shells): 16 or 32 kB of about 70 kB.
    let script = "trap '' XFSZ; ulimit -f 32; exec \"$0\" \"$@\"";
    let mut command = Command::new("sh");
    command
        .current_dir(bench.path(""))
        .args(["-c", script, env!("CARGO_BIN_EXE_bench")]);
    let output = command
        .args(arguments.split_whitespace())
        .output()
        .expect("a shell");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert!(
        stdout.contains("\"error\"") && !stdout.contains("draws_done"),
        "{stdout}"
    );
    for words in [
        "cannot write a.study",
        "File too large",
        "free some space and start the study again with the same arguments",
    ] {
        assert!(message.contains(words), "`{words}` is not in {message}");
    }
    assert!(!message.contains("panicked"), "{message}");
    let (kept, _) = lines(&bench.read("a.study"));
    assert!((1000..30_000).contains(&kept), "{kept}");
    let answer = bench.run(&arguments);
    assert!(
        answer
            .err
            .contains(&format!("{kept} of 30000 draws are done already")),
        "{}",
        answer.err
    );
    assert_eq!(
        (answer.code, answer.out),
        (0, bench.run(&format!("{XY} --draws 30000 --json")).out)
    );
    // A table on a full disk is a failure as well.
    let full = bench.run(&format!("{XY} --draws 1000 --csv /dev/full"));
    assert!(
        full.code == 1 && full.err.contains("cannot write /dev/full"),
        "{full:?}"
    );
}
