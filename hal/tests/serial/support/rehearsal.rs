//! A pretend probe behind a pseudo terminal, in a thread of its own, and the driver in front of it.

use std::os::fd::{AsFd, OwnedFd};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bench_hal::serial::device::{Fault, SimulatedProbe, simulate};
use bench_hal::serial::{PortSettings, ProbeSettings, Protocol, SerialProbe, Statistics};
use bench_hal::{DisplacementProbe, Reading, Tick};
use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::{read, ttyname, write};

/// Nothing here may take so long; only a test that hangs meets it.
const HANGS: Duration = Duration::from_secs(60);

/// Where the stage is at a time (nanoseconds of the rehearsal's clock), in metres of the probe.
pub type Motion = fn(u64) -> f64;

/// A probe on a pseudo terminal. The clock starts with it.
pub struct Rehearsal {
    pub path: PathBuf,
    pub locks: tempfile::TempDir,
    started: Instant,
    device: Arc<Mutex<Box<dyn SimulatedProbe>>>,
    unplugged: Arc<AtomicBool>,
    carrier: Option<JoinHandle<()>>,
}

impl Rehearsal {
    /// A probe that makes `rate_hz` measurements a second of a stage that moves so.
    pub fn new(protocol: &Protocol, rate_hz: f64, motion: Motion) -> Self {
        let pty = openpty(None, None).unwrap();
        let mut raw = tcgetattr(&pty.slave).unwrap();
        cfmakeraw(&mut raw);
        tcsetattr(&pty.slave, SetArg::TCSANOW, &raw).unwrap();
        fcntl(&pty.master, FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).unwrap();
        let path = ttyname(&pty.slave).unwrap();
        let device = Arc::new(Mutex::new(simulate(protocol, rate_hz).unwrap()));
        let (unplugged, started) = (Arc::new(AtomicBool::new(false)), Instant::now());
        let carrier = std::thread::spawn({
            let (device, unplugged) = (device.clone(), unplugged.clone());
            move || {
                let (master, _slave) = (pty.master, pty.slave); // the slave stays open: the line outlives the driver
                while !unplugged.load(Relaxed) {
                    carry(&master, &mut **device.lock().unwrap(), started, motion);
                    let _ = poll(&mut [PollFd::new(master.as_fd(), PollFlags::POLLIN)], PollTimeout::from(1u8));
                }
            }
        });
        let locks = tempfile::tempdir().unwrap();
        Self { path, locks, started, device, unplugged, carrier: Some(carrier) }
    }

    /// Settings of the driver for this probe.
    pub fn settings(&self, protocol: &Protocol) -> ProbeSettings {
        let port = PortSettings { lock_dir: self.locks.path().into(), ..PortSettings::new(&self.path, 921_600) };
        ProbeSettings::new(port, protocol.clone())
    }

    /// The driver in front of this probe.
    pub fn open(&self, protocol: &Protocol) -> SerialProbe {
        SerialProbe::open(self.settings(protocol)).unwrap()
    }

    pub fn ask_fault(&self, fault: Fault) {
        self.device.lock().unwrap().ask_fault(fault);
    }

    pub fn now_ns(&self) -> u64 {
        self.started.elapsed().as_nanos() as u64
    }

    /// Pulls the cable: the terminal hangs up.
    pub fn unplug(&mut self) {
        self.unplugged.store(true, Relaxed);
        self.carrier.take().into_iter().for_each(|carrier| carrier.join().unwrap());
    }
}

impl Drop for Rehearsal {
    fn drop(&mut self) {
        self.unplug();
    }
}

/// Carries bytes between the line and the probe.
fn carry(master: &OwnedFd, device: &mut dyn SimulatedProbe, started: Instant, motion: Motion) {
    let mut bytes = [0; 256];
    let count = read(master, &mut bytes).unwrap_or(0);
    let now_ns = started.elapsed().as_nanos() as u64;
    let mut answer = device.handle(&bytes[..count], now_ns, motion(now_ns));
    answer.extend(device.poll(now_ns, motion(now_ns)));
    let _ = write(master, &answer); // what a full line does not take is lost, as on a real one
}

/// The reading now.
pub fn latest(probe: &mut SerialProbe) -> Reading {
    probe.latest(Tick::default())
}

/// Watches the probe until a reading pleases, checking that its sequence never falls; panics if none ever does.
pub fn until(probe: &mut SerialProbe, what: &str, mut pleases: impl FnMut(&Reading, &Statistics) -> bool) -> Reading {
    let (begun, mut before) = (Instant::now(), latest(probe));
    while begun.elapsed() < HANGS {
        let (reading, statistics) = (latest(probe), probe.statistics());
        assert!(reading.sequence >= before.sequence, "{before:?} before {reading:?}");
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
    until(probe, "more readings", |_, statistics| statistics.published >= before + count)
}
