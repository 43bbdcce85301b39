//! From the settings of a serial probe to its driver.

use std::sync::Arc;
use std::time::Duration;

use bench_hal::serial::{self, SerialError, SerialProbe};

use bench_base::thread_priority::device_thread_setup;
use bench_config::{ProbeDevice, ProbeSettings};

/// A probe that cannot be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProbeError {
    /// The serial probe.
    #[error(transparent)]
    Serial(#[from] SerialError),
    /// The line needs more time than configured.
    #[error(
        "probe.transport_s is {transport_s} s, but {characters} characters at {baud} baud take {least_s:.6} s; raise one of the two"
    )]
    Transport {
        /// As configured.
        transport_s: f64,
        /// Time on the line.
        least_s: f64,
        /// Characters on the line.
        characters: u32,
        /// A character has ten or eleven bits.
        baud: u32,
    },
    /// The simulated probe has no interface.
    #[error("the simulated probe has no interface; set probe.device")]
    Simulated,
}

/// Refuses invalid settings, and a `probe.transport_s` that is shorter than the time on the line.
pub fn check(probe: &ProbeSettings) -> Result<(), ProbeError> {
    let Some(serial) = probe.device.serial() else {
        return Ok(());
    };
    serial.protocol.decoder()?;
    let characters = serial.protocol.characters_per_reading().unwrap_or(0);
    let least_s = serial.line.line_time_ns(characters) as f64 * 1e-9;
    let transport_s = probe.transport_s;
    if transport_s >= least_s {
        return Ok(());
    }
    Err(ProbeError::Transport {
        transport_s,
        least_s,
        characters,
        baud: serial.line.baud,
    })
}

/// Opens the configured probe; it reads from now on. Its thread runs directly below the loop's priority.
pub fn open(probe: &ProbeSettings, loop_priority: i32) -> Result<SerialProbe, ProbeError> {
    let settings = driver_settings(probe).ok_or(ProbeError::Simulated)?;
    let setup = device_thread_setup(loop_priority);
    Ok(SerialProbe::open_with(settings, setup)?)
}

/// The settings of the driver; `None` for the simulated probe.
pub fn driver_settings(probe: &ProbeSettings) -> Option<serial::ProbeSettings> {
    let device = probe.device.serial()?;
    Some(serial::ProbeSettings {
        port: device.line.clone(),
        protocol: Arc::clone(&device.protocol),
        mounting: device.mounting,
        latency: Duration::from_secs_f64(probe.latency_s),
    })
}

/// Kind and port, because serial probes do not report an identity. A port in /dev/serial/by-id names the adapter.
pub fn identity(device: &ProbeDevice) -> String {
    match device.serial() {
        Some(serial) => format!("{} {}", device.kind(), serial.line.path.display()),
        None => device.kind().into(),
    }
}
