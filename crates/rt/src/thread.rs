//! The thread of the loop: locked memory, a real-time scheduler and its own processor. If the system refuses one of
//! these, the loop still runs, and the refusal is reported with its remedy.

use std::fmt::Display;
use std::fs::{File, OpenOptions};
use std::io::Write;

use nix::sys::mman::{MlockAllFlags, mlockall, munlockall};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use bench_base::thread_priority::set_fifo;
use bench_config::LoopSettings;

/// `virtual` or `realtime`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
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
    /// Whether the memory is locked during runs.
    pub memory_locked: bool,
    /// Whether the processors stay out of power-saving idle states during runs.
    #[serde(default)]
    pub idle_states_off: bool,
    /// The processor it is bound to.
    pub cpu: Option<usize>,
    /// The refused requests, with the remedy.
    pub refused: Vec<String>,
}

/// What the process holds while a run goes on, as far as it was granted. Dropping it gives it back, also in a panic: the analysis
/// after the run would otherwise allocate locked memory, and the processors would not save power.
pub struct RunPrivileges {
    _memory: Option<MemoryLock>,
    _latency: Option<File>,
}

/// The locked memory of the process.
struct MemoryLock;

impl Drop for MemoryLock {
    fn drop(&mut self) {
        let _ = munlockall(); // does not fail for locked memory
    }
}

impl Scheduling {
    /// Holds for a run what the system granted when the thread was scheduled.
    pub fn hold(&self) -> RunPrivileges {
        let locked = self.memory_locked && lock_memory().is_ok();
        RunPrivileges {
            _memory: locked.then_some(MemoryLock),
            _latency: (self.idle_states_off.then(switch_idle_states_off)).and_then(Result::ok),
        }
    }
}

impl Pace {
    /// Schedules the calling thread.
    pub fn schedule(self, settings: &LoopSettings) -> Scheduling {
        match self {
            Pace::Virtual => Scheduling {
                policy: "SCHED_OTHER".into(),
                ..Scheduling::default()
            },
            Pace::Realtime => become_realtime(settings),
        }
    }
}

/// Requests all system settings that prevent interruptions of the calling thread, which is the thread of the loop. Those of
/// [`RunPrivileges`] are only tried, and given back.
pub fn become_realtime(settings: &LoopSettings) -> Scheduling {
    let mut scheduling = Scheduling::default();
    scheduling.try_memory();
    scheduling.try_idle_states();
    scheduling.set_policy(settings.priority);
    scheduling.set_cpu(settings.cpu);
    scheduling
}

impl Scheduling {
    fn try_memory(&mut self) {
        let remedy =
            "raise `memlock` in /etc/security/limits.conf or give the program CAP_IPC_LOCK";
        let lock = lock_memory().map(|()| MemoryLock);
        self.memory_locked = self.granted("locking memory", lock.map(drop), remedy);
    }

    fn try_idle_states(&mut self) {
        let remedy = "give this user write access to /dev/cpu_dma_latency by a udev rule (docs/real-time.md)";
        let file = switch_idle_states_off();
        self.idle_states_off = self.granted("switching idle states off", file.map(drop), remedy);
    }

    fn set_policy(&mut self, priority: i32) {
        let remedy = "raise `rtprio` in /etc/security/limits.conf or give the program CAP_SYS_NICE";
        self.policy = if self.granted("SCHED_FIFO", set_fifo(priority), remedy) {
            format!("SCHED_FIFO {priority}")
        } else {
            "SCHED_OTHER".into()
        };
    }

    fn set_cpu(&mut self, cpu: Option<usize>) {
        let remedy = "choose a processor this process may use in loop.cpu";
        self.cpu = cpu.filter(|&cpu| self.granted("binding to a processor", bind(cpu), remedy));
    }

    /// Whether the system granted a request; a refusal is recorded with its remedy.
    fn granted(&mut self, what: &str, result: Result<(), impl Display>, remedy: &str) -> bool {
        let refused = result.map_err(|error| format!("{what}: {error}; {remedy}"));
        let granted = refused.is_ok();
        self.refused.extend(refused.err());
        granted
    }
}

fn lock_memory() -> nix::Result<()> {
    mlockall(MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE)
}

/// Keeps all processors out of power-saving idle states, from which they wake late, while the file is open: the largest latency
/// that the system may cause is set to 0 us [Linux, admin-guide/pm/cpuidle, "PM QoS"].
fn switch_idle_states_off() -> std::io::Result<File> {
    let mut file = OpenOptions::new()
        .write(true)
        .open("/dev/cpu_dma_latency")?;
    file.write_all(&0_i32.to_ne_bytes())?;
    Ok(file)
}

fn bind(cpu: usize) -> nix::Result<()> {
    let mut set = nix::sched::CpuSet::new();
    set.set(cpu)?;
    nix::sched::sched_setaffinity(nix::unistd::Pid::from_raw(0), &set)
}
