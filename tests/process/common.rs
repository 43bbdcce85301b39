//! A bench in real time, in a process of its own.
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use bench_recording::Recording;
use bench_rt::record::TickRecord;
use bench_test_support::program::{NO_DAEMON, until_frozen};

/// A test that waits longer than this has failed. It is not a requirement.
const TIME_LIMIT: Duration = Duration::from_secs(120);
/// Between two looks at the program.
const PAUSE: Duration = Duration::from_millis(20);

/// No effective limit of missed ticks: timing is not tested.
pub const NO_OVERRUN_LIMIT: [&str; 2] = ["--set", "interlock.overruns_per_s=1000000"];
/// The chirp's last frequency must lie below half the rate in any configuration.
pub const AT_1_KHZ: [&str; 6] = [
    "--set",
    "loop.rate_hz=1000",
    "--set",
    "chirp.stop_hz=200",
    "--pace",
    "realtime",
];
pub const RATE_HZ: u64 = 1000;

pub fn bench(arguments: &[&str]) -> Command {
    let mut command = without_daemon(env!("CARGO_BIN_EXE_bench"));
    command.args(arguments).stdin(Stdio::null());
    command
}

/// A program that is `bench` or starts it.
pub fn without_daemon(program: &str) -> Command {
    let mut command = Command::new(program);
    command.envs([NO_DAEMON]);
    command
}

/// A run of 60 s, which is longer than a test lets it run.
#[derive(Clone, Copy)]
pub enum LongRun {
    /// Closed loop with the slow controller.
    Control,
    Chirp,
}

pub fn arguments_of(run: LongRun) -> Vec<&'static str> {
    let own: &[&str] = match run {
        LongRun::Control => &[
            "control",
            "--slow",
            "--duration",
            "60",
            "--reference",
            "sine",
            "--amplitude",
            "20um",
        ],
        LongRun::Chirp => &[
            "chirp",
            "--duration",
            "60",
            "--amplitude",
            "0.1",
            "--set",
            "chirp.quiet_before_s=0.1",
        ],
    };
    [own, &["--json"], &AT_1_KHZ, &NO_OVERRUN_LIMIT].concat()
}

/// The running program. It is killed if a test ends early.
pub struct Running(Option<Child>);

impl Running {
    pub fn start(arguments: &[&str], out: &Path) -> Running {
        let mut command = bench(arguments);
        Running::of(
            command
                .arg("--out")
                .arg(out)
                .stdout(Stdio::piped())
                .stderr(Stdio::piped()),
        )
    }

    pub fn of(command: &mut Command) -> Running {
        Running(Some(command.spawn().expect("the program starts")))
    }

    pub fn pid(&self) -> libc::pid_t {
        self.0.as_ref().expect("running").id() as libc::pid_t
    }

    fn has_ended(&mut self) -> bool {
        let child = self.0.as_mut().expect("running");
        child.try_wait().expect("a child of ours").is_some()
    }

    pub fn signal(&self, signal: i32) {
        // SAFETY: a child that was not waited for yet, so its id is not reused.
        let result = unsafe { libc::kill(self.pid(), signal) };
        assert_eq!(result, 0, "{}", std::io::Error::last_os_error());
    }

    /// Stops every thread of the program until [`Running::thaw`].
    pub fn freeze(&self) {
        self.signal(libc::SIGSTOP);
        until_frozen(self.pid().unsigned_abs());
    }

    pub fn thaw(&self) {
        self.signal(libc::SIGCONT);
    }

    /// Number of sleeps of the loop's thread: at most one for each started tick, and a few before the first tick.
    fn sleeps(&self) -> u64 {
        let tasks =
            std::fs::read_dir(format!("/proc/{}/task", self.pid())).expect("a running process");
        for task in tasks {
            let Ok(task) = task else { continue };
            let named = |name: &str| std::fs::read_to_string(task.path().join(name)).ok();
            if named("comm").is_some_and(|comm| comm.trim() == "bench-loop") {
                let status = named("status").unwrap_or_default();
                let line = status
                    .lines()
                    .find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
                return line.and_then(|n| n.trim().parse().ok()).unwrap_or(0);
            }
        }
        0
    }

    /// Waits until the program ends by itself.
    pub fn until_ended(&mut self) {
        let deadline = Instant::now() + TIME_LIMIT;
        while !self.has_ended() {
            assert!(Instant::now() < deadline, "the program does not end");
            std::thread::sleep(PAUSE);
        }
    }

    /// Waits until a state is reached, while the program runs.
    pub fn until(&mut self, what: &str, mut is_reached: impl FnMut(&Running) -> bool) {
        let deadline = Instant::now() + TIME_LIMIT;
        while !is_reached(self) {
            if self.has_ended() {
                panic!("{what}: it ended early: {:?}", self.end());
            }
            assert!(Instant::now() < deadline, "not reached: {what}");
            std::thread::sleep(PAUSE);
        }
    }

    /// Waits until the loop has slept at least `times` times; returns the number of sleeps.
    pub fn until_slept(&mut self, times: u64) -> u64 {
        let mut sleeps = 0;
        self.until("the loop runs", |running| {
            sleeps = running.sleeps();
            sleeps >= times
        });
        sleeps
    }

    /// Waits until the part of the recording that is written fulfils a condition.
    pub fn until_recorded(
        &mut self,
        folder: &Path,
        what: &str,
        is_reached: impl Fn(&Recording) -> bool,
    ) {
        self.until(what, |_| {
            Recording::open(&recording_in(folder)).is_ok_and(|written| is_reached(&written))
        });
    }

    pub fn end(&mut self) -> Output {
        self.0
            .take()
            .expect("running")
            .wait_with_output()
            .expect("a child of ours")
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

pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The one recording in a folder.
pub fn recording_in(folder: &Path) -> PathBuf {
    let files = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path());
    let mut found: Vec<PathBuf> = files
        .filter(|path| path.extension().is_some_and(|e| e == "mcap"))
        .collect();
    assert_eq!(found.len(), 1, "{found:?}");
    found.remove(0)
}

pub fn ticks(recording: &Recording) -> Vec<TickRecord> {
    recording
        .ticks()
        .and_then(Iterator::collect)
        .expect("readable")
}
