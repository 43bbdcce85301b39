//! The driver with the emulated drive, in simulated time.

mod any_frames;
mod bring_up;
mod failing;
#[cfg(loom)]
mod interleavings;
mod monitor;

use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use super::super::budget::Exchange;
use super::super::bus::{Host, SimulatedHost};
use super::super::cia402::State;
use super::super::emulator::{
    AmplifierTask, EmulatedAmplifier, EmulatedDrive, EmulatedDriveSettings,
};
use super::super::sdo::Address;
use super::*;

/// Driver and emulated drive on one bus.
struct Rig {
    drive: CanopenDrive,
    world: SimulatedHost,
    device: Arc<Mutex<EmulatedDrive>>,
    _running: TaskHandle,
}

fn open(settings: DriveSettings, device: EmulatedDriveSettings) -> Result<Rig, OpenError> {
    let world = SimulatedHost::default();
    let device = Arc::new(Mutex::new(EmulatedDrive::new(device)));
    let running = AmplifierTask::start(&world, Arc::clone(&device)).unwrap();
    let drive = CanopenDrive::open(settings, Box::new(world.clone()))?;
    Ok(Rig {
        drive,
        world,
        device,
        _running: running,
    })
}

const ASYNCHRONOUS: Exchange = Exchange::Asynchronous { status_hz: 500.0 };
const SYNCHRONOUS: Exchange = Exchange::Synchronous { status_every: 2 };

fn rig(exchange: Exchange) -> Rig {
    open(
        DriveSettings {
            exchange,
            ..DriveSettings::default()
        },
        EmulatedDriveSettings::default(),
    )
    .unwrap()
}

/// The error of opening the drive.
fn refusal(settings: DriveSettings, device: EmulatedDriveSettings) -> String {
    match open(settings, device) {
        Ok(_) => panic!("this must not open"),
        Err(error) => error.to_string(),
    }
}

impl Rig {
    fn enable(&mut self) -> Result<(), DeviceError> {
        crate::blocking::enable(&mut self.drive, |time| self.world.sleep(time))
    }

    fn reset_fault(&mut self) -> Result<(), DeviceError> {
        crate::blocking::reset_fault(&mut self.drive, |time| self.world.sleep(time))
    }

    fn device(&self) -> MutexGuard<'_, EmulatedDrive> {
        self.device.lock().unwrap()
    }

    fn device_current_a(&self) -> f64 {
        self.device().current_a()
    }

    /// Runs a loop at 1 kHz that commands `current_a`, until the amplifier has a fault or `most_ms` are over. Returns
    /// the milliseconds it ran.
    fn run_ms(&mut self, current_a: f64, most_ms: u32) -> u32 {
        for ms in 0..most_ms {
            if matches!(self.drive.status(), AmplifierStatus::Fault(_)) {
                return ms;
            }
            let _ = self.drive.command(current_a); // refused in the tick in which the fault is found
            self.world.sleep(Duration::from_millis(1));
        }
        most_ms
    }

    fn sleep_ms(&self, ms: u64) {
        self.world.sleep(Duration::from_millis(ms));
    }
}
