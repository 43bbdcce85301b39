//! Runs a plan on a rig: threads, rings, signals, and a recording that is whole whatever happens.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

use bench_hal::Rig;
use rtrb::{Producer, RingBuffer};
use tokio::signal::unix::Signal;

use super::file_name;
use super::plan::{KIND, Plan};
use super::run_error::RunError;
use super::signals::signals;
use crate::recording::{self, Header, Health, Recorder, RecordingError, Totals};
use crate::rt::interlock::Interlocks;
use crate::rt::program::Program;
use crate::rt::publisher::Publisher;
use crate::rt::record::REQUESTS_PER_TICK;
use crate::rt::servo::{Connections, Progress, Request, Servo};
use crate::rt::thread::{LoopOutcome, Pace, PreparedLoop, Scheduling, prepare};

/// Slots of the ring to the recorder: 13 s at 5 kHz, should the disk hang for a while.
const RING_SLOTS: usize = 1 << 16;
/// Seconds recorded after the motor went off.
const TAIL_S: f64 = 0.1;
/// How often the supervisor looks.
const BEAT: Duration = Duration::from_millis(5);

/// A run that came to an end, its recording still open for results.
pub struct Run {
    /// The file.
    pub path: PathBuf,
    /// How the loop ended.
    pub ended: LoopOutcome,
    /// Its pace.
    pub pace: Pace,
    /// How it was scheduled.
    pub scheduling: Scheduling,
    /// Whether a person (or the system) stopped it.
    pub stopped: bool,
    recorder: Recorder,
}

impl Run {
    /// What is in the recording so far: all ticks.
    pub fn totals(&mut self) -> Result<Totals, RecordingError> {
        self.recorder.complete()
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
    let program = plan.program()?;
    let total_ticks = program.ticks();
    let (publisher, records) = RingBuffer::new(RING_SLOTS);
    let (mut requests, taken) = RingBuffer::new(REQUESTS_PER_TICK);
    let (retired, _kept_until_the_end) = RingBuffer::new(16);
    let progress = Arc::new(Progress::default());
    let connections = Connections {
        requests: taken,
        retired,
        publisher: Publisher::new(publisher),
        progress: Arc::clone(&progress),
    };
    let config = &plan.config;
    let interlocks = Interlocks::new(&config.interlock, &config.motor, &config.servo);
    let servo = Servo::new(rig, interlocks, connections);
    queue(&mut requests, program);
    let tail_ticks = (TAIL_S * plan.config.servo.rate_hz) as u64;
    let prepared =
        prepare(servo, &plan.config.servo, pace, tail_ticks).map_err(|e| RunError::System {
            what: "start the loop's thread",
            why: e.to_string(),
        })?;
    let recorder = create(plan, pace, &prepared, folder)?;
    let path = recorder.path().to_path_buf();
    let recorder = recording::spawn(recorder, records).map_err(RunError::Create)?;
    let scheduling = prepared.scheduling().clone();
    let mut supervisor = Supervisor {
        requests,
        health: recorder.health(),
        stopped: false,
    };
    let watching = || watch(progress.run_ticks.load(Ordering::Relaxed), total_ticks);
    let ended = supervisor.watch_over(prepared, watching)?;
    let recorder = recorder.join()?;
    let ended = ended.map_err(|_| RunError::LoopDied(path.clone()))?;
    Ok(Run {
        path,
        ended,
        pace,
        scheduling,
        stopped: supervisor.stopped,
        recorder,
    })
}

/// Arm and start: in the ring before the loop begins, so that they take effect at tick 0.
fn queue(requests: &mut Producer<Request>, program: Box<dyn Program>) {
    for order in [Request::Arm, Request::Start(program)] {
        // The ring is new and holds more than two.
        let _ = requests.push(order);
    }
}

/// The file, with everything that is known before the first tick.
fn create(
    plan: &Plan,
    pace: Pace,
    prepared: &PreparedLoop,
    folder: &Path,
) -> Result<Recorder, RunError> {
    let header = Header {
        config_toml: plan.config_toml()?,
        period_ns: libm::round(plan.config.servo.period_s() * 1e9) as u64,
        metadata: metadata(plan, pace, prepared.scheduling()),
    };
    std::fs::create_dir_all(folder).map_err(|e| RunError::Folder {
        folder: folder.into(),
        why: e.to_string(),
    })?;
    let path = file_name::recording(folder, &plan.label(), SystemTime::now());
    let mut recorder = Recorder::create(&path, &header).map_err(RunError::Create)?;
    for (name, media_type, text) in plan.attachments() {
        recorder
            .attach(name, media_type, text.as_bytes())
            .map_err(RunError::Create)?;
    }
    Ok(recorder)
}

fn metadata(plan: &Plan, pace: Pace, scheduling: &Scheduling) -> BTreeMap<String, String> {
    let file = |path: &str| {
        std::fs::read_to_string(path).map_or("unknown".into(), |text| text.trim().to_string())
    };
    let cpu = scheduling.cpu.map_or("any".into(), |cpu| cpu.to_string());
    let pairs = [
        (KIND, plan.kind.name().to_string()),
        ("program", format!("bench {}", env!("CARGO_PKG_VERSION"))),
        (
            "started",
            humantime::format_rfc3339_millis(SystemTime::now()).to_string(),
        ),
        ("host", file("/proc/sys/kernel/hostname")),
        ("kernel", file("/proc/sys/kernel/osrelease")),
        ("pace", pace.name().into()),
        ("policy", scheduling.policy.clone()),
        ("memory_locked", scheduling.memory_locked.to_string()),
        ("cpu", cpu),
        ("refused", scheduling.refused.join("\n")),
    ];
    pairs
        .into_iter()
        .chain(plan.devices.iter().cloned())
        .map(|(key, value)| (key.to_string(), value))
        .collect()
}

/// Watches from outside: signals, progress, the recorder's health.
struct Supervisor {
    requests: Producer<Request>,
    health: Arc<Health>,
    stopped: bool,
}

impl Supervisor {
    fn watch_over(
        &mut self,
        prepared: PreparedLoop,
        watch: impl FnMut(),
    ) -> Result<std::thread::Result<LoopOutcome>, RunError> {
        let system = |e: std::io::Error| RunError::System {
            what: "start the supervisor",
            why: e.to_string(),
        };
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(system)?;
        runtime.block_on(async {
            let signals = signals().map_err(system)?;
            let thread = prepared.begin();
            self.until_finished(&thread, signals, watch).await;
            Ok(thread.join())
        })
    }

    async fn until_finished(
        &mut self,
        thread: &JoinHandle<LoopOutcome>,
        signals: (Signal, Signal),
        mut watch: impl FnMut(),
    ) {
        let (mut interrupt, mut terminate) = signals;
        let mut beat = tokio::time::interval(BEAT);
        while !thread.is_finished() {
            tokio::select! {
                _ = beat.tick() => watch(),
                _ = interrupt.recv() => self.stop(),
                _ = terminate.recv() => self.stop(),
            }
            if self.health.failed() {
                self.stop();
            }
        }
    }

    /// Zero current at the next tick boundary. Said once; the loop takes it, or has ended.
    fn stop(&mut self) {
        if !self.stopped {
            self.stopped = self.requests.push(Request::Stop).is_ok();
        }
    }
}
