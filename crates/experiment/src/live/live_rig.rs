//! A rig with its loop, open for several runs. Each run has its own recording, which is open before the run starts.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Sender;

use bench_hal::Rig;

use super::connections::{OutsideEnds, connect};
use super::run::{Run, RunEnd, RunFile, StopCause};
use super::run_hooks::{FEED_SLOTS, FeedSource, RunHooks};
use super::run_recording::{create_recording, metadata, recording_bytes, require_space};
use super::run_supervisor::Supervisor;
use crate::errors::RunError;
use crate::plan::{Plan, PlanError, RAMP_TICKS, residuals};
use bench_config::{Config, LoopSettings, OnRecordingFailure};
use bench_recording::{DiskWatch, Recorder, free_bytes};
use bench_rt::device_defect::DeviceDefect;
use bench_rt::interlock::Interlocks;
use bench_rt::live_loop::LiveLoop;
use bench_rt::program::Program;
use bench_rt::request::{Request, RequestSender};
use bench_rt::servo_run::{Connections, Progress, ServoRun};
use bench_rt::supervision::{ArmLease, LeaseWatch, StopFlags};
use bench_rt::thread::{Pace, Scheduling};
use bench_rt::tuning::Tune;

/// Slots of the ring to the recorder: 13 s at 5 kHz, in case the disk stalls.
const RING_SLOTS: usize = 1 << 16;
/// Seconds that are recorded after the motor was switched off.
pub(crate) const TAIL_S: f64 = 0.1;
/// Longest time in seconds during which a run goes on although its ticks are not recorded.
const MAX_UNRECORDED_S: f64 = 1.0;
/// Time for which the readings are judged before a device is enabled, unless `loop.healthy_s` is set.
const HEALTHY_S: f64 = 0.02;

/// An open rig on which plans run, one after the other. Dropping it closes the rig.
pub struct LiveRig {
    live: LiveLoop,
    pace: Pace,
    hooks: RunHooks,
    /// Progress of the loop between two runs.
    idle: Arc<Progress>,
}

impl LiveRig {
    /// Starts the loop of a rig, disarmed.
    ///
    /// # Errors
    /// When the system refuses the thread of the loop.
    pub fn open(rig: Box<dyn Rig>, config: &Config, pace: Pace) -> Result<LiveRig, RunError> {
        LiveRig::with_hooks(rig, config, pace, RunHooks::default())
    }

    /// Starts the loop of a rig that other threads stop, change and watch.
    ///
    /// # Errors
    /// When the system refuses the thread of the loop.
    pub fn with_hooks(
        rig: Box<dyn Rig>,
        config: &Config,
        pace: Pace,
        hooks: RunHooks,
    ) -> Result<LiveRig, RunError> {
        let connections = idle_connections(config, &hooks);
        let idle = Arc::clone(&connections.progress);
        let run = ServoRun::new(interlocks(config), connections);
        let live = LiveLoop::open(rig, Box::new(run), &config.servo, pace);
        let live = live.map_err(RunError::system("start the thread of the loop"))?;
        Ok(LiveRig {
            live,
            pace,
            hooks,
            idle,
        })
    }

    /// The device that cannot be used, as of the last tick between two runs.
    pub fn defect(&self) -> Option<DeviceDefect> {
        self.idle.defect.get()
    }

    /// Replaces the hooks for the next run.
    pub fn set_hooks(&mut self, hooks: RunHooks) {
        self.hooks = hooks;
    }

    /// How the loop is scheduled.
    pub fn scheduling(&self) -> &Scheduling {
        self.live.scheduling()
    }

    /// Changes the reference or the loop gain of the run in progress (see [`RunHooks::tuner`]).
    pub fn tuner(&self) -> Sender<Tune> {
        self.hooks.tuner()
    }

    /// Runs `plan` and records it in `folder`. `watch` is called periodically with the number of completed ticks and of all ticks.
    ///
    /// The configuration of the rig in `plan` must be the one with which the rig was opened.
    pub fn run(
        &mut self,
        plan: &Plan,
        folder: &Path,
        watch: &mut dyn FnMut(u64, u64),
    ) -> Result<Run, RunError> {
        if self.hooks.stop.was_raised() {
            return Err(RunError::StoppedBefore);
        }
        let prepared = self.prepare(plan, folder)?;
        prepared.supervise(self, watch)
    }

    /// Everything that a run needs, before its first tick.
    fn prepare<'a>(&self, plan: &'a Plan, folder: &Path) -> Result<PreparedRun<'a>, RunError> {
        for warning in bench_config::warnings(&plan.config) {
            tracing::warn!("{warning}");
        }
        let program = plan.program()?;
        let total_ticks = program.ticks();
        let ramp_ticks = plan.ramp_ticks()?;
        let recording_bytes = recording_bytes(total_ticks, ramp_ticks, tail_ticks(plan));
        require_space(folder, recording_bytes, free_bytes(folder))?;
        let (connections, mut outside) = connect(RING_SLOTS);
        queue_start(&mut outside.requests, program);
        let stop_flags = self.hooks.stop.clone();
        let lease = self.hooks.lease.clone().unwrap_or_default();
        let run = servo_run(plan, connections)?
            .with_correction(plan.correction())
            .with_ramps(ramp_ticks)
            .with_tail(tail_ticks(plan))
            .with_healthy_ticks(healthy_ticks(&plan.config.servo, self.pace))
            .with_stop_flags(stop_flags.clone())
            .with_lease(lease_watch(plan, self.pace, &lease));
        let mut metadata = metadata(plan, self.pace, self.live.scheduling());
        metadata.insert(RAMP_TICKS.into(), ramp_ticks.to_string());
        Ok(PreparedRun {
            run: Box::new(run),
            recorder: create_recording(plan, metadata, folder)?,
            outside,
            total_ticks,
            recording_bytes,
            max_unrecorded_ticks: (MAX_UNRECORDED_S * plan.config.servo.rate_hz) as u64,
            plan,
            stop_flags,
            lease,
        })
    }
}

/// Opens the loop of `rig`, runs `plan` once and closes it (see [`LiveRig`]).
pub fn run(
    plan: &Plan,
    rig: Box<dyn Rig>,
    pace: Pace,
    folder: &Path,
    watch: &mut dyn FnMut(u64, u64),
) -> Result<Run, RunError> {
    LiveRig::open(rig, &plan.config, pace)?.run(plan, folder, watch)
}

/// A run with its file, before the first tick.
struct PreparedRun<'a> {
    run: Box<ServoRun>,
    recorder: Recorder,
    outside: OutsideEnds,
    total_ticks: u64,
    recording_bytes: u64,
    max_unrecorded_ticks: u64,
    plan: &'a Plan,
    stop_flags: StopFlags,
    lease: Arc<ArmLease>,
}

impl PreparedRun<'_> {
    /// Runs to the end, or until the run is stopped.
    fn supervise(
        self,
        rig: &mut LiveRig,
        watch: &mut dyn FnMut(u64, u64),
    ) -> Result<Run, RunError> {
        let OutsideEnds {
            requests,
            records,
            progress,
            retired: _until_the_end,
        } = self.outside;
        let path = self.recorder.path().to_path_buf();
        let on_recording_failure = self.plan.config.servo.on_recording_failure;
        let mut disk = DiskWatch::of(&path, self.recording_bytes).map_err(RunError::Create)?;
        if on_recording_failure == OnRecordingFailure::Continue {
            disk = disk.closing_at_shortage();
        }
        rig.hooks.recording_defect.clear();
        let copy = rig.hooks.live_copy(self.plan.config.servo.period_s());
        let recorder = bench_recording::spawn(self.recorder, records, disk, copy);
        let recorder = recorder.map_err(RunError::Create)?;
        let mut supervisor = Supervisor {
            requests,
            lease: self.lease,
            health: recorder.health(),
            progress: Arc::clone(&progress),
            max_unrecorded_ticks: self.max_unrecorded_ticks,
            on_recording_failure,
            cause: None,
            hooks: &rig.hooks,
        };
        supervisor.discard_tunes();
        let total_ticks = self.total_ticks;
        let report = || watch(progress.run_ticks.load(Ordering::Relaxed), total_ticks);
        let ended = supervisor.run_to_end(&mut rig.live, self.run, &self.stop_flags, report)?;
        if let Ok(outcome) = &ended
            && let Some((trip, _)) = outcome.trip
        {
            rig.hooks.trips.add(trip.reason());
        }
        let health = recorder.health();
        let recorder = recorder.join().map_err(|error| {
            // A run in virtual time may have ended before the supervisor sees the failure.
            rig.hooks.recording_defect.set(StopCause::RecordingFailed);
            match on_recording_failure {
                OnRecordingFailure::End => RunError::Recording(error),
                OnRecordingFailure::Continue => RunError::Unrecorded(error),
            }
        })?;
        let mut ended = ended.map_err(|_| RunError::LoopDied(path.clone()))?;
        ended.lost_records += health.discarded();
        Ok(Run {
            path,
            end: RunEnd {
                description: self.plan.description.clone(),
                pace: rig.pace,
                scheduling: rig.live.scheduling().clone(),
                stop_cause: supervisor
                    .cause
                    .or(ended.stopped_by.and_then(StopCause::by)),
                unrecorded: rig
                    .hooks
                    .recording_defect
                    .get()
                    .filter(|_| on_recording_failure == OnRecordingFailure::Continue),
                servo: ended,
                motor: self.plan.motor.clone(),
            },
            file: RunFile::Own(Box::new(recorder)),
        })
    }
}

/// The rings of the loop between two runs. Nothing of it is recorded; it may be watched.
fn idle_connections(config: &Config, hooks: &RunHooks) -> Connections {
    let Some(feeds) = hooks.feeds() else {
        return connect(0).0;
    };
    let (connections, outside) = connect(FEED_SLOTS);
    feeds.send(FeedSource::Idle, config.servo.period_s(), outside.records);
    connections
}

/// Requests to arm and to start, queued before the loop begins: they take effect at tick 0.
fn queue_start(requests: &mut RequestSender, program: Box<dyn Program>) {
    for request in [Request::Arm, Request::Start(program)] {
        // The ring is empty and holds more than two requests.
        let _ = requests.send(request);
    }
}

/// A run of a plan, with its interlocks and the heat of the motor.
pub(crate) fn servo_run(plan: &Plan, connections: Connections) -> Result<ServoRun, PlanError> {
    let interlocks = interlocks(&plan.config)
        .with_thermal_state(plan.motor.thermal_a2)
        .with_residuals(residuals(plan)?);
    Ok(ServoRun::new(interlocks, connections))
}

fn interlocks(config: &Config) -> Interlocks {
    let interlocks = Interlocks::new(
        &config.interlock,
        &config.amplifier,
        &config.motor,
        &config.servo,
    );
    interlocks.with_mounting_gain(config.probe.device.mounting_gain())
}

/// The arm lease of a run. In virtual pace, ticks do not measure the time of the supervisor.
fn lease_watch(plan: &Plan, pace: Pace, lease: &Arc<ArmLease>) -> Option<LeaseWatch> {
    match pace {
        Pace::Virtual => None,
        Pace::Realtime => {
            let limit_ticks = plan.config.servo.arm_lease_ticks();
            Some(LeaseWatch::new(Arc::clone(lease), limit_ticks))
        }
    }
}

/// Ticks for which the readings are judged before the amplifier is enabled. A simulated stage has its readings from the first tick.
fn healthy_ticks(servo: &LoopSettings, pace: Pace) -> u64 {
    let default_s = match pace {
        Pace::Realtime => HEALTHY_S,
        Pace::Virtual => 0.0,
    };
    libm::round(servo.healthy_s.unwrap_or(default_s) * servo.rate_hz) as u64
}

fn tail_ticks(plan: &Plan) -> u64 {
    (TAIL_S * plan.config.servo.rate_hz) as u64
}
