//! Requests as bytes, also malformed and incomplete ones.
use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::unix::net::UnixStream;

use crate::daemon::common::{Daemon, TIME_LIMIT};

/// A TCP connection that gives up after the time limit of the tests.
pub fn tcp(daemon: &Daemon) -> TcpStream {
    let stream = TcpStream::connect(daemon.address()).expect("the daemon listens");
    let limited = stream.set_read_timeout(Some(TIME_LIMIT));
    limited.expect("a time limit");
    stream
}

/// The same at the socket.
pub fn unix(daemon: &Daemon) -> UnixStream {
    let stream = UnixStream::connect(daemon.socket()).expect("the daemon listens");
    let limited = stream.set_read_timeout(Some(TIME_LIMIT));
    limited.expect("a time limit");
    stream
}

/// A request with `Connection: close`.
pub fn request(method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Vec<u8> {
    let mut head = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n");
    for (name, value) in headers {
        head += &format!("{name}: {value}\r\n");
    }
    head += &format!("Content-Length: {}\r\n\r\n", body.len());
    [head.as_bytes(), body].concat()
}

/// Sends bytes and reads until the daemon closes the connection. A daemon that refuses a request may close it before.
pub fn exchange(mut wire: impl Read + Write, bytes: &[u8]) -> Vec<u8> {
    let mut answer = Vec::new();
    let _ = wire.write_all(bytes);
    let _ = wire.read_to_end(&mut answer);
    answer
}

/// Sends bytes and closes the connection without waiting for an answer.
pub fn send_and_leave(mut wire: impl Read + Write, bytes: &[u8]) {
    let _ = wire.write_all(bytes);
}

/// Status of the first answer; `None` if the daemon closed the connection without one.
pub fn status(answer: &[u8]) -> Option<u16> {
    let line = answer.split(|byte| *byte == b'\r').next()?;
    let line = std::str::from_utf8(line).ok()?;
    line.split(' ').nth(1)?.parse().ok()
}
