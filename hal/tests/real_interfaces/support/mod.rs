//! The driver and the emulated drive on real interfaces, and functions that wait for them.

pub mod adapter;
pub mod python;
pub mod vcan;

use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use bench_hal::blocking;
use bench_hal::can::bus::{Host, Port, SocketPort, SystemHost, TaskHandle};
use bench_hal::can::cia402::State;
use bench_hal::can::drive::{CanopenDrive, DriveSettings, DriveTimes, OpenError};
use bench_hal::can::emulator::{
    AmplifierTask, DeviceFault, EmulatedAmplifier, EmulatedDrive, EmulatedDriveSettings,
};
use bench_hal::can::heartbeat;
use bench_hal::{AmplifierStatus, CurrentAmplifier};
use std::thread::sleep;

pub const BIT_RATE: u32 = 1_000_000;

/// A test that waits longer than this has failed.
const LIMIT: Duration = Duration::from_secs(30);

/// The default settings with longer time limits, because the virtual machine may pause for 0.1 s.
pub fn settings() -> DriveSettings {
    let ms = Duration::from_millis;
    DriveSettings {
        times: DriveTimes {
            heartbeat_timeout: ms(800),
            own_heartbeat_timeout: ms(600),
            status_timeout: ms(400),
            command_timeout: ms(400),
            sdo_timeout: ms(3000),
            state_timeout: ms(5000),
            pass_timeout: ms(400),
            ..DriveTimes::default()
        },
        ..DriveSettings::default()
    }
}

/// The host with interface `name`, in real time.
pub fn host(name: &str) -> SystemHost<SocketPort> {
    SystemHost::new(SocketPort::open(name, BIT_RATE).unwrap())
}

pub fn open(name: &str, settings: DriveSettings) -> Result<CanopenDrive, OpenError> {
    CanopenDrive::open(settings, Box::new(host(name)))
}

/// The error of an opening that must fail.
pub fn refusal(name: &str, settings: DriveSettings) -> String {
    open(name, settings)
        .err()
        .expect("this must not open")
        .to_string()
}

pub fn wait_for(what: &str, mut condition: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed() < LIMIT, "never: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// A running simulated drive on a bus.
pub struct FarEnd {
    device: Arc<Mutex<EmulatedDrive>>,
    running: TaskHandle,
}

impl FarEnd {
    /// A drive directly after power-on, on interface `name`. Returns after its boot-up message, which a driver would take for a
    /// restart.
    pub fn new(name: &str, host: &dyn Host) -> FarEnd {
        let mut bus = self::host(name).endpoint(&[heartbeat::cob_id(5)]).unwrap();
        let far_end = FarEnd::start(
            host,
            Arc::new(Mutex::new(EmulatedDrive::new(
                EmulatedDriveSettings::default(),
            ))),
        );
        wait_for("the drive has started", || {
            bus.receive(Duration::from_secs(1)).unwrap().is_some()
        });
        far_end
    }

    /// The same drive, connected to another bus.
    pub fn moved_to(self, host: &dyn Host) -> FarEnd {
        let FarEnd { device, running } = self;
        drop(running);
        FarEnd::start(host, device)
    }

    fn start(host: &dyn Host, device: Arc<Mutex<EmulatedDrive>>) -> FarEnd {
        let running = AmplifierTask::start(host, Arc::clone(&device)).unwrap();
        FarEnd { device, running }
    }

    pub fn device(&self) -> MutexGuard<'_, EmulatedDrive> {
        self.device.lock().unwrap()
    }

    pub fn current_a(&self) -> f64 {
        self.device().current_a()
    }

    /// Waits until no current flows because the drive itself is off.
    pub fn wait_until_off(&self) {
        wait_for("the drive is off", || {
            let device = self.device();
            device.current_a() == 0.0 && !matches!(device.power_state(), State::OperationEnabled)
        });
    }
}

/// A driver connected to a simulated drive.
pub struct Rig {
    pub drive: CanopenDrive,
    pub far_end: FarEnd,
}

impl Rig {
    /// The driver on interface `name`, the drive on `far_host`.
    pub fn new(name: &str, far_host: &dyn Host, settings: DriveSettings) -> Rig {
        let far_end = FarEnd::new(name, far_host);
        let drive = open(name, settings).unwrap_or_else(|error| panic!("{error}"));
        Rig { drive, far_end }
    }

    /// Commands `current_a` repeatedly until `done`.
    fn command_until(&mut self, current_a: f64, what: &str, done: impl Fn(&Rig) -> bool) {
        wait_for(what, || {
            let _ = self.drive.command(current_a); // refused in the tick in which a fault is found
            done(self)
        });
    }

    /// Asserts that the driver returns `applied_a` for `command_a`, and that the drive reaches and reports it.
    pub fn assert_current(&mut self, command_a: f64, applied_a: f64) {
        assert_eq!(self.drive.command(command_a), Ok(applied_a));
        let near = |current_a: f64| (current_a - applied_a).abs() < 1e-9;
        self.command_until(
            command_a,
            &format!("{applied_a} A flow and are reported"),
            |rig| near(rig.far_end.current_a()) && rig.drive.actual_current_a().is_some_and(near),
        );
        assert_eq!(self.drive.status(), AmplifierStatus::Enabled);
    }

    pub fn enabled(mut self) -> Rig {
        blocking::enable(&mut self.drive, sleep).unwrap();
        self.assert_current(1.0, 1.0);
        self
    }

    /// Commands a current until a fault is reported, and returns its code. Afterwards commands are refused and no current flows.
    pub fn fault(&mut self) -> u32 {
        self.command_until(1.0, "a fault", |rig| {
            matches!(rig.drive.status(), AmplifierStatus::Fault(_))
        });
        let AmplifierStatus::Fault(code) = self.drive.status() else {
            panic!("the fault did not persist")
        };
        self.far_end.wait_until_off();
        assert!(
            self.drive.command(1.0).is_err(),
            "commands must be refused after a fault"
        );
        assert!(
            blocking::enable(&mut self.drive, sleep).is_err(),
            "enabling must not clear a fault"
        );
        code
    }

    /// Removes the cause and clears the fault. The drive is then off, and is enabled only on request.
    pub fn assert_recovers(&mut self) {
        self.far_end.device().inject(DeviceFault::None);
        blocking::reset_fault(&mut self.drive, sleep)
            .unwrap_or_else(|error| panic!("{error}: {:?}", self.drive.last_error()));
        assert_eq!(
            (self.drive.status(), self.far_end.current_a()),
            (AmplifierStatus::Disabled, 0.0)
        );
        blocking::enable(&mut self.drive, sleep).unwrap();
        assert_eq!(
            self.far_end.current_a(),
            0.0,
            "an old command must not take effect"
        );
        self.assert_current(0.5, 0.5);
    }
}
