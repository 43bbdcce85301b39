//! The calls of a tick do not allocate, in any state of the drive.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use bench_hal::can::budget::Exchange;
use bench_hal::can::bus::{
    BusError, BusEvent, CanBus, Host, Port, SimulatedHost, Task, TaskHandle,
};
use bench_hal::can::drive::{CanopenDrive, DriveSettings};
use bench_hal::can::emulator::{
    AmplifierTask, DeviceFault, EmulatedAmplifier, EmulatedDrive, EmulatedDriveSettings,
};
use bench_hal::can::{CanFrame, Id};
use bench_hal::{AmplifierStatus, CurrentAmplifier};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

/// A host whose endpoints can discard sent frames, because the bus in memory allocates for each frame. A socket does not.
struct DiscardingHost {
    inner: SimulatedHost,
    discard: Arc<AtomicBool>,
}

impl Port for DiscardingHost {
    fn endpoint(&self, ids: &[Id]) -> Result<Box<dyn CanBus>, BusError> {
        Ok(Box::new(DiscardingEndpoint {
            inner: self.inner.endpoint(ids)?,
            discard: Arc::clone(&self.discard),
        }))
    }
}

impl Host for DiscardingHost {
    fn now_ns(&self) -> u64 {
        self.inner.now_ns()
    }
    fn sleep(&self, time: Duration) {
        self.inner.sleep(time);
    }
    fn start(&self, name: &str, task: Box<dyn Task>) -> std::io::Result<TaskHandle> {
        self.inner.start(name, task)
    }
}

struct DiscardingEndpoint {
    inner: Box<dyn CanBus>,
    discard: Arc<AtomicBool>,
}

impl CanBus for DiscardingEndpoint {
    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        if self.discard.load(Ordering::Acquire) {
            Ok(())
        } else {
            self.inner.send(frame)
        }
    }
    fn receive(&mut self, timeout: Duration) -> Result<Option<BusEvent>, BusError> {
        self.inner.receive(timeout)
    }
}

/// All calls of a tick, without sending a frame.
fn tick(drive: &mut CanopenDrive, discard: &AtomicBool) {
    discard.store(true, Ordering::Release);
    assert_no_alloc(|| {
        let _ = (drive.begin_enable(), drive.poll_enable());
        let _ = (drive.command(0.5), drive.command(f64::NAN));
        let _ = (drive.status(), drive.actual_current_a());
        if let AmplifierStatus::Fault(code) = drive.status() {
            let _ = drive.explain(code);
        }
    });
    discard.store(false, Ordering::Release);
}

#[test]
fn command_status_and_disable_do_not_allocate() {
    for exchange in [
        Exchange::Asynchronous { status_hz: 500.0 },
        Exchange::Synchronous { status_every: 1 },
    ] {
        let (simulated, discard) = (SimulatedHost::default(), Arc::new(AtomicBool::new(false)));
        let device = Arc::new(Mutex::new(EmulatedDrive::new(
            EmulatedDriveSettings::default(),
        )));
        let _running = AmplifierTask::start(&simulated, Arc::clone(&device)).unwrap();
        let host = DiscardingHost {
            inner: simulated.clone(),
            discard: Arc::clone(&discard),
        };
        let settings = DriveSettings {
            exchange,
            ..DriveSettings::default()
        };
        let mut drive = CanopenDrive::open(settings, Box::new(host)).unwrap();
        tick(&mut drive, &discard); // off
        bench_hal::blocking::enable(&mut drive, |time| simulated.sleep(time)).unwrap();
        tick(&mut drive, &discard); // on
        device.lock().unwrap().inject(DeviceFault::Drive(0x2310));
        simulated.sleep(Duration::from_millis(10));
        assert_eq!(drive.status(), AmplifierStatus::Fault(0x0001_2310));
        tick(&mut drive, &discard); // in fault
        discard.store(true, Ordering::Release);
        assert_no_alloc(|| drive.disable());
        discard.store(false, Ordering::Release);
    }
}
