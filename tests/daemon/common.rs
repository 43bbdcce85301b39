//! A daemon in a process of its own, and a minimal client for HTTP/1.1.
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use bench_test_support::program::until_frozen;
use nix::sys::signal::Signal;
use serde_json::{Value, json};
use tempfile::TempDir;

/// A test that waits longer than this has failed. It is not a requirement.
pub const TIME_LIMIT: Duration = Duration::from_secs(120);
/// No effective limit of missed ticks: timing is not tested.
pub const NO_OVERRUN_LIMIT: [&str; 2] = ["--set", "interlock.overruns_per_s=1000000"];

/// A daemon on the simulated stage.
pub struct Daemon {
    child: Child,
    folder: TempDir,
    address: String,
    token: String,
}

/// Status and body of an answer.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&self.body)))
    }
}

impl Daemon {
    pub fn start() -> Daemon {
        Daemon::start_in(tempfile::tempdir().expect("a folder"))
    }

    /// A daemon in a folder that may have recordings.
    pub fn start_in(folder: TempDir) -> Daemon {
        let program = Command::new(env!("CARGO_BIN_EXE_bench"));
        Daemon::start_as(program, &[], folder)
    }

    /// A daemon whose files cannot become larger than `limit_kb`: writing to a larger one fails, as on a full disk.
    pub fn start_with_file_limit(limit_kb: u64, settings: &[&str]) -> Daemon {
        // Blocks of 512 bytes.
        Daemon::start_with_limit(&format!("ulimit -f {}", limit_kb * 2), settings)
    }

    /// A daemon with a limit that the shell sets.
    pub fn start_with_limit(limit: &str, settings: &[&str]) -> Daemon {
        let mut program = Command::new("sh");
        let limited = format!("{limit}; exec \"$0\" \"$@\"");
        program.args(["-c", &limited, env!("CARGO_BIN_EXE_bench")]);
        Daemon::start_as(program, settings, tempfile::tempdir().expect("a folder"))
    }

    fn start_as(mut program: Command, settings: &[&str], folder: TempDir) -> Daemon {
        let mut child = program
            .args(["serve", "--listen", "127.0.0.1:0", "--out", "recordings"])
            .args(settings)
            .args(["--set", "loop.rate_hz=1000", "--set", "chirp.stop_hz=200"])
            .args(NO_OVERRUN_LIMIT)
            .current_dir(folder.path())
            .env("BENCH_SOCKET", folder.path().join("bench.sock"))
            .env_remove("NOTIFY_SOCKET")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("a process");
        let address = address(&mut child);
        let token = std::fs::read_to_string(folder.path().join("bench.token"));
        let token = token.expect("a token");
        Daemon {
            child,
            folder,
            address,
            token,
        }
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    pub fn socket(&self) -> PathBuf {
        self.path().join("bench.sock")
    }

    pub fn recordings(&self) -> PathBuf {
        self.path().join("recordings")
    }

    pub fn address(&self) -> &str {
        &self.address
    }

    pub fn token(&self) -> &str {
        &self.token
    }

    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// `bench` with this daemon as that of the machine.
    pub fn bench(&self, folder: &Path, arguments: &[&str]) -> Command {
        let mut command = bench_in(folder, arguments);
        command.env("BENCH_SOCKET", self.socket());
        command
    }

    /// A request over TCP with the token.
    pub fn ask(&self, method: &str, path: &str, lease: &str, body: Option<Value>) -> Answer {
        let body = body.map_or(String::new(), |body| body.to_string());
        let token = format!("Bearer {}", self.token);
        let headers = [("Authorization", token.as_str()), ("Bench-Lease", lease)];
        self.raw(method, path, &headers, body.as_bytes())
    }

    /// A request over TCP with these headers only.
    pub fn raw(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Answer {
        let stream = TcpStream::connect(&self.address).expect("the daemon listens");
        exchange(stream, &self.address, method, path, headers, body)
    }

    pub fn get(&self, path: &str) -> Value {
        let stream = UnixStream::connect(self.socket()).expect("the daemon listens");
        let answer = exchange(stream, "localhost", "GET", path, &[], b"");
        assert_eq!(answer.status, 200, "{path}: {answer:?}");
        answer.json()
    }

    pub fn state(&self) -> Value {
        self.get("/api/v1/state")
    }

    pub fn take_lease(&self, operator: &str) -> String {
        let answer = self.ask(
            "POST",
            "/api/v1/lease",
            "",
            Some(json!({ "operator": operator })),
        );
        assert_eq!(answer.status, 201, "{answer:?}");
        answer.json()["lease"]
            .as_str()
            .expect("a lease")
            .to_string()
    }

    pub fn start_run(&self, lease: &str, command: &str, args: &[&str]) -> u64 {
        let body = order(command, args);
        let answer = self.ask("POST", "/api/v1/runs", lease, Some(body));
        assert_eq!(
            answer.status,
            202,
            "{}",
            String::from_utf8_lossy(&answer.body)
        );
        answer.json()["id"].as_u64().expect("a number")
    }

    pub fn run(&self, id: u64) -> Value {
        self.get(&format!("/api/v1/runs/{id}"))
    }

    /// Releases the bench after a stop or a trip.
    pub fn resume(&self, lease: &str) {
        let answer = self.ask("POST", "/api/v1/resume", lease, None);
        assert_eq!(answer.status, 204, "{answer:?}");
    }

    /// Waits until the state of the daemon fulfils a condition; `renew` keeps a lease meanwhile.
    pub fn wait(&self, what: &str, renew: &str, is_reached: impl Fn(&Value) -> bool) -> Value {
        let begun = Instant::now();
        loop {
            let state = self.state();
            if is_reached(&state) {
                return state;
            }
            assert!(begun.elapsed() < TIME_LIMIT, "{what}: {state}");
            if !renew.is_empty() {
                let _ = self.ask("PUT", "/api/v1/lease", renew, None);
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    pub fn wait_for_end(&self, id: u64, lease: &str) -> Value {
        let begun = Instant::now();
        loop {
            let run = self.run(id);
            // After a stop the process may complete its results after its turn.
            if run["phase"] == "finished" && run["has_process"] == false {
                return run;
            }
            assert!(begun.elapsed() < TIME_LIMIT, "{run}");
            if !lease.is_empty() {
                let _ = self.ask("PUT", "/api/v1/lease", lease, None);
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Sends SIGTERM; returns the output after the end.
    pub fn terminate(mut self) -> (Output, TempDir) {
        signal(&self.child, nix::sys::signal::Signal::SIGTERM);
        let folder = std::mem::replace(&mut self.folder, tempfile::tempdir().expect("a folder"));
        let begun = Instant::now();
        while self.child.try_wait().expect("a process").is_none() {
            assert!(begun.elapsed() < TIME_LIMIT, "the daemon does not end");
            std::thread::sleep(Duration::from_millis(10));
        }
        (self.output(), folder)
    }

    /// Kills the daemon without any chance to clean up; returns its folder.
    pub fn kill(mut self) -> TempDir {
        self.child.kill().expect("a process");
        let _ = self.child.wait();
        std::mem::replace(&mut self.folder, tempfile::tempdir().expect("a folder"))
    }

    fn output(&mut self) -> Output {
        let mut stderr = Vec::new();
        if let Some(mut pipe) = self.child.stderr.take() {
            let _ = pipe.read_to_end(&mut stderr);
        }
        Output {
            status: self.child.wait().expect("a process"),
            stdout: Vec::new(),
            stderr,
        }
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub fn signal(child: &Child, signal: Signal) {
    let pid = nix::unistd::Pid::from_raw(i32::try_from(child.id()).expect("a process number"));
    nix::sys::signal::kill(pid, signal).expect("the process runs");
}

/// Stops every thread of a process until [`thaw`]. A process that has ended stays so.
pub fn freeze(child: &Child) {
    signal(child, Signal::SIGSTOP);
    until_frozen(child.id());
}

pub fn thaw(child: &Child) {
    signal(child, Signal::SIGCONT);
}

/// `bench` without a daemon.
pub fn bench_in(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bench"));
    command
        .args(arguments)
        .current_dir(folder)
        .env("BENCH_SOCKET", "/nonexistent/bench.sock")
        .env("USER", "tester")
        .env_remove("BENCH_LOG")
        .stdin(Stdio::null());
    command
}

/// The address that the daemon prints.
fn address(child: &mut Child) -> String {
    let stdout = child.stdout.as_mut().expect("a pipe");
    let mut lines = BufReader::new(stdout).lines();
    let page = lines.find_map(|line| {
        let line = line.expect("text");
        line.split("http://").nth(1).map(String::from)
    });
    let page = page.expect("the daemon prints the address of its page");
    page.split('/').next().unwrap_or_default().trim().into()
}

/// One request on a connection of its own.
fn exchange(
    mut stream: impl Read + Write,
    host: &str,
    method: &str,
    path: &str,
    headers: &[(&str, &str)],
    body: &[u8],
) -> Answer {
    let mut head = format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n");
    for (name, value) in headers {
        head += &format!("{name}: {value}\r\n");
    }
    head += &format!(
        "Content-Type: application/json\r\nContent-Length: {}\r\n\r\n",
        body.len()
    );
    // A daemon that refuses a large body may close the connection before it has read all of it.
    let _ = stream
        .write_all(head.as_bytes())
        .and_then(|()| stream.write_all(body));
    let mut bytes = Vec::new();
    let _ = stream.read_to_end(&mut bytes);
    answer(&bytes)
}

fn answer(bytes: &[u8]) -> Answer {
    let text = String::from_utf8_lossy(bytes);
    let status = text.split(' ').nth(1).and_then(|word| word.parse().ok());
    let head = bytes.windows(4).position(|window| window == b"\r\n\r\n");
    let head = head.unwrap_or_else(|| panic!("not an answer: {text}"));
    let body = &bytes[head + 4..];
    let is_chunked = text[..head]
        .to_ascii_lowercase()
        .contains("transfer-encoding: chunked");
    Answer {
        status: status.expect("a status"),
        body: if is_chunked {
            dechunked(body)
        } else {
            body.to_vec()
        },
    }
}

/// The data of chunks [RFC 9112, 7.1].
fn dechunked(mut body: &[u8]) -> Vec<u8> {
    let mut data = Vec::new();
    while let Some(end) = body.windows(2).position(|window| window == b"\r\n") {
        let size = std::str::from_utf8(&body[..end]).expect("a size");
        let size = usize::from_str_radix(size, 16).expect("a size");
        if size == 0 {
            break;
        }
        data.extend_from_slice(&body[end + 2..end + 2 + size]);
        body = &body[end + 2 + size + 2..];
    }
    data
}

/// The order of a command with options as on the command line.
pub fn order(command: &str, arguments: &[&str]) -> Value {
    let mut order = json!({ "command": command });
    let mut words = arguments.iter().peekable();
    while let Some(word) = words.next() {
        let option = word.strip_prefix("--").expect("an option");
        let value = words.next_if(|next| !next.starts_with("--"));
        let field = option.replace('-', "_");
        match (field.as_str(), value) {
            (_, None) => order[field] = json!(true),
            ("set", Some(value)) => match order["set"].as_array_mut() {
                Some(sets) => sets.push(json!(value)),
                None => order["set"] = json!([value]),
            },
            ("seed", Some(value)) => order[field] = json!(value.parse::<u64>().expect("a seed")),
            (_, Some(value)) => order[field] = json!(value),
        }
    }
    order
}
