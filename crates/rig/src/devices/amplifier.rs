//! From the settings of an amplifier to its driver, and to its emulation.

use std::sync::{Arc, Mutex};

use bench_hal::CurrentAmplifier;
use bench_hal::can::bus::{Host, PortError, SocketPort, SystemHost};
use bench_hal::can::drive::OpenError;
use bench_hal::can::emulator::EmulatedAmplifier;

use bench_base::thread_priority::device_thread_setup;
use bench_config::{AmplifierDevice, AmplifierSettings, LoopSettings};

/// An amplifier that cannot be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
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
        /// Number on the bus.
        node: u8,
        /// The reason.
        why: String,
    },
    /// The simulated amplifier has no interface.
    #[error("the simulated amplifier has no interface; set amplifier.device")]
    Simulated,
}

/// Requirements of the loop for an amplifier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Requirements {
    /// Rate of the set-points, in hertz.
    pub rate_hz: f64,
    /// Limit of the set-points, in amperes.
    pub current_limit_a: f64,
}

impl Requirements {
    /// The requirements of a configuration.
    pub fn new(amplifier: &AmplifierSettings, servo: &LoopSettings) -> Self {
        Requirements {
            rate_hz: servo.rate_hz,
            current_limit_a: amplifier.current_limit_a,
        }
    }
}

/// Address of a device on a CAN bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CanAddress<'a> {
    /// The interface, as `ip link` names it.
    pub interface: &'a str,
    /// Bit rate of the bus in bit/s.
    pub bit_rate: u32,
    /// Node number.
    pub node: u8,
}

/// An open amplifier, switched off, and the identity that it reports.
pub type OpenAmplifier = (Box<dyn CurrentAmplifier>, String);

/// The settings of an amplifier on a CAN bus: from them come its driver and its emulation.
pub trait CanAmplifier {
    /// Its address on the bus.
    fn address(&self) -> CanAddress<'_>;

    /// Resolution of the current, in amperes.
    fn current_step_a(&self) -> f64;

    /// Refuses invalid settings, and traffic that the bus cannot carry.
    fn check(&self, requirements: Requirements) -> Result<(), AmplifierError>;

    /// Opens the driver.
    fn open(
        &self,
        requirements: Requirements,
        host: Box<dyn Host>,
    ) -> Result<OpenAmplifier, AmplifierError>;

    /// An emulated device with these settings.
    fn emulate(&self) -> Arc<Mutex<dyn EmulatedAmplifier>>;
}

/// Opens the configured amplifier.
pub fn open(
    amplifier: &AmplifierSettings,
    servo: &LoopSettings,
) -> Result<OpenAmplifier, AmplifierError> {
    let device = can_amplifier(&amplifier.device).ok_or(AmplifierError::Simulated)?;
    let can = device.address();
    let port = SocketPort::open(can.interface, can.bit_rate)?;
    let host = SystemHost::new(port).prepared(device_thread_setup(servo.priority));
    device.open(Requirements::new(amplifier, servo), Box::new(host))
}

/// Refuses invalid settings, and traffic that the bus cannot carry.
pub fn check(amplifier: &AmplifierSettings, servo: &LoopSettings) -> Result<(), AmplifierError> {
    match can_amplifier(&amplifier.device) {
        Some(device) => device.check(Requirements::new(amplifier, servo)),
        None => Ok(()),
    }
}

/// The amplifier on a CAN bus; `None` for the simulated one.
pub fn can_amplifier(device: &AmplifierDevice) -> Option<&dyn CanAmplifier> {
    match device {
        AmplifierDevice::Simulated(_) => None,
        AmplifierDevice::Canopen(device) => Some(device),
        AmplifierDevice::Vesc(device) => Some(device),
    }
}

/// Resolution of the current in amperes; 0 for a continuous current.
pub fn current_step_a(device: &AmplifierDevice) -> f64 {
    match device {
        AmplifierDevice::Simulated(device) => device.current_step_a,
        AmplifierDevice::Canopen(device) => device.current_step_a(),
        AmplifierDevice::Vesc(device) => device.current_step_a(),
    }
}
