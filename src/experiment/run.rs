//! Runs a plan on a rig: loop thread, recorder thread, signals. The recording is closed properly however the run ends.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, SystemTime};

use bench_hal::Rig;
use serde::Serialize;

use super::connections::{OutsideEnds, connect};
use super::file_name;
use super::motor_start::MotorStart;
use super::plan::{KIND, MOTOR_KNOWN_FROM, MOTOR_THERMAL, Plan, RAMP_TICKS};
use super::run_error::RunError;
use super::signals::SignalFlags;
use crate::config::LoopSettings;
use crate::recording::{
    self, DiskWatch, Header, Health, MIN_FREE_BYTES, Recorder, RecordingError, Shortage, Totals,
    free_bytes, lacks_space, predicted_bytes,
};
use crate::rig::calibration::Correction;
use crate::rt::interlock::Interlocks;
use crate::rt::program::Program;
use crate::rt::record::Origin;
use crate::rt::request::{Request, RequestSender};
use crate::rt::servo::{Connections, Progress, Servo};
use crate::rt::supervision::{ArmLease, LeaseWatch, StopFlags};
use crate::rt::thread::{LoopOutcome, Pace, PreparedLoop, Scheduling, prepare};
use crate::util::timestamp;

/// Slots of the ring to the recorder: 13 s at 5 kHz, in case the disk stalls.
const RING_SLOTS: usize = 1 << 16;
/// Seconds that are recorded after the motor was switched off.
pub(super) const TAIL_S: f64 = 0.1;
/// Longest time in seconds during which a run goes on although its ticks are not recorded.
const MAX_UNRECORDED_S: f64 = 1.0;
/// Time for which the readings are judged before a device is enabled, unless `loop.healthy_s` is set.
const HEALTHY_S: f64 = 0.02;
/// Period of the supervisor.
const SUPERVISION_PERIOD: Duration = Duration::from_millis(5);

/// A run that has ended; results can still be added to its recording.
pub struct Run {
    /// Path of the recording.
    pub path: PathBuf,
    /// How the loop ended.
    pub ended: LoopOutcome,
    /// Pace of the loop.
    pub pace: Pace,
    /// How the loop was scheduled.
    pub scheduling: Scheduling,
    /// Why it was stopped early; `None` if it was not.
    pub stop_cause: Option<StopCause>,
    /// The thermal state of the motor at its start.
    pub motor: MotorStart,
    recorder: Recorder,
}

impl Run {
    /// Counts of the recording, which contains all ticks by now. Fails if the file was removed during the run.
    pub fn totals(&mut self) -> Result<Totals, RecordingError> {
        let totals = self.recorder.complete()?;
        match self.path.exists() {
            true => Ok(totals),
            false => Err(RecordingError::Removed {
                path: self.path.clone(),
            }),
        }
    }

    /// Adds the results and closes the file.
    pub fn finish(self, results_json: &str) -> Result<Totals, RecordingError> {
        self.recorder
            .finish(&[("results.json", "application/json", results_json.as_bytes())])
    }
}

/// Runs `plan` on `rig` and records it in `folder`. `watch` is called
/// periodically with the number of completed ticks and of all ticks.
pub fn run(
    plan: &Plan,
    rig: Box<dyn Rig>,
    pace: Pace,
    folder: &Path,
    watch: &mut dyn FnMut(u64, u64),
) -> Result<Run, RunError> {
    prepare_run(plan, rig, pace, folder)?.supervise(watch)
}

/// A run with its thread and its file, before the first tick.
struct PreparedRun {
    servo_loop: PreparedLoop,
    recorder: Recorder,
    outside: OutsideEnds,
    pace: Pace,
    total_ticks: u64,
    recording_bytes: u64,
    max_unrecorded_ticks: u64,
    motor: MotorStart,
    stop_flags: StopFlags,
    lease: Arc<ArmLease>,
}

fn prepare_run(
    plan: &Plan,
    rig: Box<dyn Rig>,
    pace: Pace,
    folder: &Path,
) -> Result<PreparedRun, RunError> {
    let program = plan.program()?;
    let total_ticks = program.ticks();
    let ramp_ticks = plan.ramp_ticks()?;
    let recording_bytes = recording_bytes(plan, total_ticks, ramp_ticks);
    require_space(folder, recording_bytes, free_bytes(folder))?;
    let (connections, mut outside) = connect(RING_SLOTS);
    queue_start(&mut outside.requests, program);
    let (stop_flags, lease) = (StopFlags::default(), Arc::<ArmLease>::default());
    let servo = servo(plan, rig, connections, plan.correction())
        .with_ramps(ramp_ticks)
        .with_healthy_ticks(healthy_ticks(&plan.config.servo, pace))
        .with_stop_flags(stop_flags.clone())
        .with_lease(lease_watch(plan, pace, &lease));
    let servo_loop = prepare_loop(plan, servo, pace)?;
    let mut metadata = metadata(plan, pace, servo_loop.scheduling());
    metadata.insert(RAMP_TICKS.into(), ramp_ticks.to_string());
    let recorder = create_recording(plan, metadata, folder)?;
    Ok(PreparedRun {
        servo_loop,
        recorder,
        outside,
        pace,
        total_ticks,
        recording_bytes,
        max_unrecorded_ticks: (MAX_UNRECORDED_S * plan.config.servo.rate_hz) as u64,
        motor: plan.motor.clone(),
        stop_flags,
        lease,
    })
}

/// Upper limit of the size of the recording: the program, both ramps at its end, and the ticks after it.
fn recording_bytes(plan: &Plan, program_ticks: u64, ramp_ticks: u64) -> u64 {
    let after_ticks = ramp_ticks
        .saturating_mul(2)
        .saturating_add(tail_ticks(plan));
    predicted_bytes(program_ticks.saturating_add(after_ticks))
}

fn tail_ticks(plan: &Plan) -> u64 {
    (TAIL_S * plan.config.servo.rate_hz) as u64
}

/// Refuses a run whose recording might fill the disk.
fn require_space(folder: &Path, bytes: u64, free: Option<u64>) -> Result<(), RunError> {
    if !lacks_space(free, bytes.saturating_add(MIN_FREE_BYTES)) {
        return Ok(());
    }
    Err(RunError::Space {
        folder: folder.into(),
        free_bytes: free.unwrap_or_default(),
        needed_bytes: bytes,
    })
}

/// Requests to arm and to start, queued before the loop begins: they take effect at tick 0.
fn queue_start(requests: &mut RequestSender, program: Box<dyn Program>) {
    for request in [Request::Arm, Request::Start(program)] {
        // The ring is empty and holds more than two requests.
        let _ = requests.send(request);
    }
}

/// The loop of a plan, with its interlocks, the heat of the motor and the correction of the calibration.
pub(super) fn servo(
    plan: &Plan,
    rig: Box<dyn Rig>,
    connections: Connections,
    correction: Option<Correction>,
) -> Servo {
    let config = &plan.config;
    let interlocks = Interlocks::new(
        &config.interlock,
        &config.amplifier,
        &config.motor,
        &config.servo,
    )
    .with_thermal_state(plan.motor.thermal_a2);
    Servo::new(rig, interlocks, connections).with_correction(correction)
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

fn prepare_loop(plan: &Plan, servo: Servo, pace: Pace) -> Result<PreparedLoop, RunError> {
    let config = &plan.config;
    prepare(servo, &config.servo, pace, tail_ticks(plan))
        .map_err(RunError::system("start the thread of the loop"))
}

/// Ticks for which the readings are judged before the amplifier is enabled. A simulated stage has its readings from the first tick.
fn healthy_ticks(servo: &LoopSettings, pace: Pace) -> u64 {
    let default_s = match pace {
        Pace::Realtime => HEALTHY_S,
        Pace::Virtual => 0.0,
    };
    libm::round(servo.healthy_s.unwrap_or(default_s) * servo.rate_hz) as u64
}

/// Creates the recording, with everything that is known before the first tick.
fn create_recording(
    plan: &Plan,
    metadata: BTreeMap<String, String>,
    folder: &Path,
) -> Result<Recorder, RunError> {
    let header = Header {
        config_toml: plan.config_toml()?,
        period_s: plan.config.servo.period_s(),
        started_ns: timestamp::unix_ns(SystemTime::now()),
        metadata,
    };
    create_folder(folder)?;
    let mut recorder = create_under_free_name(folder, &plan.label(), &header)?;
    for (name, media_type, text) in plan.attachments()? {
        let attached = recorder.attach(name, media_type, text.as_bytes());
        attached.map_err(RunError::Create)?;
    }
    Ok(recorder)
}

/// Another process may take a free name before this one does: then the next free name is used.
fn create_under_free_name(
    folder: &Path,
    label: &str,
    header: &Header,
) -> Result<Recorder, RunError> {
    let now = SystemTime::now();
    loop {
        let path = file_name::recording(folder, label, now);
        match Recorder::create(&path, header) {
            Err(RecordingError::Exists { .. }) if path.exists() => {}
            created => return created.map_err(RunError::Create),
        }
    }
}

fn create_folder(folder: &Path) -> Result<(), RunError> {
    std::fs::create_dir_all(folder).map_err(|e| RunError::Folder {
        folder: folder.into(),
        why: e.to_string(),
    })
}

fn metadata(plan: &Plan, pace: Pace, scheduling: &Scheduling) -> BTreeMap<String, String> {
    let pairs = [
        (KIND, plan.kind.name().to_string()),
        ("program", format!("bench {}", env!("CARGO_PKG_VERSION"))),
        ("started", timestamp::milliseconds(SystemTime::now())),
        ("host", kernel_parameter("hostname")),
        ("kernel", kernel_parameter("osrelease")),
        ("pace", pace.name().into()),
        (MOTOR_THERMAL, plan.motor.thermal_a2.to_string()),
        (MOTOR_KNOWN_FROM, plan.motor.known_from.clone()),
    ];
    let devices = plan.devices.iter().cloned();
    let pairs = pairs.into_iter().chain(of_scheduling(scheduling));
    let pairs = pairs.chain(devices);
    pairs.map(|(key, value)| (key.to_string(), value)).collect()
}

fn of_scheduling(scheduling: &Scheduling) -> [(&'static str, String); 4] {
    let cpu = scheduling.cpu.map_or("any".into(), |cpu| cpu.to_string());
    [
        ("policy", scheduling.policy.clone()),
        ("memory_locked", scheduling.memory_locked.to_string()),
        ("cpu", cpu),
        ("refused", scheduling.refused.join("\n")),
    ]
}

fn kernel_parameter(name: &str) -> String {
    let text = std::fs::read_to_string(Path::new("/proc/sys/kernel").join(name));
    text.map_or("unknown".into(), |text| text.trim().to_string())
}

impl PreparedRun {
    /// Runs the loop to its end, or until it is stopped.
    fn supervise(self, watch: &mut dyn FnMut(u64, u64)) -> Result<Run, RunError> {
        let OutsideEnds {
            requests,
            records,
            progress,
            retired: _until_the_end,
        } = self.outside;
        let path = self.recorder.path().to_path_buf();
        let scheduling = self.servo_loop.scheduling().clone();
        let disk = DiskWatch::of(&path, self.recording_bytes).map_err(RunError::Create)?;
        let recorder = recording::spawn(self.recorder, records, disk).map_err(RunError::Create)?;
        let mut supervisor = Supervisor {
            requests,
            lease: self.lease,
            health: recorder.health(),
            progress: Arc::clone(&progress),
            max_unrecorded_ticks: self.max_unrecorded_ticks,
            cause: None,
        };
        let total_ticks = self.total_ticks;
        let report = || watch(progress.run_ticks.load(Ordering::Relaxed), total_ticks);
        let ended = supervisor.wait_for_end(self.servo_loop, &self.stop_flags, report)?;
        let recorder = recorder.join()?;
        let ended = ended.map_err(|_| RunError::LoopDied(path.clone()))?;
        warn_of_expired_lease(&ended);
        Ok(Run {
            path,
            pace: self.pace,
            scheduling,
            stop_cause: supervisor
                .cause
                .or(ended.stopped_by.and_then(StopCause::by)),
            ended,
            motor: self.motor,
            recorder,
        })
    }
}

/// Why a run was stopped before its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StopCause {
    /// A signal of the operator or of the system.
    Signal,
    /// The loop itself: the supervisor did not renew the arm lease.
    LeaseExpired,
    /// The recording could not be written.
    RecordingFailed,
    /// No tick was recorded for one second: the disk is too slow.
    RecordsLost,
    /// The disk of the recording had little free space.
    DiskNearlyFull,
    /// The recording was much larger than the plan predicts.
    RecordingTooLarge,
}

impl From<Shortage> for StopCause {
    fn from(shortage: Shortage) -> StopCause {
        match shortage {
            Shortage::DiskNearlyFull => StopCause::DiskNearlyFull,
            Shortage::TooLarge => StopCause::RecordingTooLarge,
        }
    }
}

impl StopCause {
    /// Why the loop ended a run at the request of `origin`. The supervisor knows the reasons of its own requests.
    fn by(origin: Origin) -> Option<StopCause> {
        match origin {
            Origin::Supervisor => None,
            Origin::Signal => Some(StopCause::Signal),
            Origin::Lease => Some(StopCause::LeaseExpired),
        }
    }
}

/// States why the loop ended a run by itself.
fn warn_of_expired_lease(ended: &LoopOutcome) {
    if ended.stopped_by == Some(Origin::Lease) {
        tracing::warn!(
            "the loop ended the run by itself, because the command line did not respond for the time of loop.arm_lease_s; find out what blocked it, for example a paused terminal"
        );
    }
}

/// Watches the loop from outside: progress and the state of the recorder. It renews the arm lease.
struct Supervisor {
    requests: RequestSender,
    lease: Arc<ArmLease>,
    health: Arc<Health>,
    progress: Arc<Progress>,
    max_unrecorded_ticks: u64,
    /// Why it has requested the end of the run, if it has.
    cause: Option<StopCause>,
}

impl Supervisor {
    /// Starts the loop and waits for its end. Signals reach the loop without this thread.
    fn wait_for_end(
        &mut self,
        prepared: PreparedLoop,
        stop_flags: &StopFlags,
        mut watch: impl FnMut(),
    ) -> Result<std::thread::Result<LoopOutcome>, RunError> {
        let signals = SignalFlags::set(stop_flags);
        let _signals = signals.map_err(RunError::system("start the supervisor of the run"))?;
        let thread = prepared.begin();
        while !thread.is_finished() {
            self.lease.renew();
            watch();
            self.watch_recording();
            std::thread::sleep(SUPERVISION_PERIOD);
        }
        Ok(thread.join())
    }

    /// Ends a run that cannot be recorded any more. If there is no room for the request, it is sent again.
    fn watch_recording(&mut self) {
        if let Some(cause) = self.recording_defect()
            && self.cause.is_none()
            && self.requests.send(Request::Finish).is_ok()
        {
            self.cause = Some(cause);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::DiskState;
    use crate::rt::record::{LoopMessage, TickRecord};

    #[test]
    fn refuses_a_run_that_leaves_less_than_100_megabytes_free() {
        let folder = Path::new("somewhere");
        let free = |free_bytes| require_space(folder, 72_000_000, free_bytes);
        assert!(free(Some(172_000_000)).is_ok());
        assert!(free(None).is_ok(), "unknown");
        let refused = free(Some(171_999_999)).unwrap_err().to_string();
        for part in ["somewhere", "172.0 MB", "72.0 MB", "100 MB", "--out"] {
            assert!(refused.contains(part), "{part}: {refused}");
        }
        assert!(require_space(folder, u64::MAX, Some(u64::MAX - 1)).is_err());
    }

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
                cause: None,
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
        let recorder = recording::spawn(recorder, records, disk).unwrap();
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
            cause: None,
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
