//! A pretend probe behind a pseudo terminal, in a thread of its own, and the driver in front of it.

use std::path::PathBuf;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use bench_hal::serial::emulator::{Fault, Line, ProbeTask, SharedProbe, simulate};
use bench_hal::serial::{PortSettings, ProbeSettings, Protocol, SerialProbe, Statistics};
use bench_hal::{DisplacementProbe, Reading, Tick};

/// Nothing here may take so long; only a test that hangs meets it.
const HANGS: Duration = Duration::from_secs(60);
/// Bits a second.
const BAUD: u32 = 921_600;

/// Where the stage is at a time (nanoseconds of the rehearsal's clock), in metres of the probe.
pub type Motion = fn(u64) -> f64;

/// A probe on a pseudo terminal. The clock starts with it.
pub struct Rehearsal {
    pub path: PathBuf,
    pub locks: tempfile::TempDir,
    started: Instant,
    device: SharedProbe,
    task: Option<ProbeTask>,
}

impl Rehearsal {
    /// A probe that makes `rate_hz` measurements a second of a stage that moves so.
    pub fn new(protocol: &Protocol, rate_hz: f64, motion: Motion) -> Self {
        let line = Line::terminal(PortSettings::new("", BAUD)).unwrap();
        let (path, started) = (line.path().to_owned(), Instant::now());
        let device: SharedProbe = Arc::new(Mutex::new(simulate(protocol, rate_hz).unwrap()));
        let now_ns = move || started.elapsed().as_nanos() as u64;
        let task =
            Some(ProbeTask::start(line, Arc::clone(&device), now_ns, motion, || {}).unwrap());
        let locks = tempfile::tempdir().unwrap();
        Self {
            path,
            locks,
            started,
            device,
            task,
        }
    }

    /// Settings of the driver for this probe.
    pub fn settings(&self, protocol: &Protocol) -> ProbeSettings {
        let port = PortSettings {
            lock_dir: self.locks.path().into(),
            ..PortSettings::new(&self.path, BAUD)
        };
        ProbeSettings::new(port, protocol.clone())
    }

    /// The driver in front of this probe.
    pub fn open(&self, protocol: &Protocol) -> SerialProbe {
        SerialProbe::open(self.settings(protocol)).unwrap()
    }

    pub fn inject_fault(&self, fault: Fault) {
        self.device.lock().unwrap().inject_fault(fault);
    }

    pub fn now_ns(&self) -> u64 {
        self.started.elapsed().as_nanos() as u64
    }

    /// Bytes that the probe has sent.
    pub fn sent(&self) -> u64 {
        self.task
            .as_ref()
            .map_or(0, |task| task.carried().sent.load(Relaxed))
    }

    /// Pulls the cable: the terminal hangs up.
    pub fn unplug(&mut self) {
        self.task = None;
    }
}

/// The reading now.
pub fn latest(probe: &mut SerialProbe) -> Reading {
    probe.latest(Tick::default())
}

/// Watches the probe until a reading pleases, checking that its sequence never falls; panics if none ever does.
pub fn until(
    probe: &mut SerialProbe,
    what: &str,
    mut pleases: impl FnMut(&Reading, &Statistics) -> bool,
) -> Reading {
    let (begun, mut before) = (Instant::now(), latest(probe));
    while begun.elapsed() < HANGS {
        let (reading, statistics) = (latest(probe), probe.statistics());
        assert!(
            reading.sequence >= before.sequence,
            "{before:?} before {reading:?}"
        );
        if pleases(&reading, &statistics) {
            return reading;
        }
        before = reading;
        std::thread::sleep(Duration::from_micros(200));
    }
    panic!("never {what}: {:?} {:?}", latest(probe), probe.statistics());
}

/// Waits until so many more measurements have been handed out than at the call.
pub fn more(probe: &mut SerialProbe, count: u64) -> Reading {
    let before = probe.statistics().published;
    until(probe, "more readings", |_, statistics| {
        statistics.published >= before + count
    })
}
