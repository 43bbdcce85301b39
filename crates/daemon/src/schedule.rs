//! The queue of commands and the arm lease. Rules only: no clock, no thread, no device.
//!
//! 1. One command has its turn; the others wait in their order.
//! 2. A command of a client needs the client's lease, when it is queued and when its turn begins. If that lease is lost, the
//!    command is cancelled.
//! 3. A process of this machine (`bench chirp` beside the daemon) takes the lease at its turn. It waits while another operator holds it.
//! 4. When a lease expires, a run that ends with its client is stopped; another run keeps the lease until its end.
//! 5. Anyone may stop. After a stop or a trip the bench is held (see [`hold`](super::hold)): no command gets its turn and no run begins
//!    until the holder of the lease resumes.
//! 6. A stopped command whose run has ended, or has not begun, keeps its turn for [`GRACE`] only, whatever its process does.

mod stops;

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use super::hold::Hold;
pub use super::hold::StopKind;
use super::lease::{Keeper, LEASE, Lease};
use super::run_entry::{Carrier, Phase, RunEntry, RunRequest};
use super::secret::Secret;
use bench_experiment::EndKind;
use bench_order::Command;
use bench_rt::supervision::StopFlags;

/// Commands that may wait at the same time.
pub const MAX_QUEUED: usize = 100;
/// Ended commands that are remembered.
const MAX_FINISHED: usize = 200;
/// Time in which the process of a stopped command ends by itself. Then another command may have the bench.
pub const GRACE: Duration = Duration::from_millis(500);

/// A moment by both clocks. Rules use the monotonic clock; the wall clock is for display.
#[derive(Clone, Copy, Debug)]
pub struct Now {
    /// The monotonic clock.
    pub instant: Instant,
    /// Seconds since 1970.
    pub unix_s: f64,
}

/// A request that the rules refuse.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ScheduleError {
    /// Another operator holds the lease.
    #[error("{operator} holds the arm lease of the bench; wait until it is released")]
    Held {
        /// The operator.
        operator: String,
    },
    /// The request has no valid lease.
    #[error(
        "this needs the arm lease, and the given one is missing or has expired; take the lease first (POST /api/v1/lease)"
    )]
    NoLease,
    /// The queue is full.
    #[error(
        "{MAX_QUEUED} commands wait already; wait until some of them have ended, or cancel them"
    )]
    Full,
    /// There is no such command.
    #[error("there is no run {0}; GET /api/v1/runs lists all")]
    Unknown(u64),
    /// No open command has this ticket.
    #[error("the ticket of this command is not valid; start it again without BENCH_TICKET")]
    NoTicket,
    /// The bench is held.
    #[error(
        "the bench is held: {0}; when the cause is removed, resume with `bench resume` or on the live page, and start the command again"
    )]
    OnHold(Hold),
    /// The command was stopped.
    #[error("the command was stopped, so that it begins no further run; start it again")]
    Stopped,
    /// The daemon ends.
    #[error("the daemon is shutting down; start the command again when it runs")]
    ShuttingDown,
}

/// Queue and lease.
#[derive(Debug, Default)]
pub struct Schedule {
    lease: Option<Lease>,
    /// The command that has its turn, and those that wait.
    open: VecDeque<RunEntry>,
    /// Ended commands, newest first.
    finished: VecDeque<RunEntry>,
    /// Numbers of ended commands.
    ended: BTreeMap<(Command, EndKind), u64>,
    last_id: u64,
    hold: Option<Hold>,
    is_shutting_down: bool,
}

impl Schedule {
    /// The lease, if somebody holds it.
    pub fn lease(&self) -> Option<&Lease> {
        self.lease.as_ref()
    }

    /// Why nothing begins; `None` while the bench is released.
    pub fn hold(&self) -> Option<&Hold> {
        self.hold.as_ref()
    }

    /// The command that has its turn.
    pub fn current(&self) -> Option<&RunEntry> {
        self.open.front().filter(|entry| entry.is_current())
    }

    /// Whether the daemon ends.
    pub fn is_shutting_down(&self) -> bool {
        self.is_shutting_down
    }

    /// The commands that wait.
    pub fn queue(&self) -> impl Iterator<Item = &RunEntry> {
        self.open.iter().filter(|entry| !entry.is_current())
    }

    /// The command that has its turn and those that wait.
    pub fn open(&self) -> impl Iterator<Item = &RunEntry> {
        self.open.iter()
    }

    /// The command that the daemon started with a ticket.
    ///
    /// # Errors
    /// When no open command has it.
    pub fn by_ticket(&self, text: &str) -> Result<u64, ScheduleError> {
        let mut open = self.open.iter();
        let has_ticket = |entry: &&RunEntry| match &entry.carrier {
            Carrier::Started { ticket } => ticket.is(text),
            Carrier::Attached => false,
        };
        let found = open.find(has_ticket).map(|entry| entry.id);
        found.ok_or(ScheduleError::NoTicket)
    }

    /// Ended commands, newest first.
    pub fn finished(&self) -> impl Iterator<Item = &RunEntry> {
        self.finished.iter()
    }

    /// Numbers of ended commands.
    pub fn ended(&self) -> &BTreeMap<(Command, EndKind), u64> {
        &self.ended
    }

    /// A command.
    pub fn entry(&self, id: u64) -> Result<&RunEntry, ScheduleError> {
        let mut all = self.open.iter().chain(&self.finished);
        let found = all.find(|entry| entry.id == id);
        found.ok_or(ScheduleError::Unknown(id))
    }

    /// A command that has not ended, to be changed.
    pub fn open_entry(&mut self, id: u64) -> Result<&mut RunEntry, ScheduleError> {
        let found = self.open.iter_mut().find(|entry| entry.id == id);
        found.ok_or(ScheduleError::Unknown(id))
    }

    /// Changes with the lease and with the phase of any command.
    pub fn version(&self) -> (bool, usize, usize, usize) {
        let waiting = self.open.iter();
        let waiting = waiting.filter(|entry| entry.phase == Phase::WaitingForLease);
        (
            self.lease.is_some(),
            self.open.len(),
            self.finished.len(),
            waiting.count(),
        )
    }

    /// Gives the lease to an operator.
    ///
    /// # Errors
    /// While somebody holds it.
    pub fn take_lease(
        &mut self,
        operator: &str,
        secret: Secret,
        now: Now,
    ) -> Result<(), ScheduleError> {
        if let Some(lease) = &self.lease {
            return Err(ScheduleError::Held {
                operator: lease.operator.clone(),
            });
        }
        self.require_service()?;
        self.lease = Some(Lease {
            secret,
            operator: operator.into(),
            since_unix_s: now.unix_s,
            keeper: Keeper::Client {
                expires: now.instant + LEASE,
            },
            may_return: true,
        });
        Ok(())
    }

    /// Renews a lease.
    ///
    /// # Errors
    /// When `secret` is not that of the lease, or the lease has expired.
    pub fn renew_lease(&mut self, secret: &str, now: Now) -> Result<(), ScheduleError> {
        self.expire(now);
        let lease = self.lease.as_mut();
        let lease = lease.filter(|lease| lease.may_return && lease.secret.is(secret));
        lease.ok_or(ScheduleError::NoLease)?.renew(now.instant);
        Ok(())
    }

    /// Releases a lease. A run that ends with its client is stopped, another one keeps the lease.
    ///
    /// # Errors
    /// When `secret` is not that of the lease, or the lease has expired.
    pub fn release_lease(&mut self, secret: &str, now: Now) -> Result<(), ScheduleError> {
        self.require_lease(secret, now)?;
        self.lose_lease(now);
        if let Some(kept) = &mut self.lease {
            kept.may_return = false;
        }
        Ok(())
    }

    /// The lease of a client, if `secret` is that of the lease. A client that has lost its lease to its run must renew it first.
    ///
    /// # Errors
    /// When `secret` is not that of the lease, or the lease has expired.
    pub fn require_lease(&self, secret: &str, now: Now) -> Result<&Lease, ScheduleError> {
        let lease = self.lease.as_ref();
        let lease =
            lease.filter(|lease| lease.is_of_client(now.instant) && lease.secret.is(secret));
        lease.ok_or(ScheduleError::NoLease)
    }

    /// Ends a lease that was not renewed in time, and the turn of a stopped command whose process does not end.
    pub fn expire(&mut self, now: Now) {
        self.end_turn(now);
        let lease = self.lease.as_ref();
        if lease.is_some_and(|lease| lease.has_expired(now.instant)) {
            self.lose_lease(now);
        }
    }

    /// The client of the lease is disconnected.
    fn lose_lease(&mut self, now: Now) {
        let Some(lease) = self.lease.take() else {
            return;
        };
        let is_of = |entry: &RunEntry| is_under(entry, &lease.secret);
        let cancelled: Vec<u64> = self.queue().filter(|e| is_of(e)).map(|e| e.id).collect();
        for id in cancelled {
            let why = format!("the arm lease of {} ended before its turn", lease.operator);
            self.finish(id, EndKind::Stopped, Some(why), now);
        }
        let Some(current) = self.open.front_mut().filter(|e| e.is_current() && is_of(e)) else {
            return;
        };
        let keeper = Keeper::Run(current.id);
        current.is_orphan = true;
        if current.request.ends_with_client() {
            current.stop(StopKind::Settle, now.instant + GRACE);
        }
        self.lease = Some(Lease { keeper, ..lease });
    }

    /// Queues a command; returns its number.
    ///
    /// # Errors
    /// For a command of a client without its lease, with a full queue, and at shutdown.
    pub fn enqueue(&mut self, new: NewEntry, now: Now) -> Result<u64, ScheduleError> {
        self.require_service()?;
        if self.open.len() > MAX_QUEUED {
            return Err(ScheduleError::Full);
        }
        if let Some(secret) = &new.lease {
            self.require_lease(secret.reveal(), now)?;
        }
        self.last_id += 1;
        self.open.push_back(RunEntry {
            id: self.last_id,
            request: new.request,
            carrier: new.carrier,
            operator: new.operator,
            lease: new.lease,
            phase: self.waiting_phase(),
            queued_unix_s: now.unix_s,
            started_unix_s: None,
            ended_unix_s: None,
            estimated_s: None,
            stop: StopFlags::default(),
            is_stopped: false,
            turn_ends: None,
            has_process: false,
            is_orphan: false,
            outcome: None,
            exit_code: None,
            message: None,
            recording: None,
            progress: None,
        });
        Ok(self.last_id)
    }

    /// Gives the next command its turn, if it may have it; returns its number. `secret` is that of the lease which an attached
    /// process takes.
    pub fn advance(&mut self, secret: impl FnOnce() -> Option<Secret>, now: Now) -> Option<u64> {
        self.expire(now);
        if self.hold.is_some() {
            return None;
        }
        let entry = self.open.front_mut().filter(|entry| !entry.is_current())?;
        if let Some(lease) = &self.lease
            && !may_begin(entry, lease)
        {
            entry.phase = Phase::WaitingForLease;
            return None;
        }
        if self.lease.is_none() {
            let lease = Lease {
                secret: secret()?,
                operator: entry.operator.clone(),
                since_unix_s: now.unix_s,
                keeper: Keeper::Run(entry.id),
                may_return: false,
            };
            entry.lease = Some(lease.secret.clone());
            self.lease = Some(lease);
        }
        entry.phase = Phase::Starting;
        entry.started_unix_s = Some(now.unix_s);
        Some(entry.id)
    }

    /// Begins a run of the command that has its turn: `order` gives it to the rig. Nobody can stop or hold the bench in between.
    ///
    /// # Errors
    /// While the bench is held, when the command was stopped, and when its turn has ended.
    pub fn begin_run<R>(
        &mut self,
        id: u64,
        order: impl FnOnce(&mut RunEntry) -> R,
    ) -> Result<R, ScheduleError> {
        let hold = self.hold.clone();
        let current = self.open.front_mut();
        let current = current.filter(|entry| entry.is_current() && entry.id == id);
        let entry = current.ok_or(ScheduleError::Stopped)?;
        match hold {
            Some(hold) => Err(ScheduleError::OnHold(hold)),
            None if entry.is_stopped => Err(ScheduleError::Stopped),
            None => {
                entry.phase = Phase::Running;
                Ok(order(entry))
            }
        }
    }

    /// A run has ended; its process analyses the recording. One that an interlock ended holds the bench.
    pub fn end_run(&mut self, id: u64, ended: EndedRun, now: Now) {
        if let Some(by) = ended.tripped_by {
            self.trip(id, by, now);
        }
        let Ok(entry) = self.open_entry(id) else {
            return;
        };
        entry.phase = Phase::Analysing;
        entry.outcome = Some(ended.outcome);
        entry.recording = ended.recording.or(entry.recording.take());
        entry.message = ended.message.or(entry.message.take());
        if entry.is_stopped {
            entry.turn_ends = Some(now.instant + GRACE);
        }
    }

    /// The process of a command has ended. Its exit code is noted also after the end of its turn.
    pub fn end_process(&mut self, id: u64, exit_code: Option<i32>) {
        let mut all = self.open.iter_mut().chain(&mut self.finished);
        if let Some(entry) = all.find(|entry| entry.id == id) {
            entry.has_process = false;
            entry.exit_code = exit_code;
        }
    }

    /// Ends a command. The lease of a run ends with it.
    pub fn finish(&mut self, id: u64, outcome: EndKind, message: Option<String>, now: Now) {
        let Some(at) = self.open.iter().position(|entry| entry.id == id) else {
            return;
        };
        if self
            .lease
            .as_ref()
            .is_some_and(|lease| lease.keeper == Keeper::Run(id))
        {
            self.lease = None;
        }
        let Some(mut entry) = self.open.remove(at) else {
            return;
        };
        *(self
            .ended
            .entry((entry.request.order.command(), outcome))
            .or_default()) += 1;
        entry.phase = Phase::Finished;
        entry.turn_ends = None;
        entry.ended_unix_s = Some(now.unix_s);
        entry.outcome = Some(outcome);
        entry.message = entry.message.or(message);
        self.finished.push_front(entry);
        self.finished.truncate(MAX_FINISHED);
    }

    /// The client of a command is disconnected: its run is stopped or goes on, as ordered at its start. A command that waits is
    /// cancelled.
    pub fn lose_client(&mut self, id: u64, now: Now) {
        let Ok(entry) = self.open_entry(id) else {
            return;
        };
        if !entry.is_current() {
            let why = "its process ended before its turn".into();
            return self.finish(id, EndKind::Stopped, Some(why), now);
        }
        entry.is_orphan = true;
        if entry.request.ends_with_client() {
            entry.stop(StopKind::Settle, now.instant + GRACE);
        }
    }

    /// Cancels everything that waits, stops the run, and accepts nothing any more.
    pub fn shut_down(&mut self, now: Now) {
        self.is_shutting_down = true;
        let waiting: Vec<u64> = self.queue().map(|entry| entry.id).collect();
        for id in waiting {
            let why = "the daemon was shut down before its turn".into();
            self.finish(id, EndKind::Stopped, Some(why), now);
        }
        self.stop_current(StopKind::Settle, now);
    }

    fn require_service(&self) -> Result<(), ScheduleError> {
        if self.is_shutting_down {
            Err(ScheduleError::ShuttingDown)
        } else {
            Ok(())
        }
    }
}

/// What is queued.
#[derive(Debug)]
pub struct NewEntry {
    /// What the client asks for.
    pub request: RunRequest,
    /// Who carries it out.
    pub carrier: Carrier,
    /// The operator.
    pub operator: String,
    /// The lease of the client; `None` for an attached process.
    pub lease: Option<Secret>,
}

/// How a run ended.
#[derive(Debug)]
pub struct EndedRun {
    /// Its end.
    pub outcome: EndKind,
    /// File name of its recording.
    pub recording: Option<String>,
    /// The error, if it failed.
    pub message: Option<String>,
    /// The interlock that tripped, in words.
    pub tripped_by: Option<String>,
}

/// Whether a command was queued under a lease.
fn is_under(entry: &RunEntry, secret: &Secret) -> bool {
    entry
        .lease
        .as_ref()
        .is_some_and(|own| own.is(secret.reveal()))
}

/// Whether a command may begin while somebody holds the lease: its own client, or the same operator at another terminal.
fn may_begin(entry: &RunEntry, lease: &Lease) -> bool {
    match &entry.lease {
        Some(own) => own.is(lease.secret.reveal()),
        None => entry.operator == lease.operator,
    }
}

#[cfg(test)]
mod hold_tests;
#[cfg(test)]
mod rule_tests;
#[cfg(test)]
mod tests;
