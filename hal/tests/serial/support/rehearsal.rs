//! An emulated probe behind a pseudo terminal, and the driver in front of it.

use std::path::PathBuf;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use bench_hal::serial::emulator::{EmulatedProbe, Fault, Line, ProbeTask, SharedProbe};
use bench_hal::serial::{PortSettings, ProbeSettings, Protocol, SerialProbe, Statistics};
use bench_hal::{DisplacementProbe, Reading, Tick};

/// A test that waits longer than this has failed.
const LIMIT: Duration = Duration::from_secs(60);
/// Baud rate in bit/s.
const BAUD: u32 = 921_600;

/// Position of the stage, in metres of the probe, at a time in nanoseconds of the rehearsal's clock.
pub type Motion = fn(u64) -> f64;

/// A probe on a pseudo terminal, with a clock that starts with it.
pub struct Rehearsal {
    pub path: PathBuf,
    pub locks: tempfile::TempDir,
    protocol: Arc<dyn Protocol>,
    started: Instant,
    probe: SharedProbe,
    task: Option<ProbeTask>,
}

impl Rehearsal {
    /// A probe that takes `rate_hz` measurements per second of a stage with this motion.
    pub fn new(protocol: &Arc<dyn Protocol>, rate_hz: f64, motion: Motion) -> Self {
        Self::with_fault(protocol, rate_hz, motion, Fault::None)
    }

    /// The same with a fault from the start.
    pub fn with_fault(
        protocol: &Arc<dyn Protocol>,
        rate_hz: f64,
        motion: Motion,
        fault: Fault,
    ) -> Self {
        let line = Line::terminal(PortSettings::new("", BAUD)).unwrap();
        let (path, started) = (line.path().to_owned(), Instant::now());
        let mut probe = EmulatedProbe::new(&**protocol, rate_hz).unwrap();
        probe.inject_fault(fault);
        let probe: SharedProbe = Arc::new(Mutex::new(probe));
        let now_ns = move || started.elapsed().as_nanos() as u64;
        let task = ProbeTask::start(line, Arc::clone(&probe), now_ns, motion, || {});
        Self {
            path,
            locks: tempfile::tempdir().unwrap(),
            protocol: Arc::clone(protocol),
            started,
            probe,
            task: Some(task.unwrap()),
        }
    }

    /// Settings of the driver for this probe.
    pub fn settings(&self) -> ProbeSettings {
        let port = PortSettings {
            lock_dir: self.locks.path().into(),
            ..PortSettings::new(&self.path, BAUD)
        };
        ProbeSettings::new(port, Arc::clone(&self.protocol))
    }

    /// The driver for this probe.
    pub fn open(&self) -> SerialProbe {
        SerialProbe::open(self.settings()).unwrap()
    }

    pub fn inject_fault(&self, fault: Fault) {
        self.probe.lock().unwrap().inject_fault(fault);
    }

    pub fn now_ns(&self) -> u64 {
        self.started.elapsed().as_nanos() as u64
    }

    /// Bytes that the probe has sent.
    pub fn sent(&self) -> u64 {
        self.task
            .as_ref()
            .map_or(0, |task| task.counts().sent.load(Relaxed))
    }

    /// Disconnects the cable: the terminal hangs up.
    pub fn unplug(&mut self) {
        self.task = None;
    }
}

/// Waits until `condition` holds. Panics after the time limit.
pub fn wait_for(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < LIMIT, "not reached: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// The present reading.
pub fn latest(probe: &mut SerialProbe) -> Reading {
    probe.latest(Tick::default())
}

/// Reads until `condition` holds, and checks that the sequence never decreases. Panics after the time limit.
pub fn until(
    probe: &mut SerialProbe,
    what: &str,
    mut condition: impl FnMut(&Reading, &Statistics) -> bool,
) -> Reading {
    let (start, mut previous) = (Instant::now(), latest(probe));
    while start.elapsed() < LIMIT {
        let (reading, statistics) = (latest(probe), probe.statistics());
        assert!(
            reading.sequence >= previous.sequence,
            "{previous:?} before {reading:?}"
        );
        if condition(&reading, &statistics) {
            return reading;
        }
        previous = reading;
        std::thread::sleep(Duration::from_micros(200));
    }
    panic!(
        "not reached: {what}: {:?} {:?}",
        latest(probe),
        probe.statistics()
    );
}

/// Waits until `count` more measurements have been published than at the call.
pub fn more(probe: &mut SerialProbe, count: u64) -> Reading {
    let before = probe.statistics().published;
    until(probe, "more readings", |_, statistics| {
        statistics.published >= before + count
    })
}
