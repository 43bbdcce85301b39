//! Progress of a task: written by the task, read by the display.
//!
//! ```
//! use bench_base::progress::Progress;
//!
//! let progress = Progress::default();
//! progress.begin("fitting", 20);
//! progress.advance(5);
//! let now = progress.snapshot();
//! assert_eq!((now.stage, now.done, now.total), ("fitting", 5, 20));
//! ```

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Progress of a task. Clones share their state.
#[derive(Clone, Debug)]
pub struct Progress(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    stage: &'static str,
    begun: Instant,
    done: u64,
    total: u64,
}

impl Default for Progress {
    fn default() -> Self {
        Progress::new("")
    }
}

impl Progress {
    /// Progress of a stage whose number of steps is not known yet.
    pub fn new(stage: &'static str) -> Progress {
        Progress(Arc::new(Mutex::new(State {
            stage,
            begun: Instant::now(),
            done: 0,
            total: 0,
        })))
    }

    /// Begins a stage of `total` steps; 0 if their number is not known.
    pub fn begin(&self, stage: &'static str, total: u64) {
        *self.state() = State {
            stage,
            begun: Instant::now(),
            done: 0,
            total,
        };
    }

    /// Adds finished steps of the stage.
    pub fn advance(&self, steps: u64) {
        self.state().done += steps;
    }

    /// Sets how many steps of how many are done.
    pub fn set(&self, done: u64, total: u64) {
        let mut state = self.state();
        (state.done, state.total) = (done, total);
    }

    /// The state at this moment.
    pub fn snapshot(&self) -> Snapshot {
        let state = self.state();
        Snapshot {
            stage: state.stage,
            done: state.done.min(state.total),
            total: state.total,
            elapsed: state.begun.elapsed(),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The progress of a task at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot {
    /// Name of the stage.
    pub stage: &'static str,
    /// Finished steps of the stage.
    pub done: u64,
    /// All steps of the stage; 0 if their number is not known.
    pub total: u64,
    /// Time since the stage began.
    pub elapsed: Duration,
}

impl Snapshot {
    /// The time that the rest of the stage takes at the mean speed since it began: while nothing finishes it grows.
    /// `None` before the first and after the last step.
    pub fn remaining(&self) -> Option<Duration> {
        let is_between = self.done > 0 && self.done < self.total;
        let steps_left = self.total.saturating_sub(self.done) as f64;
        let seconds = self.elapsed.as_secs_f64() * steps_left / self.done.max(1) as f64;
        is_between.then(|| Duration::from_secs_f64(seconds.min(1e9)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn snapshot(done: u64, total: u64, seconds: u64) -> Snapshot {
        Snapshot {
            stage: "x",
            done,
            total,
            elapsed: Duration::from_secs(seconds),
        }
    }

    #[test]
    fn remaining_time_grows_while_nothing_finishes() {
        let after = |seconds| snapshot(3, 4, seconds).remaining().unwrap();
        assert_eq!([after(3), after(30)], [1, 10].map(Duration::from_secs));
    }

    #[test]
    fn remaining_time_is_unknown_before_the_first_and_after_the_last_step() {
        for (done, total) in [(0, 4), (4, 4), (0, 0), (3, 0)] {
            assert_eq!(
                snapshot(done, total, 5).remaining(),
                None,
                "{done} of {total}"
            );
        }
    }

    #[test]
    fn a_new_stage_starts_from_zero() {
        let progress = Progress::new("run");
        progress.set(9, 10);
        progress.begin("analysis", 3);
        assert_eq!(
            (progress.snapshot().done, progress.snapshot().total),
            (0, 3)
        );
    }
}
