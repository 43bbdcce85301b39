//! A probe at the other end of a real serial line: two cross-connected UARTs (16550, emulated), 8E1.
//!
//! The probe uses 230400 baud, but an emulated 16550 supports at most 115200, so the tests use that. The emulated line has no
//! parity bit: the kernel reports the parity setting of both chips, and the emulated probe produces the damaged bytes.

use std::io::{Read, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bench_hal::serial::emulator::{EmulatedProbe, Fault, SharedProbe};
use bench_hal::serial::{
    Parity, Polling, PortSettings, ProbeSettings, Protocol, SerialProbe, Statistics, capancdt,
};
use bench_hal::{DisplacementProbe, Reading, Tick, Validity};
use nix::sys::termios::{ControlFlags, tcgetattr};
use serialport::SerialPort;

use crate::support::wait_for;

const BAUD: u32 = 115_200;
const HERE: &str = "/dev/ttyS2";
const THERE: &str = "/dev/ttyS3";
const RANGE_M: f64 = 200e-6;
const POSITION_M: f64 = 60e-6;

/// A capaNCDT at the far end, with the stage at rest.
struct FarProbe {
    probe: SharedProbe,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl FarProbe {
    fn new(protocol: &Arc<dyn Protocol>) -> FarProbe {
        let line = serialport::new(THERE, BAUD)
            .parity(serialport::Parity::Even)
            .timeout(Duration::from_millis(1));
        let line = line
            .open_native()
            .expect("two UARTs: use .ci/vm/run --uart-pair");
        assert_eq!(line.parity().unwrap(), serialport::Parity::Even);
        let probe = Arc::new(Mutex::new(EmulatedProbe::new(&**protocol, 200.0).unwrap()));
        let stop = Arc::new(AtomicBool::new(false));
        let serving = (Arc::clone(&probe), Arc::clone(&stop));
        let thread = Some(std::thread::spawn(move || {
            serve(line, &serving.0, &serving.1)
        }));
        FarProbe {
            probe,
            stop,
            thread,
        }
    }

    fn inject_fault(&self, fault: Fault) {
        self.probe.lock().unwrap().inject_fault(fault);
    }
}

impl Drop for FarProbe {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        self.thread
            .take()
            .into_iter()
            .for_each(|thread| thread.join().unwrap());
    }
}

fn serve(mut line: serialport::TTYPort, probe: &SharedProbe, stop: &AtomicBool) {
    let (started, mut bytes) = (Instant::now(), [0; 64]);
    while !stop.load(Ordering::Acquire) {
        let count = line.read(&mut bytes).unwrap_or(0); // 0 after a timeout
        let now_ns = started.elapsed().as_nanos() as u64;
        let answer = probe
            .lock()
            .unwrap()
            .handle(&bytes[..count], now_ns, POSITION_M);
        line.write_all(&answer).unwrap();
    }
}

/// Reads until `condition` holds. Every reading must be correct or not valid.
fn read_until(
    probe: &mut SerialProbe,
    what: &str,
    mut condition: impl FnMut(&Reading, &Statistics) -> bool,
) -> Reading {
    let (mut reading, mut sequence) = (Reading::default(), 0);
    wait_for(what, || {
        reading = probe.latest(Tick::default());
        let is_correct = (reading.position_m - POSITION_M).abs() < 0.05e-6;
        assert!(
            reading.validity != Validity::Valid || is_correct,
            "a wrong value: {reading:?}"
        );
        assert!(
            reading.sequence >= sequence,
            "{sequence} before {reading:?}"
        );
        sequence = reading.sequence;
        condition(&reading, &probe.statistics())
    });
    reading
}

/// Waits for `more` further valid readings.
fn read_more(probe: &mut SerialProbe, more: u64) {
    let goal = probe.statistics().published + more;
    read_until(probe, "readings", |reading, statistics| {
        statistics.published >= goal && reading.validity == Validity::Valid
    });
}

/// Whether the chip is set to generate and check even parity.
fn is_even(path: &str) -> bool {
    let flags = tcgetattr(std::fs::File::open(path).unwrap())
        .unwrap()
        .control_flags;
    flags.contains(ControlFlags::PARENB) && !flags.contains(ControlFlags::PARODD)
}

fn settings(protocol: &Arc<dyn Protocol>, locks: &Path) -> ProbeSettings {
    let port = PortSettings {
        parity: Parity::Even,
        lock_dir: locks.into(),
        ..PortSettings::new(HERE, BAUD)
    };
    ProbeSettings::new(port, Arc::clone(protocol))
}

/// With time limits for a virtual machine that may pause: 1 s for an answer, which is complete after 200 ms of silence.
fn protocol() -> Arc<dyn Protocol> {
    Arc::new(capancdt::Settings {
        polling: Polling {
            timeout: Duration::from_secs(1),
            quiet: Duration::from_millis(200),
            ..Polling::default()
        },
        ..capancdt::Settings::new(RANGE_M)
    })
}

/// One test, because there is one pair of UARTs.
#[test]
fn probe_over_8e1_gives_no_wrong_value_with_damage_silence_and_restart() {
    let protocol = protocol();
    let (far, locks) = (FarProbe::new(&protocol), tempfile::tempdir().unwrap());
    let mut probe = SerialProbe::open(settings(&protocol, locks.path())).unwrap();
    assert!(
        probe
            .notes()
            .iter()
            .all(|note| !note.what.contains("parity")),
        "{:?}",
        probe.notes()
    );
    read_more(&mut probe, 50);
    assert!(is_even(HERE) && is_even(THERE));

    far.inject_fault(Fault::Corrupt { every: 251 }); // after a pause an answer has up to 93 bytes
    let damaged = probe.statistics().damaged_bytes;
    let goal = probe.statistics().published + 10;
    read_until(
        &mut probe,
        "damaged bytes and valid values",
        |_, statistics| statistics.damaged_bytes > damaged + 100 && statistics.published > goal,
    );

    far.inject_fault(Fault::Silence);
    let before = probe.statistics().timeouts;
    let last = read_until(&mut probe, "silence", |_, statistics| {
        statistics.timeouts >= before + 2
    });
    let error = probe.statistics().last_error.unwrap().to_string();
    assert!(
        error.contains("the probe did not answer") && error.contains("baud rate and parity"),
        "{error}"
    );
    assert!(
        last.age_ns > 1_000_000_000,
        "the age of an old value: {last:?}"
    );

    far.inject_fault(Fault::Reset);
    read_until(&mut probe, "the restart", |_, statistics| {
        statistics.restarts == 1
    });
    far.inject_fault(Fault::None);
    read_more(&mut probe, 20);
}
