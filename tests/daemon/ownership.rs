//! One owner of each thing: the folder of the recordings, the socket, a recording in progress, the token.
use std::fs::Permissions;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::daemon::common::{Daemon, NO_OVERRUN_LIMIT, TIME_LIMIT, bench_in};

/// A closed loop in real time at a rate that a busy machine keeps.
const RUN: [&str; 9] = [
    "--slow",
    "--duration",
    "60s",
    "--pace",
    "realtime",
    "--set",
    "loop.rate_hz=1000",
    "--set",
    "chirp.stop_hz=200",
];

/// `bench serve` in a folder, with its output in pipes.
fn serve(folder: &Path, arguments: &[&str]) -> Child {
    let arguments = [&["serve"][..], arguments].concat();
    let mut command = bench_in(folder, &arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
        .env_remove("NOTIFY_SOCKET")
        .spawn()
        .expect("a process")
}

/// The output of a process that ends by itself.
fn ended(mut child: Child) -> Output {
    let begun = Instant::now();
    while child.try_wait().expect("a process").is_none() {
        if begun.elapsed() > TIME_LIMIT / 2 {
            child.kill().expect("a process");
            panic!("a daemon runs that should have been refused");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    child.wait_with_output().expect("a process")
}

/// The message of a daemon that does not start.
fn refusal(folder: &Path, arguments: &[&str]) -> String {
    let output = ended(serve(folder, arguments));
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{message}");
    message
}

/// Names in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let names = entries.map(|entry| entry.expect("a file").file_name());
    let mut names: Vec<String> = names
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn start_reason(daemon: &Daemon) -> String {
    let state = daemon.state();
    let reason = state["daemon"]["start_reason"].as_str();
    reason.expect("a reason").into()
}

/// Starts a closed loop and waits until ticks are recorded.
fn start_loop(daemon: &Daemon) {
    let lease = daemon.take_lease("anna");
    daemon.start_run(&lease, "control", &RUN);
    daemon.wait("ticks", &lease, |state| {
        state["run"]["progress"]["done"].as_u64() > Some(300)
    });
}

#[test]
fn second_daemon_on_a_folder_is_refused_and_leaves_the_recording_alone() {
    let daemon = Daemon::start();
    start_loop(&daemon);
    let before = names(daemon.path());
    let message = refusal(
        daemon.path(),
        &["--socket", "second.sock", "--out", "recordings"],
    );
    let pid = format!("process {}", daemon.pid());
    let socket = daemon.socket().display().to_string();
    for part in [&pid, &socket, "since 20", "--out"] {
        assert!(message.contains(part), "{part}: {message}");
    }
    assert_eq!(names(daemon.path()), before);
    assert!(
        names(&daemon.recordings())
            .iter()
            .all(|name| !name.contains("recovered"))
    );
    let folder = daemon.kill();
    let next = Daemon::start_in(folder);
    let reason = start_reason(&next);
    assert!(
        reason.contains("after a crash") && reason.contains("-recovered.mcap"),
        "{reason}"
    );
}

#[test]
fn second_daemon_on_a_socket_is_refused_also_without_the_file_of_the_socket() {
    let daemon = Daemon::start();
    let socket = daemon.socket().display().to_string();
    let second = ["--socket", &socket, "--out", "others"];
    for _ in 0..2 {
        let message = refusal(daemon.path(), &second);
        assert!(
            message.contains(&format!("process {}", daemon.pid())),
            "{message}"
        );
        assert!(message.contains("--socket"), "{message}");
        let _ = std::fs::remove_file(&socket); // for the second round
    }
    assert!(!daemon.path().join("others").exists(), "nothing is left");
}

#[test]
fn clean_end_removes_only_what_the_daemon_made() {
    let first = Daemon::start();
    let folder = first.path().to_path_buf();
    for name in ["bench.sock", "bench.sock.lock", "bench.token"] {
        std::fs::remove_file(folder.join(name)).expect("a file of the daemon");
    }
    let socket = first.socket().display().to_string();
    let arguments = [
        "--socket",
        &socket,
        "--out",
        "others",
        "--listen",
        "127.0.0.1:0",
    ];
    let mut second = serve(&folder, &arguments);
    wait_for(&folder.join("bench.token"));
    wait_for(&folder.join("bench.sock"));
    let token = std::fs::read_to_string(folder.join("bench.token")).expect("a token");
    let (_, kept) = first.terminate();
    assert!(std::os::unix::net::UnixStream::connect(&socket).is_ok());
    let left = std::fs::read_to_string(folder.join("bench.token"));
    assert_eq!(left.expect("the token of the second"), token);
    second.kill().expect("a process");
    let _ = second.wait();
    drop(kept);
}

fn wait_for(path: &Path) {
    let begun = Instant::now();
    while !path.exists() {
        assert!(begun.elapsed() < TIME_LIMIT, "{}", path.display());
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn failed_start_leaves_nothing_and_does_not_hide_a_crash() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("an address").to_string();
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = [
        "--socket",
        "bench.sock",
        "--listen",
        &address,
        "--out",
        "recordings",
    ];
    let message = refusal(folder.path(), &arguments);
    assert!(message.contains("--listen"), "{message}");
    assert_eq!(names(folder.path()), ["recordings"]);
    assert!(names(&folder.path().join("recordings")).is_empty());

    let folder = Daemon::start_in(folder).kill();
    refusal(folder.path(), &arguments);
    let next = Daemon::start_in(folder);
    assert!(start_reason(&next).contains("after a crash"));
}

#[test]
fn recording_of_another_process_is_not_recovered() {
    let folder = Daemon::start().kill();
    let arguments = [
        &["control", "--connect", "none", "--no-report"][..],
        &RUN,
        &NO_OVERRUN_LIMIT,
    ]
    .concat();
    let mut command = bench_in(folder.path(), &arguments);
    let mut run = command
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("a process");
    let recording = recording_in_progress(&folder.path().join("recordings"));
    let daemon = Daemon::start_in(folder);
    let reason = start_reason(&daemon);
    assert!(
        reason.contains("after a crash") && reason.contains("no recording was cut off"),
        "{reason}"
    );
    let name = recording.display().to_string();
    let by_hand = bench_in(daemon.path(), &["recover", &name]).output();
    let by_hand = by_hand.expect("a process");
    let message = String::from_utf8_lossy(&by_hand.stderr);
    assert_eq!(by_hand.status.code(), Some(1), "{message}");
    assert!(message.contains("still being written"), "{message}");

    run.kill().expect("a process");
    let _ = run.wait();
    let by_hand = bench_in(daemon.path(), &["recover", &name]).output();
    assert_eq!(by_hand.expect("a process").status.code(), Some(3));
}

/// The first recording of a folder, when it has data.
fn recording_in_progress(folder: &Path) -> PathBuf {
    let begun = Instant::now();
    loop {
        let name = names(folder)
            .into_iter()
            .find(|name| name.ends_with(".mcap"));
        let path = name.map(|name| folder.join(name));
        if let Some(path) =
            path.filter(|path| std::fs::metadata(path).is_ok_and(|m| m.len() > 9000))
        {
            return path;
        }
        assert!(begun.elapsed() < TIME_LIMIT, "no recording");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn token_is_private_and_is_not_printed_into_a_pipe() {
    let folder = tempfile::tempdir().expect("a folder");
    let target = folder.path().join("target");
    std::fs::write(&target, "content").expect("a file");
    // Left by others: nothing is written through them.
    for name in ["bench.token", "bench.token.partial"] {
        std::os::unix::fs::symlink(&target, folder.path().join(name)).expect("a link");
    }
    let arguments = ["--socket", "bench.sock", "--listen", "127.0.0.1:0"];
    let mut daemon = serve(folder.path(), &arguments);
    let file = folder.path().join("bench.token");
    let begun = Instant::now();
    while file.is_symlink() || !file.exists() {
        assert!(begun.elapsed() < TIME_LIMIT, "no token");
        std::thread::sleep(Duration::from_millis(20));
    }
    let token = std::fs::read_to_string(&file).expect("a token");
    assert_eq!(
        std::fs::metadata(&file).expect("a file").mode() & 0o777,
        0o600
    );
    assert_eq!(std::fs::read_to_string(&target).expect("a file"), "content");
    wait_for(&folder.path().join("bench.sock"));
    crate::daemon::common::signal(&daemon, nix::sys::signal::Signal::SIGTERM);
    let output = ended_output(&mut daemon);
    assert!(output.contains("http://127.0.0.1:"), "{output}");
    assert!(!output.contains(&token), "{output}");
}

/// Everything that a process prints until it ends.
fn ended_output(child: &mut Child) -> String {
    use std::io::Read;
    let (mut stdout, mut stderr) = (String::new(), String::new());
    let pipe = child.stdout.as_mut().expect("a pipe");
    pipe.read_to_string(&mut stdout).expect("text");
    let pipe = child.stderr.as_mut().expect("a pipe");
    pipe.read_to_string(&mut stderr).expect("text");
    let _ = child.wait();
    stdout + &stderr
}

#[test]
fn refuses_a_folder_of_the_socket_that_others_may_change() {
    let parent = tempfile::tempdir().expect("a folder");
    let folder = parent.path().join("open");
    std::fs::create_dir(&folder).expect("a folder");
    std::fs::set_permissions(&folder, Permissions::from_mode(0o777)).expect("permissions");
    let message = refusal(parent.path(), &["--socket", "open/bench.sock"]);
    assert!(message.contains("chmod go-w open"), "{message}");
    std::os::unix::fs::symlink(parent.path(), parent.path().join("link")).expect("a link");
    let message = refusal(parent.path(), &["--socket", "link/bench.sock"]);
    assert!(message.contains("symbolic link"), "{message}");
    assert!(names(&folder).is_empty());
}

/// A folder for temporary files in which the default folder of the socket belongs to another user. Only root can make it.
fn folder_of_another_user() -> Option<tempfile::TempDir> {
    let folder = tempfile::tempdir().expect("a folder");
    let user = nix::unistd::getuid();
    let taken = folder.path().join(format!("bench-{user}"));
    std::fs::create_dir(&taken).expect("a folder");
    let given = nix::unistd::chown(&taken, Some(65534.into()), Some(65534.into()));
    given.ok().map(|()| folder)
}

#[test]
fn default_folder_of_another_user_is_used_neither_for_a_daemon_nor_for_a_command() {
    let Some(folder) = folder_of_another_user() else {
        return println!("skipped: only root can give a folder away");
    };
    let user = nix::unistd::getuid();
    let taken = folder.path().join(format!("bench-{user}"));
    let at_default = |arguments: &[&str]| -> Command {
        let mut command = bench_in(folder.path(), arguments);
        command
            .env_remove("BENCH_SOCKET")
            .env_remove("XDG_RUNTIME_DIR")
            .env("TMPDIR", folder.path());
        command
    };
    let mut daemon = at_default(&["serve", "--listen", "127.0.0.1:0"]);
    daemon.stdout(Stdio::piped()).stderr(Stdio::piped());
    let output = ended(daemon.spawn().expect("a process"));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("the user 65534"), "{message}");
    assert!(names(&taken).is_empty());

    // A program of that user pretends to be the daemon.
    let impostor = std::os::unix::net::UnixListener::bind(taken.join("bench.sock"));
    let impostor = impostor.expect("a socket");
    impostor.set_nonblocking(true).expect("a socket");
    let run = at_default(&["control", "--slow", "--duration", "1s", "--no-report"]).output();
    let run = run.expect("a process");
    let message = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(0), "{message}");
    assert!(message.contains("the user 65534"), "{message}");
    let connected = impostor.accept().map(drop).map_err(|error| error.kind());
    assert_eq!(connected, Err(std::io::ErrorKind::WouldBlock));
}

#[test]
fn token_on_the_command_line_is_refused_and_a_file_is_accepted() {
    let daemon = Daemon::start();
    let here = tempfile::tempdir().expect("a folder");
    let run = |connect: &[&str]| {
        let arguments = ["control", "--slow", "--duration", "1s"];
        let arguments = [&arguments[..], connect].concat();
        bench_in(here.path(), &arguments)
            .output()
            .expect("a process")
    };
    let url = format!("{}#token={}", daemon.url(), daemon.token());
    let refused = run(&["--connect", &url]);
    let message = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{message}");
    assert!(message.contains("--token-file"), "{message}");
    assert!(!message.contains(daemon.token()), "{message}");

    let file = daemon.path().join("bench.token").display().to_string();
    let accepted = run(&["--connect", &daemon.url(), "--token-file", &file]);
    let message = String::from_utf8_lossy(&accepted.stderr);
    assert_eq!(accepted.status.code(), Some(0), "{message}");
}

/// A bench of devices that do not exist, with names of their own.
fn devices() -> [String; 2] {
    let pid = std::process::id();
    [
        format!("amplifier.device.interface=\"t{pid}\""),
        format!("probe.device.line.port=\"/dev/ttyNONE{pid}\""),
    ]
}

#[test]
fn devices_of_a_daemon_are_refused_to_others_also_while_they_are_closed() {
    let folder = tempfile::tempdir().expect("a folder");
    let [interface, port] = devices();
    let bench = ["--config", "lab", "--set", &interface, "--set", &port];
    let first = [
        &["--socket", "first.sock", "--out", "first"][..],
        &bench,
        &NO_OVERRUN_LIMIT,
    ]
    .concat();
    let mut daemon = serve(folder.path(), &first);
    wait_for(&folder.path().join("first.sock"));
    let second = [&["--socket", "second.sock", "--out", "second"][..], &bench].concat();
    let chirp = ["chirp", "--motor-cold", "--connect", "none"];
    let alone = bench_in(folder.path(), &[&chirp[..], &bench].concat()).output();
    let alone = alone.expect("a process");
    let alone = String::from_utf8_lossy(&alone.stderr);
    for message in [&refusal(folder.path(), &second), alone.as_ref()] {
        for part in [
            &format!("process {}", daemon.id()),
            "first.sock",
            "end that process",
        ] {
            assert!(message.contains(part), "{part}: {message}");
        }
    }
    assert!(!folder.path().join("second").exists());
    daemon.kill().expect("a process");
    let _ = daemon.wait();
    let mut next = serve(folder.path(), &second);
    wait_for(&folder.path().join("second.sock"));
    next.kill().expect("a process");
    let _ = next.wait();
}
