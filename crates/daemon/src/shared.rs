//! What the threads and tasks of the daemon share.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Instant, SystemTime};

use tokio::sync::watch;

use super::catalogue::Catalogue;
use super::computations::Computations;
use super::files::Files;
use super::live::hub::LiveHub;
use super::output::RunOutput;
use super::owner::Owner;
use super::schedule::{Now, Schedule};
use bench_base::timestamp::unix_ns;
use bench_config::{Config, Source};
use bench_experiment::Plan;

/// Commands whose output is kept.
const KEPT_OUTPUTS: usize = 100;

/// The configuration with which the daemon runs.
#[derive(Clone, Debug)]
pub struct DaemonConfig {
    /// Profile or file, and settings.
    pub source: Source,
    /// The settings.
    pub config: Config,
}

/// State of the daemon.
pub struct Daemon {
    schedule: Mutex<Schedule>,
    /// Counts the changes of the schedule.
    changes: watch::Sender<u64>,
    /// The thread that holds the rig.
    pub owner: Owner,
    /// Samples, state and events for clients.
    pub live: LiveHub,
    configuration: DaemonConfig,
    /// What the last commands printed.
    outputs: Mutex<BTreeMap<u64, Arc<RunOutput>>>,
    /// The plan in progress, for changes of its reference and gain.
    plan: Mutex<Option<Arc<Plan>>>,
    /// Numbers of verdicts about CNMP zeros.
    verdicts: Mutex<BTreeMap<String, u64>>,
    /// Open connections of commands.
    sessions: AtomicUsize,
    /// Places for computations that move nothing.
    pub computations: Computations,
    /// Calls of the file system for clients.
    pub files: Files,
    /// Folder of the recordings.
    pub recordings: PathBuf,
    /// The socket of this daemon.
    pub socket: PathBuf,
    /// Start of the daemon, in seconds since 1970.
    pub started_unix_s: f64,
    /// Why it started: at the request of the operator, or after a crash.
    pub start_reason: String,
}

/// An open connection of a command.
pub struct CountedSession(Arc<Daemon>);

impl Drop for CountedSession {
    fn drop(&mut self) {
        self.0.sessions.fetch_sub(1, Ordering::SeqCst);
        self.0.changes.send_modify(|count| *count += 1);
    }
}

/// What a daemon is made of.
pub struct Parts {
    /// The thread that holds the rig.
    pub owner: Owner,
    /// Samples, state and events for clients.
    pub live: LiveHub,
    /// The configuration.
    pub configuration: DaemonConfig,
    /// Folder of the recordings.
    pub recordings: PathBuf,
    /// The socket of this daemon.
    pub socket: PathBuf,
    /// Why it started.
    pub start_reason: String,
}

impl Daemon {
    /// A daemon without commands.
    pub fn new(parts: Parts) -> Daemon {
        Daemon {
            schedule: Mutex::default(),
            changes: watch::Sender::new(0),
            owner: parts.owner,
            live: parts.live,
            configuration: parts.configuration,
            outputs: Mutex::default(),
            plan: Mutex::new(None),
            verdicts: Mutex::default(),
            sessions: AtomicUsize::new(0),
            computations: Computations::default(),
            files: Files::default(),
            recordings: parts.recordings,
            socket: parts.socket,
            started_unix_s: now().unix_s,
            start_reason: parts.start_reason,
        }
    }

    /// Reads the schedule.
    pub fn read<R>(&self, read: impl FnOnce(&Schedule) -> R) -> R {
        read(&lock(&self.schedule))
    }

    /// Changes the schedule, and wakes whoever waits for a change.
    pub fn change<R>(&self, change: impl FnOnce(&mut Schedule, Now) -> R) -> R {
        let result = change(&mut lock(&self.schedule), now());
        self.changes.send_modify(|count| *count += 1);
        result
    }

    /// Changes the schedule, and wakes whoever waits only if something has its turn now.
    pub fn change_quietly<R>(
        &self,
        change: impl FnOnce(&mut Schedule, Now) -> Option<R>,
    ) -> Option<R> {
        let before = self.read(Schedule::version);
        let result = change(&mut lock(&self.schedule), now());
        if result.is_some() || self.read(Schedule::version) != before {
            self.changes.send_modify(|count| *count += 1);
        }
        result
    }

    /// What a command printed.
    pub fn output(&self, id: u64) -> Arc<RunOutput> {
        let mut outputs = lock(&self.outputs);
        while outputs.len() > KEPT_OUTPUTS {
            outputs.pop_first();
        }
        Arc::clone(outputs.entry(id).or_default())
    }

    /// Changes of the schedule from now on.
    pub fn changes(&self) -> watch::Receiver<u64> {
        self.changes.subscribe()
    }

    /// The configuration.
    pub fn configuration(&self) -> &DaemonConfig {
        &self.configuration
    }

    /// Counts a verdict about CNMP zeros.
    pub fn count_verdict(&self, verdict: &str) {
        *lock(&self.verdicts).entry(verdict.into()).or_default() += 1;
    }

    /// Numbers of verdicts about CNMP zeros.
    pub fn verdicts(&self) -> BTreeMap<String, u64> {
        lock(&self.verdicts).clone()
    }

    /// Counts a connection of a command until the result is dropped.
    pub fn count_session(self: &Arc<Self>) -> CountedSession {
        self.sessions.fetch_add(1, Ordering::SeqCst);
        CountedSession(Arc::clone(self))
    }

    /// Connections of commands. Their recordings may be open.
    pub fn sessions(&self) -> usize {
        self.sessions.load(Ordering::SeqCst)
    }

    /// The recordings.
    pub fn catalogue(&self) -> Catalogue {
        Catalogue::new(self.recordings.clone())
    }

    /// The plan in progress.
    pub fn plan(&self) -> Option<Arc<Plan>> {
        lock(&self.plan).clone()
    }

    /// Sets the plan in progress.
    pub fn set_plan(&self, plan: Option<Arc<Plan>>) {
        *lock(&self.plan) = plan;
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// This moment by both clocks.
pub fn now() -> Now {
    Now {
        instant: Instant::now(),
        unix_s: unix_ns(SystemTime::now()) as f64 * 1e-9,
    }
}
