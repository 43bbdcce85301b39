//! The loop's own thread, and what the system allows it: memory locked, a real-time scheduler, a processor of its own.
//! Where something is refused the loop runs all the same and says so.

use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;

use serde::{Deserialize, Serialize};

use super::arming::Trip;
use super::clock::{Clock, Realtime, Virtual};
use super::servo::Servo;
use crate::config::LoopSettings;
use crate::util::thread_priority::set_fifo;

/// `virtual` or `realtime`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pace {
    /// Ticks back to back: studies, tests.
    Virtual,
    /// Ticks when they are due: rigs.
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

/// How the loop was scheduled: beside every timing figure.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Scheduling {
    /// `SCHED_FIFO 80`, `SCHED_OTHER`.
    pub policy: String,
    /// Whether the memory is locked.
    pub memory_locked: bool,
    /// The processor it is bound to.
    pub cpu: Option<usize>,
    /// What was refused, with the remedy.
    pub refused: Vec<String>,
}

/// How a loop ended.
#[derive(Clone, Debug, Default)]
pub struct LoopOutcome {
    /// The trip, if there was one, and its tick.
    pub trip: Option<(Trip, u64)>,
    /// Whether the program ran to its end.
    pub completed: bool,
    /// Records that did not fit into the ring.
    pub lost_records: u64,
}

/// A loop on its own thread, scheduled but waiting for leave to begin.
pub struct PreparedLoop {
    thread: JoinHandle<LoopOutcome>,
    leave: Sender<()>,
    scheduling: Scheduling,
}

impl PreparedLoop {
    /// How it is scheduled.
    pub fn scheduling(&self) -> &Scheduling {
        &self.scheduling
    }

    /// Lets it begin. Without this call it ends before its first tick.
    pub fn begin(self) -> JoinHandle<LoopOutcome> {
        // The thread waits for this; if it died, joining it tells.
        let _ = self.leave.send(());
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
    let (leave, permitted) = channel();
    let (tell, told) = channel();
    let thread = std::thread::Builder::new()
        .name("bench-loop".into())
        .spawn(move || {
            let scheduling = match pace {
                Pace::Virtual => Scheduling {
                    policy: "SCHED_OTHER".into(),
                    ..Scheduling::default()
                },
                Pace::Realtime => become_realtime(&settings),
            };
            let _ = tell.send(scheduling);
            if permitted.recv().is_err() {
                return LoopOutcome::default();
            }
            match pace {
                Pace::Virtual => run(
                    servo,
                    Virtual {
                        period_s: settings.period_s(),
                    },
                    tail_ticks,
                ),
                Pace::Realtime => run(servo, Realtime::new(settings.period_s()), tail_ticks),
            }
        })?;
    let scheduling = told
        .recv()
        .map_err(|_| std::io::Error::other("the loop's thread ended before it began"))?;
    Ok(PreparedLoop {
        thread,
        leave,
        scheduling,
    })
}

/// Ticks until the loop has been off for `tail_ticks`.
pub fn run(mut servo: Servo, mut clock: impl Clock, tail_ticks: u64) -> LoopOutcome {
    let (mut number, mut off_ticks) = (0, 0);
    while off_ticks <= tail_ticks {
        let moment = clock.wait(number, servo.publisher());
        servo.tick(&moment, &clock);
        number = moment.tick.number + 1;
        if servo.took_slow_request() {
            clock.restart(number);
        }
        off_ticks = if servo.is_off() { off_ticks + 1 } else { 0 };
    }
    LoopOutcome {
        trip: servo.last_trip(),
        completed: servo.completed(),
        lost_records: servo.publisher().lost(),
    }
}

/// Asks for everything that keeps the system from interrupting the calling thread, which is the loop's.
pub(crate) fn become_realtime(settings: &LoopSettings) -> Scheduling {
    let mut refused = Vec::new();
    let mut ask = |what: &str, result: nix::Result<()>, remedy: &str| match result {
        Ok(()) => true,
        Err(error) => {
            refused.push(format!("{what}: {error}; {remedy}"));
            false
        }
    };
    let all =
        nix::sys::mman::MlockAllFlags::MCL_CURRENT | nix::sys::mman::MlockAllFlags::MCL_FUTURE;
    let memory_locked = ask(
        "locking memory",
        nix::sys::mman::mlockall(all),
        "raise `memlock` in /etc/security/limits.conf or give the program CAP_IPC_LOCK",
    );
    let fifo = ask(
        "SCHED_FIFO",
        set_fifo(settings.priority),
        "raise `rtprio` in /etc/security/limits.conf or give the program CAP_SYS_NICE",
    );
    let bound = settings.cpu.filter(|&cpu| {
        ask(
            "binding to a processor",
            bind(cpu),
            "choose a processor this process may use in loop.cpu",
        )
    });
    let policy = if fifo {
        format!("SCHED_FIFO {}", settings.priority)
    } else {
        "SCHED_OTHER".into()
    };
    Scheduling {
        policy,
        memory_locked,
        cpu: bound,
        refused,
    }
}

fn bind(cpu: usize) -> nix::Result<()> {
    let mut set = nix::sched::CpuSet::new();
    set.set(cpu)?;
    nix::sched::sched_setaffinity(nix::unistd::Pid::from_raw(0), &set)
}
