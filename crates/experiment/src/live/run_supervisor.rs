//! Watches a run from outside the loop.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::task::Poll;
use std::time::Duration;

use super::run::StopCause;
use super::run_hooks::RunHooks;
use super::stop_signals::SignalFlags;
use crate::errors::RunError;
use bench_config::OnRecordingFailure;
use bench_recording::Health;
use bench_rt::live_loop::{LiveLoop, LoopPanicked};
use bench_rt::record::Origin;
use bench_rt::request::{Request, RequestSender};
use bench_rt::servo_run::{Progress, ServoEnd, ServoRun};
use bench_rt::supervision::{ArmLease, StopFlags};

/// Period of the supervisor.
const SUPERVISION_PERIOD: Duration = Duration::from_millis(5);

/// Watches the loop from outside: progress and the state of the recorder. It renews the arm lease, unless a client does.
pub(super) struct Supervisor<'a> {
    pub(super) requests: RequestSender,
    pub(super) lease: Arc<ArmLease>,
    pub(super) health: Arc<Health>,
    pub(super) progress: Arc<Progress>,
    pub(super) max_unrecorded_ticks: u64,
    pub(super) on_recording_failure: OnRecordingFailure,
    /// Why it has requested the end of the run, if it has.
    pub(super) cause: Option<StopCause>,
    /// Changes of the run, to be passed on to the loop.
    pub(super) hooks: &'a RunHooks,
}

impl Supervisor<'_> {
    /// Begins a run and waits for its end. Signals reach the loop without this thread. Afterwards the run is freed, so that the
    /// recorder receives its end.
    ///
    /// # Errors
    /// The outer one if the system refuses the signal handlers, the inner one if the loop panicked.
    pub(super) fn run_to_end(
        &mut self,
        live: &mut LiveLoop,
        run: Box<ServoRun>,
        stop_flags: &StopFlags,
        mut watch: impl FnMut(),
    ) -> Result<Result<ServoEnd, LoopPanicked>, RunError> {
        let signals = self.hooks.has_signals.then(|| SignalFlags::set(stop_flags));
        let _signals = signals
            .transpose()
            .map_err(RunError::system("start the supervisor of the run"))?;
        if live.begin(run).is_err() {
            return Ok(Err(LoopPanicked)); // only a panic leaves an earlier run in the loop
        }
        loop {
            if self.hooks.lease.is_none() {
                self.lease.renew();
            }
            watch();
            self.watch_recording();
            self.pass_on_tunes();
            if let Poll::Ready(ended) = live.poll_end() {
                return Ok(ended.map(|run| outcome(&run)));
            }
            std::thread::sleep(SUPERVISION_PERIOD);
        }
    }

    /// Discards the changes that were sent before the run.
    pub(super) fn discard_tunes(&self) {
        drop(self.hooks.take_tunes());
    }

    /// Passes changes on to the loop. Without room for the request it is discarded: a later change replaces it in any case.
    fn pass_on_tunes(&mut self) {
        for tune in self.hooks.take_tunes() {
            if self.requests.send(Request::Tune(tune)).is_err() {
                tracing::warn!(
                    "a change of the run was discarded, because the loop has too many requests; send it again"
                );
            }
        }
    }

    /// Ends a run that cannot be recorded any more, unless it shall go on. If there is no room for the request, it is sent again.
    fn watch_recording(&mut self) {
        let Some(cause) = self.recording_defect() else {
            return;
        };
        let is_new = self.hooks.recording_defect.set(cause);
        match self.on_recording_failure {
            OnRecordingFailure::End => {
                if self.cause.is_none() && self.requests.send(Request::Finish).is_ok() {
                    self.cause = Some(cause);
                }
            }
            OnRecordingFailure::Continue => {
                if is_new {
                    tracing::warn!(
                        "the run goes on without a recording, as loop.on_recording_failure orders: {}; the recording ends here",
                        cause.text()
                    );
                }
            }
        }
    }

    /// Why the run cannot be recorded any more, if so.
    fn recording_defect(&self) -> Option<StopCause> {
        let unrecorded_ticks = self.progress.unrecorded_ticks.load(Ordering::Relaxed);
        if self.health.failed() {
            Some(StopCause::RecordingFailed)
        } else if unrecorded_ticks >= self.max_unrecorded_ticks {
            Some(StopCause::RecordsLost)
        } else {
            self.health.shortage().map(StopCause::from)
        }
    }
}

/// How a run ended; warns if the loop ended it by itself.
fn outcome(run: &ServoRun) -> ServoEnd {
    let outcome = run.outcome();
    if outcome.stopped_by == Some(Origin::Lease) {
        tracing::warn!(
            "the loop ended the run by itself, because the command that ordered it did not respond for the time of loop.arm_lease_s; find out what blocked it, for example a paused terminal or a suspended process"
        );
    }
    outcome
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use bench_recording::{DiskState, DiskWatch, Header, Recorder};
    use bench_rt::record::{LoopMessage, TickRecord};

    #[test]
    fn each_shortage_ends_the_run_once_along_a_ramp() {
        for (free_bytes, size_bytes, cause) in [
            (50_000_000, 0, StopCause::DiskNearlyFull),
            (1 << 40, 100_100_000, StopCause::RecordingTooLarge),
        ] {
            let (requests, mut taken) = RequestSender::ring(4);
            let mut supervisor = Supervisor {
                requests,
                health: health_of_a_recorder(free_bytes, size_bytes),
                progress: Arc::new(Progress::default()),
                max_unrecorded_ticks: 5000,
                lease: Arc::default(),
                on_recording_failure: OnRecordingFailure::End,
                cause: None,
                hooks: &RunHooks::default(),
            };
            supervisor.watch_recording();
            assert!(
                taken
                    .pop()
                    .is_ok_and(|sent| matches!(sent.request, Request::Finish))
            );
            assert_eq!(supervisor.cause, Some(cause));
            supervisor.watch_recording();
            assert!(taken.pop().is_err(), "one request");
        }
    }

    #[test]
    fn run_goes_on_unrecorded_if_the_configuration_says_so() {
        let (requests, mut taken) = RequestSender::ring(4);
        let hooks = RunHooks::default();
        let mut supervisor = Supervisor {
            requests,
            health: health_of_a_recorder(50_000_000, 0),
            progress: Arc::new(Progress::default()),
            max_unrecorded_ticks: 5000,
            lease: Arc::default(),
            on_recording_failure: OnRecordingFailure::Continue,
            cause: None,
            hooks: &hooks,
        };
        supervisor.watch_recording();
        assert!(taken.pop().is_err(), "no request");
        assert_eq!(supervisor.cause, None);
        assert_eq!(
            hooks.recording_defect.get(),
            Some(StopCause::DiskNearlyFull)
        );
    }

    /// The state of a recorder after 1000 ticks on a disk with these sizes.
    fn health_of_a_recorder(free_bytes: u64, size_bytes: u64) -> Arc<Health> {
        let path = Path::new("recording.mcap");
        let header = Header {
            period_s: 2e-4,
            ..Header::default()
        };
        let recorder = Recorder::over(Box::new(std::io::sink()), path, &header).unwrap();
        let (mut ring, records) = rtrb::RingBuffer::new(1000);
        for tick in 0..1000 {
            let tick = TickRecord {
                tick,
                ..TickRecord::default()
            };
            ring.push(LoopMessage::Tick(tick)).unwrap();
        }
        drop(ring);
        let state = DiskState {
            free_bytes: Some(free_bytes),
            size_bytes,
        };
        let disk = DiskWatch::over(Box::new(move || state), 1000);
        let recorder = bench_recording::spawn(recorder, records, disk, None).unwrap();
        let health = recorder.health();
        assert_eq!(recorder.join().unwrap().ticks(), 1000, "all are recorded");
        health
    }

    #[test]
    fn run_ends_when_no_tick_is_recorded_for_a_second() {
        let (requests, mut taken) = RequestSender::ring(4);
        let progress = Arc::new(Progress::default());
        let mut supervisor = Supervisor {
            requests,
            health: Arc::new(Health::default()),
            progress: Arc::clone(&progress),
            max_unrecorded_ticks: 5000,
            lease: Arc::default(),
            on_recording_failure: OnRecordingFailure::End,
            cause: None,
            hooks: &RunHooks::default(),
        };
        progress.unrecorded_ticks.store(4999, Ordering::Relaxed);
        supervisor.watch_recording();
        assert!(taken.pop().is_err(), "a short loss does not end the run");
        progress.unrecorded_ticks.store(5000, Ordering::Relaxed);
        supervisor.watch_recording();
        let taken_request = taken.pop().map(|numbered| numbered.request);
        assert!(matches!(taken_request, Ok(Request::Finish)));
        assert_eq!(supervisor.cause, Some(StopCause::RecordsLost));
        supervisor.watch_recording();
        assert!(taken.pop().is_err(), "one request");
    }
}
