//! Amplifiers by their settings.

use std::time::Duration;

use bench_hal::can::budget::Exchange;
use bench_hal::can::bus::{PortError, SocketPort, SystemHost};
use bench_hal::can::drive::{
    CanopenDrive, DriveSettings, ExpectedIdentity, OpenError, TorqueMode as Mode,
};
use bench_hal::can::scale::Reference;
use bench_hal::can::vesc::{self, Vesc};

use super::Amplifier;
use crate::config::{
    AmplifierDevice, CanopenSettings, Config, ExchangeSettings, OnCommunicationLoss,
    TargetReference, TorqueMode, VescSettings,
};
use crate::util::thread_priority::device_thread_setup;

/// The step of a VESC's set-point in amperes: whole milliamperes.
const VESC_STEP_A: f64 = 1e-3;

/// An amplifier that cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum AmplifierError {
    /// The CAN interface.
    #[error(transparent)]
    Port(#[from] PortError),
    /// The CANopen drive.
    #[error(transparent)]
    Drive(#[from] OpenError),
    /// The VESC.
    #[error("VESC {node}: {why}")]
    Vesc {
        /// Its number.
        node: u8,
        /// What is wrong.
        why: String,
    },
    /// The simulated amplifier has no interface of its own.
    #[error("the simulated amplifier stands on no interface")]
    Simulated,
}

/// Opens the amplifier that the configuration names, and tells which one it is; it is off afterwards.
pub fn open(config: &Config) -> Result<(Amplifier, String), AmplifierError> {
    match &config.amplifier.device {
        AmplifierDevice::Simulated(_) => Err(AmplifierError::Simulated),
        AmplifierDevice::Canopen(device) => {
            let port = SocketPort::open(&device.interface, device.bit_rate)?;
            let host = SystemHost::new(port).prepared(device_thread_setup(config.servo.priority));
            let drive = CanopenDrive::open(drive_settings(device, config), Box::new(host))?;
            let identity = canopen_identity(drive.identity());
            Ok((Box::new(drive), identity))
        }
        AmplifierDevice::Vesc(device) => {
            let port = SocketPort::open(&device.interface, device.bit_rate)?;
            let host = SystemHost::new(port).prepared(device_thread_setup(config.servo.priority));
            let opened = Vesc::open(vesc_settings(device, config), Box::new(host));
            let vesc = opened.map_err(|why| AmplifierError::Vesc {
                node: device.node,
                why,
            })?;
            Ok((Box::new(vesc), format!("vesc {}", device.node)))
        }
    }
}

/// `canopen 0x0000029C-0x00000402-0x00010001-0x000004D2`: vendor, product, revision and serial number.
fn canopen_identity(identity: [Option<u32>; 4]) -> String {
    let words =
        identity.map(|number| number.map_or("?".to_string(), |number| format!("0x{number:08X}")));
    format!("canopen {}", words.join("-"))
}

/// Refuses settings that cannot be, and a traffic that the bus does not carry, with the figures.
pub fn check(config: &Config) -> Result<(), AmplifierError> {
    match &config.amplifier.device {
        AmplifierDevice::Canopen(device) => Ok(drive_settings(device, config).check()?),
        AmplifierDevice::Simulated(_) | AmplifierDevice::Vesc(_) => Ok(()),
    }
}

/// The driver's settings of a CANopen drive. Refused by `check()` of the result where they cannot be.
pub fn drive_settings(device: &CanopenSettings, config: &Config) -> DriveSettings {
    let seconds = Duration::from_secs_f64;
    let times = &device.times;
    let settings = DriveSettings {
        node: device.node,
        own_node: device.own_node,
        bit_rate: device.bit_rate,
        rate_hz: config.servo.rate_hz,
        exchange: Exchange::Asynchronous { status_hz: 1.0 },
        load_limit: device.load_limit,
        mode: mode(device.mode),
        torque_slope: device.torque_slope_per_mille_per_s,
        reference: reference(device.target_reference),
        rated_current_a: device.rated_current_a,
        current_limit_a: config.amplifier.current_limit_a,
        identity: ExpectedIdentity {
            vendor: device.identity.vendor,
            product: device.identity.product,
            revision: device.identity.revision,
            serial: device.identity.serial,
        },
        abort_connection: match device.when_unheard {
            OnCommunicationLoss::Fault => Some(1),
            OnCommunicationLoss::DisableVoltage => Some(2),
            OnCommunicationLoss::QuickStop => Some(3),
            OnCommunicationLoss::OwnReaction => None,
        },
        heartbeat_period: seconds(times.heartbeat_s),
        heartbeat_timeout: seconds(times.heartbeat_lost_s),
        own_heartbeat_period: seconds(times.own_heartbeat_s),
        own_heartbeat_timeout: seconds(times.own_heartbeat_lost_s),
        status_timeout: seconds(times.status_lost_s),
        command_timeout: seconds(times.command_lost_s),
        sdo_timeout: seconds(times.sdo_s),
        state_timeout: seconds(times.state_s),
    };
    DriveSettings {
        exchange: exchange(device.exchange, &settings),
        ..settings
    }
}

/// By budget: with SYNC where the bus carries it, for the drive then takes each set-point at a known moment.
fn exchange(wanted: ExchangeSettings, settings: &DriveSettings) -> Exchange {
    match wanted {
        ExchangeSettings::Asynchronous { status_hz } => Exchange::Asynchronous { status_hz },
        ExchangeSettings::Synchronous { status_every } => Exchange::Synchronous { status_every },
        ExchangeSettings::ByBudget { status_hz } => {
            let status_every = (settings.rate_hz / status_hz).ceil().clamp(1.0, 240.0) as u8;
            let synchronous = Exchange::Synchronous { status_every };
            let fits = DriveSettings {
                exchange: synchronous,
                ..settings.clone()
            }
            .check()
            .is_ok();
            if fits {
                synchronous
            } else {
                Exchange::Asynchronous { status_hz }
            }
        }
    }
}

fn mode(mode: TorqueMode) -> Mode {
    match mode {
        TorqueMode::CyclicElseProfile => Mode::CyclicElseProfile,
        TorqueMode::Cyclic => Mode::Cyclic,
        TorqueMode::Profile => Mode::Profile,
    }
}

/// What 1000 counts are, in the driver's words.
pub fn reference(reference: TargetReference) -> Reference {
    match reference {
        TargetReference::Rated => Reference::Rated,
        TargetReference::Maximum => Reference::Maximum,
    }
}

/// The driver's settings of a VESC.
pub fn vesc_settings(device: &VescSettings, config: &Config) -> vesc::VescSettings {
    vesc::VescSettings {
        node: device.node,
        current_limit_a: config.amplifier.current_limit_a,
        status_timeout: Duration::from_secs_f64(device.status_lost_s),
    }
}

impl AmplifierDevice {
    /// The step of the current in amperes, 0 for none.
    pub fn current_step_a(&self) -> f64 {
        match self {
            AmplifierDevice::Simulated(device) => device.current_step_a,
            AmplifierDevice::Canopen(device) => device.reference_a() / 1000.0,
            AmplifierDevice::Vesc(_) => VESC_STEP_A,
        }
    }
}

impl CanopenSettings {
    /// The current of 1000 counts in amperes.
    pub fn reference_a(&self) -> f64 {
        match self.target_reference {
            TargetReference::Rated => self.rated_current_a,
            TargetReference::Maximum => self.rated_current_a * self.maximum_current_ratio,
        }
    }
}
