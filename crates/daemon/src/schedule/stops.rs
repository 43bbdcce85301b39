//! The rules of the queue for stops and trips: the bench is held, and a stopped command keeps its turn for [`GRACE`] only.

use super::{GRACE, Now, Schedule, ScheduleError};
use crate::hold::{Hold, HoldCause, StopKind};
use crate::run_entry::{Phase, RunEntry};
use bench_experiment::EndKind;

impl Schedule {
    /// Stops a command: one that waits is removed; for the one that has its turn the bench is stopped and held. `by` says who stops.
    ///
    /// # Errors
    /// When there is no such command.
    pub fn stop(
        &mut self,
        id: u64,
        kind: StopKind,
        by: &str,
        now: Now,
    ) -> Result<(), ScheduleError> {
        match self.entry(id)? {
            entry if entry.phase == Phase::Finished => {}
            entry if entry.is_current() => drop(self.stop_bench(kind, by, now)),
            _ => {
                let why = "it was cancelled before its turn".into();
                self.finish(id, EndKind::Stopped, Some(why), now);
            }
        }
        Ok(())
    }

    /// Stops whatever has its turn, and holds the bench; returns the number of the command. `by` says who stops.
    pub fn stop_bench(&mut self, kind: StopKind, by: &str, now: Now) -> Option<u64> {
        let run = self.stop_current(kind, now);
        match &mut self.hold {
            Some(held) => held.add_stop(kind),
            None => self.begin_hold(Hold {
                cause: HoldCause::Stop,
                by: by.into(),
                since_unix_s: now.unix_s,
                how: Some(kind),
                run,
            }),
        }
        run
    }

    /// Stops whatever has its turn, at the end of the daemon; returns its number.
    pub fn stop_current(&mut self, kind: StopKind, now: Now) -> Option<u64> {
        let current = self.open.front_mut().filter(|entry| entry.is_current())?;
        current.stop(kind, now.instant + GRACE);
        Some(current.id)
    }

    /// An interlock ended the run of a command.
    pub(super) fn trip(&mut self, id: u64, by: String, now: Now) {
        self.begin_hold(Hold {
            cause: HoldCause::Trip,
            by,
            since_unix_s: now.unix_s,
            how: None,
            run: Some(id),
        });
    }

    /// Holds the bench. If it is held, the first cause remains.
    fn begin_hold(&mut self, hold: Hold) {
        self.hold.get_or_insert(hold);
        self.mark_waiting();
    }

    /// Releases the bench.
    ///
    /// # Errors
    /// When `secret` is not that of the lease, or the lease has expired.
    pub fn resume(&mut self, secret: &str, now: Now) -> Result<Option<Hold>, ScheduleError> {
        self.require_lease(secret, now)?;
        let released = self.hold.take();
        self.mark_waiting();
        Ok(released)
    }

    pub(super) fn waiting_phase(&self) -> Phase {
        match self.hold {
            Some(_) => Phase::Held,
            None => Phase::Queued,
        }
    }

    fn mark_waiting(&mut self) {
        let phase = self.waiting_phase();
        let waiting = self.open.iter_mut().filter(|entry| !entry.is_current());
        for entry in waiting {
            entry.phase = phase;
        }
    }

    /// Ends the turn of a stopped command at its time.
    pub(super) fn end_turn(&mut self, now: Now) {
        let is_over = |entry: &&RunEntry| entry.turn_ends.is_some_and(|ends| now.instant >= ends);
        let Some(entry) = self.current().filter(is_over) else {
            return;
        };
        let outcome = match entry.outcome {
            Some(EndKind::Tripped) => EndKind::Tripped,
            _ => EndKind::Stopped,
        };
        self.finish(entry.id, outcome, None, now);
    }
}
