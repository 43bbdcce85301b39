//! The thread of the loop: locked memory, a real-time scheduler and its own processor. If the system refuses one of
//! these, the loop still runs, and the refusal is reported with its remedy.

use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;

use nix::sys::mman::{MlockAllFlags, mlockall, munlockall};
use serde::{Deserialize, Serialize};

use super::arming::Trip;
use super::clock::{Clock, Realtime, Virtual};
use super::record::Origin;
use super::servo::Servo;
use crate::config::LoopSettings;
use crate::util::thread_priority::set_fifo;

/// `virtual` or `realtime`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Pace {
    /// Each tick starts immediately after the previous one: for simulation and tests.
    Virtual,
    /// Each tick starts at its scheduled time: for hardware.
    Realtime,
}

impl Pace {
    /// The name in JSON and recordings.
    pub fn name(self) -> &'static str {
        match self {
            Pace::Virtual => "virtual",
            Pace::Realtime => "realtime",
        }
    }
}

/// How the loop was scheduled. It is reported with every timing figure.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Scheduling {
    /// `SCHED_FIFO 80`, `SCHED_OTHER`.
    pub policy: String,
    /// Whether the memory is locked.
    pub memory_locked: bool,
    /// The processor it is bound to.
    pub cpu: Option<usize>,
    /// The refused requests, with the remedy.
    pub refused: Vec<String>,
}

/// How a loop ended.
#[derive(Clone, Debug, Default)]
pub struct LoopOutcome {
    /// The trip, if there was one, and its tick.
    pub trip: Option<(Trip, u64)>,
    /// Whether the program ran to its end.
    pub completed: bool,
    /// Who ended the run early without a request of the supervisor: a signal or the arm lease.
    pub stopped_by: Option<Origin>,
    /// Records that did not fit into the ring.
    pub lost_records: u64,
    /// The thermal state of the motor at the end, in A^2.
    pub thermal_a2: f64,
}

/// A loop on its own thread, scheduled but waiting for [`PreparedLoop::begin`].
pub struct PreparedLoop {
    thread: JoinHandle<LoopOutcome>,
    start: Sender<()>,
    scheduling: Scheduling,
}

impl PreparedLoop {
    /// How it is scheduled.
    pub fn scheduling(&self) -> &Scheduling {
        &self.scheduling
    }

    /// Starts the loop. Without this call it ends before its first tick.
    pub fn begin(self) -> JoinHandle<LoopOutcome> {
        // If the thread has panicked, joining it returns the reason.
        let _ = self.start.send(());
        self.thread
    }
}

/// Makes a thread for the loop. Once begun it runs until the loop has been off for `tail_ticks`.
pub fn prepare(
    servo: Servo,
    settings: &LoopSettings,
    pace: Pace,
    tail_ticks: u64,
) -> std::io::Result<PreparedLoop> {
    let settings = settings.clone();
    let (start, started) = channel();
    let (report, reported) = channel();
    let builder = std::thread::Builder::new().name("bench-loop".into());
    let thread = builder.spawn(move || {
        let scheduling = pace.schedule(&settings);
        let _lock = scheduling.memory_locked.then_some(MemoryLock);
        let _ = report.send(scheduling); // without a receiver the loop is not started
        match started.recv() {
            Ok(()) => pace.run(servo, settings.period_s(), tail_ticks),
            Err(_) => LoopOutcome::default(),
        }
    })?;
    let ended =
        |_| std::io::Error::other("the thread of the loop ended before it reported its scheduling");
    let scheduling = reported.recv().map_err(ended)?;
    Ok(PreparedLoop {
        thread,
        start,
        scheduling,
    })
}

/// The locked memory of the process. It is unlocked at the end of the loop, also by a panic: the memory that the analysis allocates
/// afterwards would be locked as well.
struct MemoryLock;

impl Drop for MemoryLock {
    fn drop(&mut self) {
        let _ = munlockall(); // does not fail for locked memory
    }
}

impl Pace {
    /// Schedules the calling thread.
    fn schedule(self, settings: &LoopSettings) -> Scheduling {
        match self {
            Pace::Virtual => Scheduling {
                policy: "SCHED_OTHER".into(),
                ..Scheduling::default()
            },
            Pace::Realtime => become_realtime(settings),
        }
    }

    fn run(self, servo: Servo, period_s: f64, tail_ticks: u64) -> LoopOutcome {
        match self {
            Pace::Virtual => run(servo, Virtual { period_s }, tail_ticks),
            Pace::Realtime => run(servo, Realtime::new(period_s), tail_ticks),
        }
    }
}

/// Ticks until the loop has been off for `tail_ticks`.
pub fn run(mut servo: Servo, mut clock: impl Clock, tail_ticks: u64) -> LoopOutcome {
    let (mut number, mut off_ticks) = (0, 0);
    while off_ticks <= tail_ticks {
        let timing = clock.wait(number, servo.publisher());
        servo.tick(&timing, &clock);
        number = timing.tick.number + 1;
        off_ticks = if servo.is_off() { off_ticks + 1 } else { 0 };
    }
    LoopOutcome {
        trip: servo.last_trip(),
        completed: servo.completed(),
        stopped_by: servo.stopped_by(),
        lost_records: servo.publisher().lost(),
        thermal_a2: servo.thermal_a2(),
    }
}

/// Requests all system settings that prevent interruptions of the calling thread, which is the thread of the loop.
pub(crate) fn become_realtime(settings: &LoopSettings) -> Scheduling {
    let mut scheduling = Scheduling::default();
    scheduling.lock_memory();
    scheduling.set_policy(settings.priority);
    scheduling.set_cpu(settings.cpu);
    scheduling
}

impl Scheduling {
    fn lock_memory(&mut self) {
        let locked = mlockall(MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE);
        let remedy =
            "raise `memlock` in /etc/security/limits.conf or give the program CAP_IPC_LOCK";
        self.memory_locked = self.granted("locking memory", locked, remedy);
    }

    fn set_policy(&mut self, priority: i32) {
        let remedy = "raise `rtprio` in /etc/security/limits.conf or give the program CAP_SYS_NICE";
        self.policy = match self.granted("SCHED_FIFO", set_fifo(priority), remedy) {
            true => format!("SCHED_FIFO {priority}"),
            false => "SCHED_OTHER".into(),
        };
    }

    fn set_cpu(&mut self, cpu: Option<usize>) {
        let remedy = "choose a processor this process may use in loop.cpu";
        self.cpu = cpu.filter(|&cpu| self.granted("binding to a processor", bind(cpu), remedy));
    }

    /// Whether the system granted a request; a refusal is recorded with its remedy.
    fn granted(&mut self, what: &str, result: nix::Result<()>, remedy: &str) -> bool {
        let refused = result.map_err(|error| format!("{what}: {error}; {remedy}"));
        let granted = refused.is_ok();
        self.refused.extend(refused.err());
        granted
    }
}

fn bind(cpu: usize) -> nix::Result<()> {
    let mut set = nix::sched::CpuSet::new();
    set.set(cpu)?;
    nix::sched::sched_setaffinity(nix::unistd::Pid::from_raw(0), &set)
}
