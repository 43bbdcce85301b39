//! The program at its process boundary: arguments in; exit code, text and files out.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

/// Variable and value with which `bench` finds no daemon: a daemon of this machine makes no runs of tests.
pub const NO_DAEMON: (&str, &str) = ("BENCH_SOCKET", "/nonexistent/bench.sock");

/// A process that does not stop within this time has failed. It is not a requirement.
const FREEZE_LIMIT: Duration = Duration::from_secs(120);

/// A program with a temporary working folder.
pub struct Bench {
    folder: TempDir,
    program: PathBuf,
}

/// Exit code and output of a run.
#[derive(Debug)]
pub struct Answer {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl Bench {
    #[allow(clippy::new_without_default, reason = "each call makes a new folder")]
    pub fn new() -> Bench {
        Bench::of(bench_program())
    }

    /// Another program, with a temporary working folder.
    pub fn of(program: impl Into<PathBuf>) -> Bench {
        Bench {
            folder: tempfile::tempdir().expect("a temporary folder"),
            program: program.into(),
        }
    }

    /// Runs `bench` with arguments separated by spaces.
    pub fn run(&self, arguments: &str) -> Answer {
        self.run_with(arguments.split_whitespace())
    }

    /// Runs `bench` with exactly these arguments.
    pub fn run_with(&self, arguments: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Answer {
        run_program(&self.program, self.folder.path(), arguments)
    }

    /// The one JSON object of a command that is expected to end with exit code 0.
    pub fn json(&self, arguments: &str) -> Value {
        let answer = self.run(&format!("{arguments} --json"));
        assert_eq!(answer.code, 0, "bench {arguments}: {}", answer.err);
        answer.json()
    }

    /// Writes a file and returns its path.
    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, text).expect("a writable folder");
        path
    }

    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn read(&self, name: impl AsRef<Path>) -> String {
        let path = self.path(name);
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }

    /// Names of everything in the folder.
    pub fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).expect("the folder");
        let mut names: Vec<String> = entries
            .map(|entry| {
                entry
                    .expect("an entry")
                    .file_name()
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        names.sort();
        names
    }
}

/// The program under test, whose path cargo passes to integration tests.
fn bench_program() -> PathBuf {
    std::env::var_os("CARGO_BIN_EXE_bench")
        .expect("set by cargo test")
        .into()
}

/// Runs `bench` in a folder; see [`run_program`].
pub fn run_in(folder: &Path, arguments: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Answer {
    run_program(&bench_program(), folder, arguments)
}

/// Runs a program in a folder. It must not panic, end by a signal or hang; the time limit is about a hundred times the duration
/// of the longest command.
pub fn run_program(
    program: &Path,
    folder: &Path,
    arguments: impl IntoIterator<Item = impl AsRef<OsStr>>,
) -> Answer {
    let mut command = assert_cmd::Command::new(program);
    command
        .current_dir(folder)
        .envs([NO_DAEMON])
        .env_remove("BENCH_LOG")
        .args(arguments)
        .timeout(Duration::from_secs(300));
    let output = command.output().expect("bench starts");
    let (out, err) = (text(output.stdout), text(output.stderr));
    assert!(!err.contains("panicked"), "{command:?}: {err}");
    let code = output
        .status
        .code()
        .unwrap_or_else(|| panic!("{command:?} was killed: {}: {err}", output.status));
    assert!(
        (0..=3).contains(&code),
        "{command:?} ended with {code}: {err}"
    );
    Answer { code, out, err }
}

fn text(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).expect("UTF-8")
}

impl Answer {
    /// Standard output, which must be exactly one JSON object.
    pub fn json(&self) -> Value {
        let mut values = serde_json::Deserializer::from_str(&self.out).into_iter::<Value>();
        let first = values.next().unwrap_or_else(|| {
            panic!(
                "nothing on standard output; on standard error: {}",
                self.err
            )
        });
        let value = first.unwrap_or_else(|e| panic!("{e}: {}", self.out));
        assert!(value.is_object(), "not an object: {value}");
        assert!(
            values.next().is_none(),
            "more than one JSON value on standard output: {}",
            self.out
        );
        value
    }

    /// Asserts exit code 2 and all of `words` in the message. Standard output must be empty or, with `--json`, an error object
    /// with the same message.
    pub fn is_refused(&self, words: &[&str]) {
        assert_eq!(self.code, 2, "{self:?}");
        if !self.out.is_empty() {
            let message = self.json()["error"]["message"].clone();
            let message = message.as_str().expect("an error message");
            assert!(self.err.contains(message), "{self:?}");
        }
        for word in words {
            assert!(
                self.err.contains(word),
                "`{word}` is not in the message: {}",
                self.err
            );
        }
    }
}

/// Whether a process works until a stop signal: it has the thread of that work, which begins after the process waits for signals. (Its
/// handlers alone do not tell that. A signal that arrives between them and the wait ends the process.)
pub fn waits_for_signals(process: u32) -> bool {
    let mut threads = threads_of(process);
    threads.any(|(name, _)| name == "bench-analysis")
}

/// Waits until every thread of a process that got SIGSTOP is stopped or has ended. The signal returns before they are, and a thread that
/// still runs may answer a client or write a file.
pub fn until_frozen(process: u32) {
    let begun = Instant::now();
    loop {
        let running = running_threads(process);
        if running.is_empty() {
            return;
        }
        assert!(
            begun.elapsed() < FREEZE_LIMIT,
            "threads of process {process} still run {FREEZE_LIMIT:?} after SIGSTOP: {}",
            running.join(", ")
        );
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Name and state of each thread of a process that is neither stopped (`T`) nor ended (`Z`, `X`) [Linux, proc_pid_stat(5)].
fn running_threads(process: u32) -> Vec<String> {
    threads_of(process)
        .filter(|(_, state)| !matches!(state, 'T' | 'Z' | 'X'))
        .map(|(name, state)| format!("{name} ({state})"))
        .collect()
}

/// Name and state of each thread of a process.
fn threads_of(process: u32) -> impl Iterator<Item = (String, char)> {
    let threads = std::fs::read_dir(format!("/proc/{process}/task"));
    let threads = threads.into_iter().flatten().flatten();
    // A thread whose file is missing has ended.
    let stats =
        threads.filter_map(|thread| std::fs::read_to_string(thread.path().join("stat")).ok());
    stats.filter_map(|stat| thread_state(&stat))
}

/// The name in parentheses, which may contain any character, and the state behind it.
fn thread_state(stat: &str) -> Option<(String, char)> {
    let (begin, end) = stat.split_once('(')?.1.rsplit_once(") ")?;
    Some((begin.into(), end.chars().next()?))
}

/// A number of an answer.
pub fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("a number is expected, there is {value}"))
}

/// Asserts that a figure is within a tolerance of what is expected, both in its unit.
#[track_caller]
pub fn near(what: &str, figure: f64, expected: f64, tolerance: f64) {
    assert!(
        (figure - expected).abs() <= tolerance,
        "{what} is {figure}, expected {expected} +- {tolerance}"
    );
}

/// Random numbers for settings: SplitMix64, the same on every machine.
pub struct Draw(pub u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    /// Uniform between two limits.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Log-uniform between two limits.
    pub fn over_decades(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// One of several.
    pub fn one_of<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[(self.next() % of.len() as u64) as usize]
    }
}
