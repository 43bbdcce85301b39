//! Probes by their settings.

use std::sync::Arc;
use std::time::Duration;

use bench_hal::serial::{
    Mounting, Polling, PortSettings, ProbeSettings, Protocol, SerialError, SerialProbe, ascii,
    capancdt, optoncdt,
};

use crate::config::{
    AsciiSettings, CapancdtSettings, Config, CounterMeaning, LineSettings, MountingSettings,
    OptoncdtSettings, Parity, PollingSettings, ProbeDevice,
};
use crate::util::thread_priority::device_thread_setup;

/// A probe that cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum ProbeError {
    /// The serial probe.
    #[error(transparent)]
    Serial(#[from] SerialError),
    /// The line needs longer.
    #[error(
        "probe.transport_s is {transport_s} s, but {characters} characters at {baud} baud take {least_s:.6} s: raise it, or the baud rate"
    )]
    Transport {
        /// As configured.
        transport_s: f64,
        /// What the line takes.
        least_s: f64,
        /// Characters on the line.
        characters: u32,
        /// Characters have ten or eleven bits.
        baud: u32,
    },
    /// The simulated probe has no interface of its own.
    #[error("the simulated probe stands on no interface")]
    Simulated,
}

/// Refuses settings that make no sense, and a line that cannot be as fast as `probe.transport_s` says.
pub fn check(config: &Config) -> Result<(), ProbeError> {
    let Some(settings) = settings(config) else {
        return Ok(());
    };
    settings.protocol.decoder()?;
    let characters = settings.protocol.characters_per_reading().unwrap_or(0);
    let least_s = settings.port.line_time_ns(characters) as f64 * 1e-9;
    let transport_s = config.probe.transport_s;
    if transport_s < least_s {
        return Err(ProbeError::Transport {
            transport_s,
            least_s,
            characters,
            baud: settings.port.baud,
        });
    }
    Ok(())
}

/// Opens the probe that the configuration names; it reads from now on.
pub fn open(config: &Config) -> Result<SerialProbe, ProbeError> {
    let settings = settings(config).ok_or(ProbeError::Simulated)?;
    Ok(SerialProbe::open_with(
        settings,
        device_thread_setup(config.servo.priority),
    )?)
}

/// Kind and port: serial probes do not say who they are. A port below /dev/serial/by-id names the adapter at least.
pub fn identity(config: &Config) -> String {
    let device = &config.probe.device;
    device.line().map_or(device.kind().to_string(), |line| {
        format!("{} {}", device.kind(), line.port)
    })
}

/// The driver's settings; `None` for the simulated probe.
pub fn settings(config: &Config) -> Option<ProbeSettings> {
    let device = &config.probe.device;
    let (protocol, line) = (device.protocol()?, device.line()?);
    let mut settings = ProbeSettings::new(port(line), protocol);
    settings.latency = Duration::from_secs_f64(config.probe.latency_s);
    settings.mounting = device.mounting().map(mounting).unwrap_or_default();
    Some(settings)
}

/// The port of a line.
pub fn port(line: &LineSettings) -> PortSettings {
    PortSettings {
        parity: match line.parity {
            Parity::None => bench_hal::serial::Parity::None,
            Parity::Even => bench_hal::serial::Parity::Even,
        },
        low_latency: line.low_latency,
        lock_dir: line.lock_folder.clone().into(),
        ..PortSettings::new(&line.port, line.baud)
    }
}

fn mounting(settings: MountingSettings) -> Mounting {
    Mounting {
        gain: settings.gain,
        offset_m: settings.offset_m,
    }
}

fn polling(settings: PollingSettings) -> Polling {
    let seconds = Duration::from_secs_f64;
    Polling {
        interval: seconds(settings.interval_s),
        timeout: seconds(settings.timeout_s),
        quiet: seconds(settings.quiet_s),
    }
}

impl ProbeDevice {
    /// The protocol with its settings; `None` for the simulated probe.
    pub fn protocol(&self) -> Option<Arc<dyn Protocol>> {
        match self {
            ProbeDevice::Simulated(_) => None,
            ProbeDevice::Capancdt(device) => Some(Arc::new(capancdt(device))),
            ProbeDevice::Optoncdt(device) => Some(Arc::new(optoncdt(device))),
            ProbeDevice::Ascii(device) => Some(Arc::new(ascii(device))),
        }
    }

    /// Its serial line.
    pub fn line(&self) -> Option<&LineSettings> {
        match self {
            ProbeDevice::Simulated(_) => None,
            ProbeDevice::Capancdt(device) => Some(&device.line),
            ProbeDevice::Optoncdt(device) => Some(&device.line),
            ProbeDevice::Ascii(device) => Some(&device.line),
        }
    }

    /// How it is mounted.
    pub fn mounting(&self) -> Option<MountingSettings> {
        match self {
            ProbeDevice::Simulated(_) => None,
            ProbeDevice::Capancdt(device) => Some(device.mounting),
            ProbeDevice::Optoncdt(device) => Some(device.mounting),
            ProbeDevice::Ascii(device) => Some(device.mounting),
        }
    }
}

fn capancdt(device: &CapancdtSettings) -> capancdt::Settings {
    capancdt::Settings {
        range_m: device.sensor_range_m,
        probe_address: device.address,
        master_address: device.own_address,
        counter: match device.counter {
            CounterMeaning::NewestValue => capancdt::CounterMeaning::NewestValue,
            CounterMeaning::OldestValue => capancdt::CounterMeaning::OldestValue,
        },
        polling: polling(device.polling),
    }
}

fn optoncdt(device: &OptoncdtSettings) -> optoncdt::Settings {
    let cycle = optoncdt::Cycle {
        values: device.values_per_cycle,
        displacement: device.displacement_value,
    };
    optoncdt::Settings {
        range_m: device.sensor_range_m,
        cycle,
    }
}

fn ascii(device: &AsciiSettings) -> ascii::Settings {
    ascii::Settings {
        line: device.pattern.clone(),
        terminator: device.terminator.clone(),
        invalid: device.invalid.clone(),
        over: device.over.clone(),
        under: device.under.clone(),
        error: device.error.clone(),
        error_texts: &[],
        request: device.request.clone(),
        unit_m: device.unit_m,
        offset_m: device.zero_m,
        lower_m: device.lower_m,
        upper_m: device.upper_m,
        polling: polling(device.polling),
    }
}
