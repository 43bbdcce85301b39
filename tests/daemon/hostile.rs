//! Clients without a token that try to keep out a stop, or to cost memory: they find limits, and the stop finds a place.
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::fs::symlink;
use std::time::{Duration, Instant};

use nix::sys::socket::{AddressFamily, SockFlag, SockType, SockaddrIn, bind, connect, socket};
use serde_json::json;

use crate::daemon::common::{Daemon, TIME_LIMIT, order};
use crate::daemon::wire::{exchange, request, status, tcp, unix};

/// Connections of one address, by docs/daemon.md.
const MAX_OF_ADDRESS: usize = 64;
/// Largest message of a viewer and of a command in bytes, by docs/daemon.md.
const VIEWER_BYTES: usize = 1 << 10;
const COMMAND_BYTES: usize = 16 << 20;

/// A connection from 127.0.0.`last`.
pub fn tcp_from(daemon: &Daemon, last: u8) -> TcpStream {
    let port = daemon.address().rsplit(':').next().expect("a port");
    let port = port.parse().expect("a port");
    let flags = SockFlag::empty();
    let tcp: OwnedFd =
        socket(AddressFamily::Inet, SockType::Stream, flags, None).expect("a socket");
    bind(tcp.as_raw_fd(), &SockaddrIn::new(127, 0, 0, last, 0)).expect("an address");
    connect(tcp.as_raw_fd(), &SockaddrIn::new(127, 0, 0, 1, port)).expect("the daemon listens");
    let stream = TcpStream::from(tcp);
    let limited = stream.set_read_timeout(Some(TIME_LIMIT));
    limited.expect("a time limit");
    stream
}

fn stop(daemon: &Daemon) -> Vec<u8> {
    request("POST", "/api/v1/stop", &[("Host", daemon.address())], b"")
}

/// Upgrades a connection to a WebSocket.
fn web_socket<S: Read + Write>(mut stream: S, host: &str, path: &str) -> S {
    let upgrade = format!(
        "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    );
    stream.write_all(upgrade.as_bytes()).expect("a connection");
    let mut answer = [0; 12];
    stream.read_exact(&mut answer).expect("an answer");
    assert_eq!(&answer, b"HTTP/1.1 101");
    stream
}

/// The head of a frame with a mask of zeros [RFC 6455, 5.2].
fn frame_head(first: u8, bytes: usize) -> Vec<u8> {
    let length = u64::try_from(bytes).expect("a length").to_be_bytes();
    [&[first, 0xff][..], &length, &[0; 4]].concat()
}

/// Whether the daemon closes a connection to which nothing more is sent.
fn is_closed(mut stream: impl Read) -> bool {
    let (begun, mut buffer) = (Instant::now(), vec![0; 1 << 16]);
    while begun.elapsed() < TIME_LIMIT {
        match stream.read(&mut buffer) {
            Ok(1..) => {} // samples
            Ok(0) => return true,
            Err(error) => return error.kind() != ErrorKind::WouldBlock,
        }
    }
    false
}

#[test]
fn stop_acts_although_its_body_is_incomplete() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    let head = format!(
        "POST /api/v1/stop HTTP/1.1\r\nHost: {}\r\nContent-Length: 20\r\n\r\n{{",
        daemon.address()
    );
    let args = ["--slow", "--duration", "60s", "--pace", "realtime"];
    for is_tcp in [true, false] {
        daemon.ask("POST", "/api/v1/resume", &lease, Some(json!({}))); // needed after a stop
        let id = daemon.start_run(&lease, "control", &args);
        daemon.wait("running", &lease, |state| {
            state["run"]["phase"] == "running"
        });
        let (mut by_tcp, mut by_unix) = (tcp(&daemon), unix(&daemon));
        let sent = if is_tcp {
            by_tcp.write_all(head.as_bytes())
        } else {
            by_unix.write_all(head.as_bytes())
        };
        sent.expect("a connection");
        // The loop lasts 60 s by itself.
        assert_eq!(daemon.wait_for_end(id, &lease)["outcome"], "stopped");
    }
}

#[test]
fn stop_finds_a_place_beside_idle_connections() {
    let daemon = Daemon::start();
    let idle: Vec<TcpStream> = (0..MAX_OF_ADDRESS).map(|_| tcp(&daemon)).collect();
    assert_eq!(status(&exchange(tcp(&daemon), &stop(&daemon))), Some(200));
    let get = request("GET", "/api/v1/state", &[("Host", daemon.address())], b"");
    let refused = exchange(tcp(&daemon), &get);
    assert_eq!(status(&refused), Some(503));
    let text = String::from_utf8_lossy(&refused).to_lowercase();
    assert!(
        text.contains("retry-after: ") && text.contains("too many connections"),
        "{text}"
    );
    drop(idle);
}

#[test]
fn stop_finds_a_place_beside_web_sockets_and_idle_connections_of_many_addresses() {
    let daemon = Daemon::start();
    let live = |last| web_socket(tcp_from(&daemon, last), daemon.address(), "/api/v1/live");
    let viewers: Vec<_> = (1..=4)
        .flat_map(|last| [last; MAX_OF_ADDRESS])
        .map(live)
        .collect();
    // They fill the places that are kept for stops, too.
    let idle: Vec<_> = (0..100).map(|n| tcp_from(&daemon, 1 + n % 5)).collect();
    for last in [1, 5, 6] {
        let stopped = exchange(tcp_from(&daemon, last), &stop(&daemon));
        assert_eq!(status(&stopped), Some(200), "127.0.0.{last}");
    }
    assert_eq!(status(&exchange(unix(&daemon), &stop(&daemon))), Some(200));
    drop((viewers, idle));
}

#[test]
fn stop_is_served_when_descriptors_are_short() {
    let daemon = Daemon::start_with_limit("ulimit -n 64", &[]);
    let idle: Vec<_> = (0..128).map(|n| tcp_from(&daemon, 1 + n % 8)).collect();
    for last in [1, 9] {
        let stopped = exchange(tcp_from(&daemon, last), &stop(&daemon));
        assert_eq!(status(&stopped), Some(200), "127.0.0.{last}");
    }
    let idle_unix: Vec<_> = (0..64).map(|_| unix(&daemon)).collect();
    assert_eq!(status(&exchange(unix(&daemon), &stop(&daemon))), Some(200));
    assert_eq!(status(&exchange(tcp(&daemon), &stop(&daemon))), Some(200));
    drop((idle, idle_unix));
}

#[test]
fn closes_viewers_that_send_more_than_their_limit() {
    let daemon = Daemon::start();
    let live = || web_socket(tcp(&daemon), daemon.address(), "/api/v1/live");
    let text = 0x01; // unfinished
    let mut large = live();
    large
        .write_all(&frame_head(text, VIEWER_BYTES + 1))
        .expect("a connection");
    assert!(is_closed(large), "one large fragment");
    let mut many = live();
    for n in 0..=VIEWER_BYTES / 64 {
        let first = if n == 0 { text } else { 0 };
        // The daemon may have closed the connection already.
        let _ = many.write_all(&[frame_head(first, 64), vec![b'z'; 64]].concat());
    }
    assert!(is_closed(many), "many small fragments");
    let mut allowed = live();
    let whole = [frame_head(0x81, VIEWER_BYTES), vec![b'z'; VIEWER_BYTES]].concat();
    allowed.write_all(&whole).expect("a connection");
    let mut samples = [0; 4096];
    for _ in 0..20 {
        assert!(allowed.read(&mut samples).expect("samples") > 0);
    }
}

#[test]
fn closes_commands_that_send_more_than_their_limit() {
    let daemon = Daemon::start();
    let mut session = web_socket(unix(&daemon), "localhost", "/api/v1/session");
    session
        .write_all(&frame_head(0x81, COMMAND_BYTES + 1))
        .expect("a connection");
    assert!(is_closed(session));
}

#[test]
fn body_of_a_stop_is_not_kept() {
    let daemon = Daemon::start();
    let host = ("Host", daemon.address());
    let long = request("POST", "/api/v1/stop", &[host], &vec![b' '; 1 << 20]);
    let answer = exchange(tcp(&daemon), &long);
    // The daemon may close the connection before it has read all.
    assert!(matches!(status(&answer), Some(200) | None), "{answer:?}");
    assert_eq!(status(&exchange(tcp(&daemon), &stop(&daemon))), Some(200));
}

#[test]
fn links_out_of_the_folder_and_hidden_files_are_not_served() {
    let daemon = Daemon::start();
    let outside = tempfile::tempdir().expect("a folder");
    let secret = outside.path().join("secret.csv");
    std::fs::write(&secret, "time_s,reference_m\n0,0\n").expect("a file");
    for name in ["link.csv", "link.mcap", "link.toml"] {
        symlink(&secret, daemon.recordings().join(name)).expect("a link");
    }
    let get = |path: &str| daemon.ask("GET", path, "", None).status;
    for path in [
        "/api/v1/recordings/link.csv",
        "/api/v1/recordings/link.mcap",
        "/api/v1/recordings/link.mcap/results",
        "/api/v1/report?files=link.mcap",
        "/api/v1/recordings/.bench-daemon.json",
    ] {
        assert_eq!(get(path), 404, "{path}");
    }
    let note = Some(json!({ "note": "x" }));
    let noted = daemon.ask("PUT", "/api/v1/recordings/link.mcap/note", "", note);
    assert_eq!(noted.status, 404);
    let listed = daemon.get("/api/v1/recordings");
    assert_eq!(listed["recordings"], json!([]));
    let plan = |args: &[&str]| {
        let body = order("control", args);
        daemon.ask("POST", "/api/v1/plan", "", Some(body))
    };
    for args in [
        &["--slow", "--reference", "link.csv"][..],
        &["--controller", "link.toml"],
        &["--set", "calibration.file=\"link.toml\""],
    ] {
        let refused = plan(args);
        let text = String::from_utf8_lossy(&refused.body).into_owned();
        assert_eq!(refused.status, 422, "{args:?} {text}");
        assert!(text.contains("outside the folder"), "{text}");
    }
    let checked = Some(json!({ "profile": "link.toml" }));
    let checked = daemon.ask("POST", "/api/v1/config/check", "", checked);
    assert_eq!(checked.status, 422);
}

/// A client that reads nothing loses its connection; the others do not wait for it.
#[test]
fn closes_clients_that_take_nothing() {
    let daemon = Daemon::start();
    let mut deaf = tcp(&daemon);
    let get = format!(
        "GET /api/v1/openapi.json HTTP/1.1\r\nHost: {}\r\n\r\n",
        daemon.address()
    );
    // More answers than the buffers of the system hold.
    deaf.write_all(get.repeat(400).as_bytes())
        .expect("a connection");
    let begun = Instant::now();
    while !is_reset(&deaf) {
        assert!(begun.elapsed() < TIME_LIMIT, "it is kept");
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// Whether the daemon has closed a connection, without reading from it.
fn is_reset(mut stream: &TcpStream) -> bool {
    stream.write_all(b" ").is_err()
}
