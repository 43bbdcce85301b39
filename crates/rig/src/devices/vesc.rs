//! A VESC: from its settings to driver and emulation.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use bench_hal::can::bus::Host;
use bench_hal::can::emulator::{EmulatedAmplifier, EmulatedVesc};
use bench_hal::can::vesc::{self, Vesc};

use super::amplifier::{AmplifierError, CanAddress, CanAmplifier, OpenAmplifier, Requirements};
use bench_config::VescSettings;

/// The current is switched off after this time without a command, in seconds, or after [`PERIODS_LOST`] periods of a slow loop.
const COMMAND_LOST_S: f64 = 0.02;
/// Fewest periods of the loop without a command after which the current is switched off.
const PERIODS_LOST: f64 = 3.0;
/// Set-points are whole milliamperes.
const STEP_A: f64 = 1e-3;

impl CanAmplifier for VescSettings {
    fn address(&self) -> CanAddress<'_> {
        CanAddress {
            interface: &self.interface,
            bit_rate: self.bit_rate,
            node: self.node,
        }
    }

    fn current_step_a(&self) -> f64 {
        STEP_A
    }

    fn check(&self, _requirements: Requirements) -> Result<(), AmplifierError> {
        Ok(())
    }

    fn open(
        &self,
        requirements: Requirements,
        host: Box<dyn Host>,
    ) -> Result<OpenAmplifier, AmplifierError> {
        let node = self.node;
        let opened = Vesc::open(driver_settings(self, requirements), host);
        let vesc = opened.map_err(|why| AmplifierError::Vesc { node, why })?;
        Ok((Box::new(vesc), identity(self)))
    }

    fn emulate(&self) -> Arc<Mutex<dyn EmulatedAmplifier>> {
        Arc::new(Mutex::new(EmulatedVesc::new(self.node)))
    }
}

/// `vesc 1`: the number on the bus, because a VESC does not report an identity.
pub fn identity(device: &VescSettings) -> String {
    format!("vesc {}", device.node)
}

/// The settings of the driver.
pub fn driver_settings(device: &VescSettings, requirements: Requirements) -> vesc::VescSettings {
    let command_lost_s = COMMAND_LOST_S.max(PERIODS_LOST / requirements.rate_hz);
    vesc::VescSettings {
        node: device.node,
        current_limit_a: requirements.current_limit_a,
        status_timeout: Duration::from_secs_f64(device.status_lost_s),
        command_timeout: Duration::from_secs_f64(command_lost_s),
    }
}
