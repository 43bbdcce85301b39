//! The TCP address: other pages and names, too many requests and connections, clients that are slow or silent.
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use serde_json::json;

use crate::daemon::common::{Daemon, TIME_LIMIT};
use crate::daemon::hostile::tcp_from;
use crate::daemon::wire::{exchange, request, status, tcp, unix};

/// Connections of one address, by docs/daemon.md.
const MAX_OF_ADDRESS: usize = 64;
/// Computations at the same time, by docs/daemon.md.
const MAX_COMPUTATIONS: usize = 2;

/// The status of a request over TCP with exactly these headers.
fn asked(daemon: &Daemon, method: &str, path: &str, headers: &[(&str, &str)]) -> Option<u16> {
    status(&exchange(
        tcp(daemon),
        &request(method, path, headers, b"{}"),
    ))
}

#[test]
fn refuses_requests_of_other_pages_and_under_other_names() {
    let daemon = Daemon::start();
    let own = daemon.address().to_string();
    let authorization = format!("Bearer {}", daemon.token());
    let page = format!("http://{own}");
    let host = ("Host", own.as_str());
    let token = ("Authorization", authorization.as_str());
    let read = |headers: &[(&str, &str)]| asked(&daemon, "GET", "/api/v1/state", headers);
    assert_eq!(read(&[host]), Some(200));
    assert_eq!(read(&[host, ("Origin", &page)]), Some(200));
    assert_eq!(read(&[]), Some(403), "no name");
    for name in [
        "evil.example.com",
        "evil.example.com:8020",
        "127.0.0.1.evil.com",
        "",
    ] {
        assert_eq!(read(&[("Host", name)]), Some(403), "{name}");
    }
    let origins = [
        "http://evil.example.com",
        "null",
        "https://127.0.0.1",
        "http://\u{e9}vil",
        "",
    ];
    for origin in origins {
        assert_eq!(read(&[host, ("Origin", origin)]), Some(403), "{origin}");
        // The token does not help a page of another host, and it may not stop the bench either.
        for path in ["/api/v1/lease", "/api/v1/stop"] {
            let post = asked(&daemon, "POST", path, &[host, token, ("Origin", origin)]);
            assert_eq!(post, Some(403), "{path} {origin}");
        }
    }
    let state = daemon.state();
    assert!(state["lease"].is_null(), "{state}");
}

#[test]
fn refuses_too_many_requests_and_never_a_stop() {
    let daemon = Daemon::start();
    let get = format!(
        "GET /api/v1/nothing HTTP/1.1\r\nHost: {}\r\n\r\n",
        daemon.address()
    );
    let stop = request("POST", "/api/v1/stop", &[("Host", daemon.address())], b"");
    // 500 requests per second, and 1000 at once: the limit is reached if the daemon answers more than some 600 per second.
    let mut flood = tcp(&daemon);
    let mut reader = flood.try_clone().expect("a connection");
    let bytes = get.repeat(20_000);
    let writer = std::thread::spawn(move || {
        let _ = flood.write_all(bytes.as_bytes());
        flood
    });
    let (mut answers, mut buffer) = (Vec::new(), vec![0; 1 << 16]);
    let refused = |answers: &[u8]| String::from_utf8_lossy(answers).contains("HTTP/1.1 429");
    while !refused(&answers) {
        let bytes = reader.read(&mut buffer).expect("answers");
        assert!(bytes > 0, "the limit was not reached");
        let kept = answers.len().saturating_sub(100);
        answers.drain(..kept);
        answers.extend_from_slice(&buffer[..bytes]);
    }
    assert_eq!(status(&exchange(tcp(&daemon), &stop)), Some(200));
    drop(reader);
    let _ = writer
        .join()
        .map(|flood| flood.shutdown(std::net::Shutdown::Both));
}

/// Whether the daemon has closed a connection on which a byte is sent every 200 ms.
fn is_closed_while_sending(mut stream: TcpStream, first: &[u8]) -> bool {
    stream.write_all(first).expect("a connection");
    let limited = stream.set_read_timeout(Some(Duration::from_millis(200)));
    limited.expect("a time limit");
    let (begun, mut buffer) = (Instant::now(), [0; 4096]);
    while begun.elapsed() < TIME_LIMIT {
        if stream.write_all(b"x").is_err() {
            return true;
        }
        match stream.read(&mut buffer) {
            Ok(0) => return true,
            Ok(_) => {} // an error object, before the end
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {}
            Err(_) => return true,
        }
    }
    false
}

#[test]
fn closes_connections_of_slow_and_silent_clients() {
    let daemon = Daemon::start();
    let address = daemon.address();
    let head =
        format!("POST /api/v1/stop HTTP/1.1\r\nHost: {address}\r\nContent-Length: 100000\r\n");
    let body = format!(
        "POST /api/v1/plan HTTP/1.1\r\nHost: {address}\r\nAuthorization: Bearer {}\r\nContent-Type: application/json\r\nContent-Length: 100000\r\n\r\n",
        daemon.token()
    );
    std::thread::scope(|scope| {
        let slow_head = scope.spawn(|| is_closed_while_sending(tcp(&daemon), head.as_bytes()));
        let slow_body = scope.spawn(|| is_closed_while_sending(tcp(&daemon), body.as_bytes()));
        let silent = scope.spawn(|| exchange(tcp(&daemon), b""));
        let kept_alive = scope.spawn(|| {
            let get = format!("GET /api/v1/nothing HTTP/1.1\r\nHost: {address}\r\n\r\n");
            exchange(tcp(&daemon), get.as_bytes())
        });
        assert!(
            slow_head.join().expect("a thread"),
            "a byte of the head at a time"
        );
        assert!(
            slow_body.join().expect("a thread"),
            "a byte of the body at a time"
        );
        silent.join().expect("a client that sends nothing");
        let kept_alive = kept_alive.join().expect("a client that sends nothing more");
        assert_eq!(status(&kept_alive), Some(404));
    });
    assert_eq!(daemon.state()["loop"]["state"], "disarmed");
}

#[test]
fn limits_connections_of_an_address_and_lets_others_stop() {
    let daemon = Daemon::start();
    let stop = request("POST", "/api/v1/stop", &[("Host", daemon.address())], b"");
    let idle: Vec<TcpStream> = (0..MAX_OF_ADDRESS + 8).map(|_| tcp(&daemon)).collect();
    // Connections are accepted in their order: the last ones have a short time for a stop and are closed.
    let (accepted, refused) = idle.split_at(MAX_OF_ADDRESS);
    for mut stream in refused {
        assert!(
            !matches!(stream.read(&mut [0]), Ok(1..)),
            "a connection too many"
        );
    }
    for mut stream in accepted.iter().take(3) {
        stream.write_all(&stop).expect("a connection");
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        assert_eq!(status(&answer), Some(200));
    }
    assert_eq!(status(&exchange(tcp_from(&daemon, 2), &stop)), Some(200));
    assert_eq!(status(&exchange(unix(&daemon), &stop)), Some(200));
    drop(idle);
    let get = request("GET", "/api/v1/state", &[("Host", daemon.address())], b"");
    let begun = Instant::now();
    while status(&exchange(tcp(&daemon), &get)) != Some(200) {
        assert!(
            begun.elapsed() < TIME_LIMIT,
            "closed connections leave their places"
        );
    }
}

#[test]
fn web_sockets_count_as_connections() {
    let daemon = Daemon::start();
    let upgrade = request(
        "GET",
        "/api/v1/live",
        &[
            ("Host", daemon.address()),
            ("Connection", "Upgrade"),
            ("Upgrade", "websocket"),
            ("Sec-WebSocket-Version", "13"),
            ("Sec-WebSocket-Key", "AAAAAAAAAAAAAAAAAAAAAA=="),
        ],
        b"",
    );
    let upgrade = String::from_utf8(upgrade)
        .expect("text")
        .replace("Connection: close\r\n", "");
    let mut open = Vec::new();
    for _ in 0..MAX_OF_ADDRESS {
        let mut stream = tcp(&daemon);
        stream.write_all(upgrade.as_bytes()).expect("a connection");
        let mut answer = [0; 12];
        stream.read_exact(&mut answer).expect("an answer");
        assert_eq!(&answer, b"HTTP/1.1 101");
        open.push(stream);
    }
    let get = request("GET", "/api/v1/state", &[("Host", daemon.address())], b"");
    assert_eq!(status(&exchange(tcp(&daemon), &get)), Some(503));
}

/// Processes that the daemon has started and that have not ended.
fn children(daemon: &Daemon) -> usize {
    let tasks = std::fs::read_dir(format!("/proc/{}/task", daemon.pid())).expect("a process");
    let children = tasks.flatten().map(|task| {
        let children = std::fs::read_to_string(task.path().join("children"));
        children.unwrap_or_default().split_whitespace().count()
    });
    children.sum()
}

#[test]
fn few_computations_run_at_the_same_time() {
    let daemon = Daemon::start();
    std::thread::scope(|scope| {
        let clients: Vec<_> = (0..8)
            .map(|_| scope.spawn(|| daemon.ask("GET", "/api/v1/model", "", None).status))
            .collect();
        while !clients.iter().all(|client| client.is_finished()) {
            let running = children(&daemon);
            assert!(running <= MAX_COMPUTATIONS, "{running} computations");
            std::thread::sleep(Duration::from_millis(5));
        }
        for client in clients {
            assert_eq!(client.join().expect("a thread"), 200);
        }
    });
}

#[test]
fn output_of_a_cancelled_command_ends() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    let args = ["--slow", "--duration", "60s", "--pace", "realtime"];
    let current = daemon.start_run(&lease, "control", &args);
    let cancelled = daemon.start_run(&lease, "control", &args);
    let path = format!("/api/v1/runs/{cancelled}/output");
    let get = request("GET", &path, &[("Host", "localhost")], b"");
    std::thread::scope(|scope| {
        let follower = scope.spawn(|| exchange(unix(&daemon), &get));
        let stop = format!("/api/v1/runs/{cancelled}/stop");
        assert_eq!(daemon.ask("POST", &stop, "", Some(json!({}))).status, 200);
        let followed = follower.join().expect("an answer that ends");
        assert!(followed.ends_with(b"0\r\n\r\n"), "the end of the chunks");
    });
    let again = exchange(unix(&daemon), &get);
    assert!(again.ends_with(b"0\r\n\r\n"), "also when asked afterwards");
    daemon.ask("POST", "/api/v1/stop", "", None);
    daemon.wait_for_end(current, &lease);
}

#[test]
fn stop_is_not_refused_for_its_body() {
    let daemon = Daemon::start();
    let host = ("Host", daemon.address());
    for (kind, body) in [
        ("application/json", &b"{\"how\":\"cut\"}"[..]),
        ("application/json", b"{\"how\":"),
        ("application/json", b""),
        ("text/plain", b"please"),
        ("", b"\xff\x00"),
        ("application/json", b"{\"how\":\"now\"}"),
    ] {
        let stop = request(
            "POST",
            "/api/v1/stop",
            &[host, ("Content-Type", kind)],
            body,
        );
        assert_eq!(
            status(&exchange(tcp(&daemon), &stop)),
            Some(200),
            "{kind} {body:?}"
        );
    }
    let lease = daemon.take_lease("anna");
    daemon.resume(&lease);
    let id = daemon.start_run(
        &lease,
        "control",
        &["--slow", "--duration", "60s", "--pace", "realtime"],
    );
    daemon.wait("running", &lease, |state| {
        state["run"]["phase"] == "running"
    });
    let stop = request("POST", "/api/v1/stop", &[host], b"not json");
    assert_eq!(status(&exchange(tcp(&daemon), &stop)), Some(200));
    assert_eq!(daemon.wait_for_end(id, &lease)["outcome"], "stopped");
}

#[test]
fn stop_ends_a_command_without_a_run() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    // A campaign is calculated in the process of the command and takes minutes.
    let id = daemon.start_run(&lease, "campaign", &["--simulate"]);
    daemon.wait("its turn", &lease, |state| {
        state["run"]["phase"] == "starting"
    });
    daemon.ask("POST", "/api/v1/stop", "", None);
    assert_eq!(daemon.wait_for_end(id, &lease)["outcome"], "stopped");
    // The entry ends when the connection of the process closes, a moment before the process.
    daemon.wait("the process has ended", "", |_| children(&daemon) == 0);
}

#[test]
fn streams_begin_at_once_and_refuse_what_is_no_web_socket() {
    let daemon = Daemon::start();
    let get = |path: &str| request("GET", path, &[("Host", daemon.address())], b"");
    let mut events = tcp(&daemon);
    events
        .write_all(&get("/api/v1/events"))
        .expect("a connection");
    let (mut read, mut buffer) = (Vec::new(), [0; 4096]);
    while !String::from_utf8_lossy(&read).contains("data: {") {
        let bytes = events.read(&mut buffer).expect("events");
        assert!(bytes > 0, "the stream does not end");
        read.extend_from_slice(&buffer[..bytes]);
    }
    assert_eq!(status(&read), Some(200));
    let refused = exchange(tcp(&daemon), &get("/api/v1/live"));
    assert_eq!(status(&refused), Some(400));
    let text = String::from_utf8_lossy(&refused);
    assert!(text.contains("\"error\""), "{text}");
}
