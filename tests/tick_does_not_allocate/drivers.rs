//! The drivers' part of a tick makes no system call but one write for each frame, and the clock. The drivers run with their threads on
//! sockets and on a pseudo terminal; then a forked child calls them as the loop does, where the kernel allows no other call. In the
//! child the threads of the driver no longer run, so that it also reaches the fault of a thread that hangs.
use std::os::unix::net::UnixDatagram;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use assert_no_alloc::assert_no_alloc;
use bench_config::{Config, Source, load};
use bench_hal::can::bus::{BusError, BusEvent, CanBus, Port, SystemHost};
use bench_hal::can::{CanFrame, Id};
use bench_hal::{AmplifierStatus, CurrentAmplifier, DisplacementProbe, Tick, Validity, blocking};
use bench_rig::devices::{self, Requirements};
use bench_rig::emulator::{AmplifierServer, EventLog, ProbeEndpoint, ProbeServer, Stage};

use crate::system_calls::{Termination, allow_only, in_child_process};

/// Ends the distribution of frames, after a failed assertion as well.
struct StopOnDrop<'a>(&'a AtomicBool);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Ends of the sockets at which the frames of the endpoints arrive.
type Wires = Arc<Mutex<Vec<UnixDatagram>>>;

/// A bus of sockets, as SocketCAN: an endpoint sends a frame with one system call. A thread distributes the frames.
#[derive(Clone, Default)]
struct SocketBus {
    wires: Wires,
}

impl SocketBus {
    /// Distributes the frames until `stop` is set.
    fn distribute(&self, stop: &AtomicBool) {
        let mut frame = [0; 13];
        while !stop.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_micros(100));
            let wires = self.wires.lock().expect("no test panics with it");
            for (index, from) in wires.iter().enumerate() {
                while let Ok(length) = from.recv(&mut frame) {
                    let others = wires
                        .iter()
                        .enumerate()
                        .filter(|(other, _)| *other != index);
                    // A full socket loses the frame, as an interface does.
                    others.for_each(|(_, to)| drop(to.send(&frame[..length])));
                }
            }
        }
    }
}

impl Port for SocketBus {
    fn endpoint(&self, ids: &[Id]) -> Result<Box<dyn CanBus>, BusError> {
        let (socket, wire) = UnixDatagram::pair().map_err(|error| BusError::from_io(&error))?;
        for end in [&socket, &wire] {
            end.set_nonblocking(true)
                .map_err(|error| BusError::from_io(&error))?;
        }
        self.wires
            .lock()
            .expect("no test panics with it")
            .push(wire);
        let ids = ids.to_vec();
        Ok(Box::new(SocketEnd { socket, ids }))
    }
}

struct SocketEnd {
    socket: UnixDatagram,
    ids: Vec<Id>,
}

impl CanBus for SocketEnd {
    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        let (mut bytes, data) = ([0; 13], frame.data());
        bytes[0] = u8::from(frame.id().is_extended());
        bytes[1..5].copy_from_slice(&frame.id().raw().to_le_bytes());
        bytes[5..5 + data.len()].copy_from_slice(data);
        let sent = self.socket.send(&bytes[..5 + data.len()]);
        sent.map(drop).map_err(|error| BusError::from_io(&error))
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<BusEvent>, BusError> {
        let mut bytes = [0; 13];
        if let Ok(length) = self.socket.recv(&mut bytes) {
            let raw = u32::from_le_bytes([bytes[1], bytes[2], bytes[3], bytes[4]]);
            let id = match bytes[0] {
                0 => Id::standard(raw as u16),
                _ => Id::extended(raw),
            };
            let frame = CanFrame::from_slice(id, &bytes[5..length]);
            return Ok(frame
                .filter(|_| self.ids.is_empty() || self.ids.contains(&id))
                .map(BusEvent::Frame));
        }
        std::thread::sleep(timeout.min(Duration::from_micros(200)));
        Ok(None)
    }
}

fn lab(sets: &[String]) -> Config {
    load(&Source {
        config: Some("lab".into()),
        sets: sets.to_vec(),
        ..Source::default()
    })
    .expect("the profile is valid")
}

/// Exit code of a child in which the amplifier accepted no command.
const NO_COMMAND: i32 = 2;
/// Attempts to enter the child with an enabled amplifier: on a busy machine the threads of driver and emulator may be late.
const ATTEMPTS: usize = 200;

/// All calls of a tick; whether the amplifier accepted its command, which is then a write to a socket.
fn calls_of_a_tick(drive: &mut dyn CurrentAmplifier) -> bool {
    let _ = (drive.status(), drive.actual_current_a());
    let _ = drive.rounded_a(0.1);
    let is_accepted = drive.command(0.1).is_ok();
    if let AmplifierStatus::Fault(code) = drive.status() {
        let _ = drive.explain(code);
    }
    is_accepted
}

/// Ticks with current, then the fault of the hung thread, then all calls of stopping, resetting and arming.
fn drive_in_the_child(drive: &mut dyn CurrentAmplifier) {
    allow_only(&[libc::SYS_write, libc::SYS_clock_gettime]);
    assert_no_alloc(|| {
        if !calls_of_a_tick(drive) {
            // SAFETY: ends the child at once.
            unsafe { libc::_exit(NO_COMMAND) };
        }
        while !matches!(drive.status(), AmplifierStatus::Fault(_)) {
            calls_of_a_tick(drive);
        }
        for _ in 0..100 {
            drive.disable();
            let _ = (drive.begin_reset(), drive.poll_reset());
            let _ = (drive.begin_enable(), drive.poll_enable());
            calls_of_a_tick(drive);
        }
    });
}

/// Enables the amplifier and calls it in a child. The child repeats until the amplifier is enabled there.
fn termination_with_current(drive: &mut dyn CurrentAmplifier) -> Termination {
    for _ in 0..ATTEMPTS {
        let _ = blocking::reset_fault(drive, std::thread::sleep);
        if blocking::enable(drive, std::thread::sleep).is_err() {
            continue;
        }
        let termination = in_child_process(|| drive_in_the_child(drive));
        if termination != Termination::Exit(NO_COMMAND) {
            return termination;
        }
    }
    Termination::Exit(NO_COMMAND)
}

#[test]
fn can_drivers_only_write_frames_and_read_the_clock() {
    let vesc =
        "amplifier.device={ kind = \"vesc\", interface = \"can0\", bit_rate = 500000, node = 23 }";
    for sets in [&[][..], &[vesc.to_string()]] {
        let (config, bus, stop) = (lab(sets), SocketBus::default(), AtomicBool::new(false));
        std::thread::scope(|scope| {
            scope.spawn(|| bus.distribute(&stop));
            let _stop = StopOnDrop(&stop);
            let host = || SystemHost::new(bus.clone());
            let mut listener = bus.endpoint(&[]).expect("a socket");
            let stage = Stage::new(&config).expect("a stage");
            let device = &config.amplifier.device;
            let server = AmplifierServer::start(device, Arc::new(host()), stage, EventLog::new().0);
            let _server = server.expect("it starts");
            // A drive announces its start: a driver that is open by then would report a restart.
            while listener.receive(Duration::from_millis(1)) == Ok(None) {}
            let requirements = Requirements::new(&config.amplifier, &config.servo);
            let driver = devices::can_amplifier(device).expect("a real device");
            let opened = driver.open(requirements, Box::new(host()));
            let mut drive = opened.expect("it opens").0;
            let termination = termination_with_current(&mut *drive);
            assert_eq!(termination, Termination::Exit(0), "{}", device.kind());
        });
    }
}

#[test]
fn serial_driver_only_reads_the_clock() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let port = folder.path().join("probe");
    let line = format!(
        "{{ port = {port:?}, baud = 115200, lock_folder = {:?} }}",
        folder.path()
    );
    let device = format!(
        "probe.device={{ kind = \"ascii\", line = {line}, mounting = {{ gain = 1.0, offset_m = 0.0 }}, \
         pattern = \"{{value:9.5}}\", unit_m = 1e-3, lower_m = -2e-3, upper_m = 2e-3 }}"
    );
    let config = lab(&[
        "loop.rate_hz=200".into(),
        "probe.rate_hz=200".into(),
        "probe.transport_s=0.002".into(),
        device,
    ]);
    let stage = Stage::new(&config).expect("a stage");
    let endpoint = ProbeEndpoint::Terminal(Some(port));
    let start = std::time::Instant::now();
    let now_ns = move || start.elapsed().as_nanos() as u64;
    let _server = ProbeServer::start(&config, &endpoint, None, stage, now_ns).expect("a terminal");
    let mut probe = devices::probe::open(&config.probe, config.servo.priority).expect("it opens");
    while probe.latest(Tick::default()).validity != Validity::Valid {
        std::thread::sleep(Duration::from_millis(1));
    }
    let termination = in_child_process(|| {
        allow_only(&[libc::SYS_clock_gettime]);
        assert_no_alloc(|| {
            for _ in 0..10_000 {
                let reading = probe.latest(Tick::default());
                assert!(reading.validity == Validity::Valid && reading.sequence > 0);
            }
        });
    });
    assert_eq!(termination, Termination::Exit(0));
}

/// What a driver must not do in its command.
#[derive(Clone, Copy, Debug)]
enum Wrong {
    Sleeps,
    Prints,
}

impl CurrentAmplifier for Wrong {
    fn begin_enable(&mut self) -> Result<(), bench_hal::DeviceError> {
        Ok(())
    }
    fn poll_enable(&mut self) -> std::task::Poll<Result<(), bench_hal::DeviceError>> {
        std::task::Poll::Ready(Ok(()))
    }
    fn command(&mut self, current_a: f64) -> Result<f64, bench_hal::DeviceError> {
        match self {
            Wrong::Sleeps => std::thread::sleep(Duration::from_micros(1)),
            // SAFETY: writes zero bytes.
            Wrong::Prints => drop(unsafe { libc::write(2, std::ptr::null(), 0) }),
        }
        Ok(current_a)
    }
    fn disable(&mut self) {}
    fn status(&self) -> AmplifierStatus {
        AmplifierStatus::Enabled
    }
}

#[test]
fn detects_a_driver_that_sleeps_or_prints_in_its_command() {
    for mut wrong in [Wrong::Sleeps, Wrong::Prints] {
        let termination = in_child_process(|| drive_in_the_child(&mut wrong));
        assert_eq!(termination, Termination::Signal(libc::SIGSYS), "{wrong:?}");
    }
}
