//! The user of a command is the one that the kernel knows, whatever the command states.
use std::io::{Read, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;

use nix::sys::socket::{MsgFlags, recv};
use serde_json::Value;
use tokio_tungstenite::tungstenite::{Message, WebSocket, accept, client};

use crate::daemon::common::{Daemon, TIME_LIMIT, bench_in};

/// What `bench control` sends to its daemon: the message that asks for a turn, and the order of the run.
struct Sent {
    open: Value,
    run: Value,
}

/// Takes the place of a daemon and records what a command sends.
fn recorded(folder: &Path) -> Sent {
    let socket = folder.join("fake.sock");
    let listener = UnixListener::bind(&socket).expect("a socket");
    let arguments = ["control", "--slow", "--duration", "1s", "--no-report"];
    let mut command = bench_in(folder, &arguments);
    let mut child = command
        .env("BENCH_SOCKET", &socket)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("a process");
    let sent = loop {
        let (stream, _) = listener.accept().expect("a connection");
        if let Some(sent) = answer(stream) {
            break sent;
        }
    };
    let _ = child.wait();
    sent
}

/// Answers one connection; what the command sends on the connection of its session.
fn answer(mut stream: UnixStream) -> Option<Sent> {
    let mut head = [0; 64];
    let bytes = recv(stream.as_raw_fd(), &mut head, MsgFlags::MSG_PEEK).expect("a request");
    let head = String::from_utf8_lossy(&head[..bytes]).into_owned();
    if head.contains("/session") {
        return Some(session(stream));
    }
    if bytes > 0 {
        let _ = stream.read(&mut [0; 4096]).expect("a request");
        let body = r#"{"daemon":{"rig":"simulated"}}"#;
        let length = body.len();
        let answer = format!(
            "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}"
        );
        stream.write_all(answer.as_bytes()).expect("an answer");
    }
    None
}

fn session(stream: UnixStream) -> Sent {
    let mut socket = accept(stream).expect("a WebSocket");
    let open = received(&mut socket).expect("a message");
    let granted = Message::text("\"granted\"");
    socket.send(granted).expect("a connection");
    // Before its order the command only says that it is alive.
    let run = loop {
        let message = received(&mut socket).expect("an order");
        if message.get("run").is_some() {
            break message;
        }
    };
    Sent { open, run }
}

/// The next message; `None` at the end of the connection.
fn received<S: Read + Write>(socket: &mut WebSocket<S>) -> Option<Value> {
    loop {
        match socket.read().ok()? {
            Message::Text(text) => return serde_json::from_str(&text).ok(),
            Message::Close(_) => return None,
            _ => {}
        }
    }
}

fn send(socket: &mut WebSocket<UnixStream>, message: &Value) {
    // The daemon may have closed the connection.
    let _ = socket.send(Message::text(message.to_string()));
}

/// Sends an order and returns the last answer: `refused` or `ended`.
fn order(stream: UnixStream, open: &Value, run: &Value) -> Value {
    let limited = stream.set_read_timeout(Some(TIME_LIMIT));
    limited.expect("a time limit");
    let request = "ws://localhost/api/v1/session";
    let (mut socket, _) = client(request, stream).expect("a WebSocket");
    send(&mut socket, open);
    let mut is_ordered = false;
    while let Some(message) = received(&mut socket) {
        if message == "granted" && !is_ordered {
            send(&mut socket, run);
            is_ordered = true;
        }
        if message.get("refused").is_some() || message.get("ended").is_some() {
            return message;
        }
    }
    Value::Null
}

/// A connection of another user: the credentials of the thread that connects are those that the kernel passes on.
fn connected_as(uid: u32, socket: &Path) -> UnixStream {
    std::thread::scope(|scope| {
        let thread = scope.spawn(|| {
            set_user_of_thread(uid);
            UnixStream::connect(socket).expect("the daemon listens")
        });
        thread.join().expect("a thread")
    })
}

/// The function of the C library would change all threads of the process.
#[allow(unsafe_code)]
fn set_user_of_thread(uid: u32) {
    // SAFETY: the call has no pointers; the thread ends soon.
    let result = unsafe { libc::syscall(libc::SYS_setresuid, uid, uid, uid) };
    assert_eq!(result, 0, "only root may become another user");
}

/// The order with another folder.
fn with_folder(run: &Value, folder: &Path) -> Value {
    let mut run = run.clone();
    run["run"]["conditions"]["folder"] = folder.display().to_string().into();
    run
}

#[test]
fn command_that_states_a_user_is_refused() {
    let daemon = Daemon::start();
    let here = tempfile::tempdir().expect("a folder");
    let mut sent = recorded(here.path());
    assert!(sent.open["open"].get("user").is_none());
    sent.open["open"]["user"] = nix::unistd::getuid().as_raw().into();
    let folder = here.path().join("claimed");
    let run = with_folder(&sent.run, &folder);
    let stream = UnixStream::connect(daemon.socket()).expect("the daemon listens");
    let answer = order(stream, &sent.open, &run);
    assert!(answer["refused"].is_object(), "{answer}");
    assert!(!folder.exists());
}

#[test]
fn daemon_writes_only_for_its_own_user_into_the_folder_of_a_command() {
    let daemon = Daemon::start();
    let here = tempfile::tempdir().expect("a folder");
    let sent = recorded(here.path());
    let own = here.path().join("own");
    let stream = UnixStream::connect(daemon.socket()).expect("the daemon listens");
    let answer = order(stream, &sent.open, &with_folder(&sent.run, &own));
    assert!(answer["ended"].is_object(), "{answer}");
    assert!(own.exists(), "the folder of the same user");
    if !nix::unistd::getuid().is_root() {
        return println!("skipped: only root can connect as another user");
    }
    for path in [daemon.path(), &daemon.socket()] {
        let open = std::fs::Permissions::from_mode(0o777);
        std::fs::set_permissions(path, open).expect("permissions");
    }
    let other = here.path().join("other");
    let stream = connected_as(65534, &daemon.socket());
    let mut open = sent.open.clone();
    open["open"]["user"] = 0.into();
    let answer = order(stream, &open, &with_folder(&sent.run, &other));
    assert!(answer["refused"].is_object(), "{answer}");

    let stream = connected_as(65534, &daemon.socket());
    let answer = order(stream, &sent.open, &with_folder(&sent.run, &other));
    let path = answer["ended"].to_string();
    assert!(path.contains("recordings/"), "{answer}");
    assert!(!other.exists(), "the folder of another user");
}

#[test]
fn ticket_is_valid_for_the_user_of_the_daemon_only() {
    if !nix::unistd::getuid().is_root() {
        return println!("skipped: only root can connect as another user");
    }
    let daemon = Daemon::start();
    let here = tempfile::tempdir().expect("a folder");
    let mut sent = recorded(here.path());
    let lease = daemon.take_lease("anna");
    // A campaign is calculated in the process of the command and takes minutes: its ticket stays valid.
    let id = daemon.start_run(&lease, "campaign", &["--simulate"]);
    let ticket = ticket_of_child(&daemon);
    sent.open["open"]["ticket"] = ticket.into();
    for path in [daemon.path(), &daemon.socket()] {
        let open = std::fs::Permissions::from_mode(0o777);
        std::fs::set_permissions(path, open).expect("permissions");
    }
    let stream = connected_as(65534, &daemon.socket());
    let answer = order(stream, &sent.open, &sent.run);
    let text = answer["refused"].to_string();
    assert!(text.contains("ticket"), "{answer}");
    daemon.ask("POST", "/api/v1/stop", "", None);
    daemon.wait_for_end(id, &lease);
}

/// The ticket in the environment of the process that the daemon has started.
fn ticket_of_child(daemon: &Daemon) -> String {
    let begun = std::time::Instant::now();
    loop {
        let tasks = std::fs::read_dir(format!("/proc/{}/task", daemon.pid())).expect("a process");
        for task in tasks.flatten() {
            let children = std::fs::read_to_string(task.path().join("children"));
            for child in children.unwrap_or_default().split_whitespace() {
                let environment = std::fs::read(format!("/proc/{child}/environ"));
                let environment = environment.unwrap_or_default();
                let text = String::from_utf8_lossy(&environment).into_owned();
                let mut variables = text.split('\0');
                if let Some(ticket) = variables.find_map(|text| text.strip_prefix("BENCH_TICKET="))
                {
                    return ticket.into();
                }
            }
        }
        assert!(begun.elapsed() < TIME_LIMIT, "no process");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
}
