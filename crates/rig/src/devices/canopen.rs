//! A CANopen drive: from its settings to driver and emulation.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use bench_hal::can::budget::Exchange;
use bench_hal::can::bus::Host;
use bench_hal::can::drive::{CanopenDrive, DriveSettings, DriveTimes};
use bench_hal::can::emulator::{EmulatedAmplifier, EmulatedDrive, EmulatedDriveSettings};
use bench_hal::can::scale::Reference;

use super::amplifier::{AmplifierError, CanAddress, CanAmplifier, OpenAmplifier, Requirements};
use bench_config::{CanopenSettings, CanopenTimeouts, ExchangeSettings, OnCommunicationLoss};

impl CanAmplifier for CanopenSettings {
    fn address(&self) -> CanAddress<'_> {
        CanAddress {
            interface: &self.interface,
            bit_rate: self.bit_rate,
            node: self.node,
        }
    }

    fn current_step_a(&self) -> f64 {
        let reference_a = match self.target_reference {
            Reference::Rated => self.rated_current_a,
            Reference::Maximum => self.rated_current_a * self.maximum_current_ratio,
        };
        reference_a / 1000.0
    }

    fn check(&self, requirements: Requirements) -> Result<(), AmplifierError> {
        Ok(drive_settings(self, requirements).check()?)
    }

    fn open(
        &self,
        requirements: Requirements,
        host: Box<dyn Host>,
    ) -> Result<OpenAmplifier, AmplifierError> {
        let drive = CanopenDrive::open(drive_settings(self, requirements), host)?;
        let identity = identity_text(drive.identity());
        Ok((Box::new(drive), identity))
    }

    fn emulate(&self) -> Arc<Mutex<dyn EmulatedAmplifier>> {
        let drive = EmulatedDrive::new(emulated_settings(self));
        Arc::new(Mutex::new(drive))
    }
}

/// `canopen 0x0000029C-0x00000402-0x00010001-0x000004D2`: vendor, product, revision and serial number.
pub fn identity_text(identity: [Option<u32>; 4]) -> String {
    let numbers = identity.map(|number| match number {
        Some(number) => format!("0x{number:08X}"),
        None => "?".into(),
    });
    format!("canopen {}", numbers.join("-"))
}

/// The settings of the driver. Its `check()` refuses them if they are invalid.
pub fn drive_settings(device: &CanopenSettings, requirements: Requirements) -> DriveSettings {
    let settings = DriveSettings {
        node: device.node,
        own_node: device.own_node,
        bit_rate: device.bit_rate,
        rate_hz: requirements.rate_hz,
        exchange: Exchange::Asynchronous { status_hz: 1.0 },
        load_limit: device.load_limit,
        mode: device.mode,
        torque_slope: device.torque_slope_per_mille_per_s,
        reference: device.target_reference,
        rated_current_a: device.rated_current_a,
        current_limit_a: requirements.current_limit_a,
        identity: device.identity,
        abort_connection: abort_connection(device.on_communication_loss),
        times: drive_times(&device.times),
    };
    DriveSettings {
        exchange: exchange(device.exchange, &settings),
        ..settings
    }
}

fn drive_times(times: &CanopenTimeouts) -> DriveTimes {
    let seconds = Duration::from_secs_f64;
    DriveTimes {
        heartbeat_period: seconds(times.heartbeat_s),
        heartbeat_timeout: seconds(times.heartbeat_lost_s),
        own_heartbeat_period: seconds(times.own_heartbeat_s),
        own_heartbeat_timeout: seconds(times.own_heartbeat_lost_s),
        status_timeout: seconds(times.status_lost_s),
        command_timeout: seconds(times.command_lost_s),
        sdo_timeout: seconds(times.sdo_s),
        state_timeout: seconds(times.state_s),
        ..DriveTimes::default()
    }
}

/// The value of 0x6007 (CiA 402); `None` leaves it as it is.
fn abort_connection(reaction: OnCommunicationLoss) -> Option<i16> {
    match reaction {
        OnCommunicationLoss::Fault => Some(1),
        OnCommunicationLoss::DisableVoltage => Some(2),
        OnCommunicationLoss::QuickStop => Some(3),
        OnCommunicationLoss::OwnReaction => None,
    }
}

/// With SYNC the drive applies each set-point at a known time. So `by_budget` chooses it if the bus load allows it.
fn exchange(wanted: ExchangeSettings, settings: &DriveSettings) -> Exchange {
    match wanted {
        ExchangeSettings::Asynchronous { status_hz } => Exchange::Asynchronous { status_hz },
        ExchangeSettings::Synchronous { status_every } => Exchange::Synchronous { status_every },
        ExchangeSettings::ByBudget { status_hz } => {
            let status_every = (settings.rate_hz / status_hz).ceil().clamp(1.0, 240.0) as u8;
            let synchronous = DriveSettings {
                exchange: Exchange::Synchronous { status_every },
                ..settings.clone()
            };
            match synchronous.check() {
                Ok(_) => synchronous.exchange,
                Err(_) => Exchange::Asynchronous { status_hz },
            }
        }
    }
}

/// A drive that fits the configuration in everything that it states.
fn emulated_settings(device: &CanopenSettings) -> EmulatedDriveSettings {
    let default = EmulatedDriveSettings::default();
    EmulatedDriveSettings {
        node: device.node,
        identity: device.identity.or(default.identity),
        rated_current_ma: (device.rated_current_a * 1e3).round() as u32,
        maximum_per_mille: (device.maximum_current_ratio * 1e3).round() as u16,
        reference: device.target_reference,
        ..default
    }
}
