//! An emulated probe on a serial line, which measures the simulated stage.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex, PoisonError};

use bench_hal::serial::emulator::{EmulatedProbe, Fault, Line, LineCounts, ProbeTask, SharedProbe};
use bench_hal::serial::{Mounting, Note, PortSettings, SerialError};

use super::link::Link;
use super::stage::Stage;
use super::{EmulatedDevice, EmulatorError};
use crate::simulated::Sensor;
use bench_base::thread_priority::device_thread_setup;
use bench_config::{Config, ProbeSettings};

/// Measurements per second of a streaming probe, if the configuration does not state its rate.
const STREAM_HZ: f64 = 4000.0;
/// A polled probe measures more often than it is polled, so that each answer holds one or two values.
const MEASUREMENTS_PER_ANSWER: f64 = 1.5;

/// Connection of the emulated probe.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ProbeEndpoint {
    /// A pseudo terminal, with an optional link to the reader's side.
    Terminal(Option<PathBuf>),
    /// A serial port: the other end of a null-modem cable.
    Port(PathBuf),
}

impl ProbeEndpoint {
    /// The link to `terminal`, if one is wanted.
    fn link_to(&self, terminal: &Path) -> Result<Option<Link>, EmulatorError> {
        match self {
            ProbeEndpoint::Terminal(Some(path)) => Link::new(path, terminal).map(Some),
            _ => Ok(None),
        }
    }
}

/// Serves an emulated probe; dropping it closes the line.
pub struct ProbeServer {
    task: ProbeTask,
    device: SharedProbe,
    place: PathBuf,
    notes: Vec<Note>,
    rate_hz: f64,
    kind: &'static str,
    link: Option<Link>,
}

impl ProbeServer {
    /// Serves the configured probe at `endpoint`. `now_ns` is the clock of the stage.
    pub fn start(
        config: &Config,
        endpoint: &ProbeEndpoint,
        rate_hz: Option<f64>,
        stage: Stage,
        now_ns: impl Fn() -> u64 + Send + 'static,
    ) -> Result<ProbeServer, EmulatorError> {
        let serial = config.probe.device.serial().ok_or_else(simulated)?;
        let rate_hz = rate_hz.map_or_else(|| measuring_rate_hz(&config.probe), Ok)?;
        let probe = EmulatedProbe::new(&*serial.protocol, rate_hz)?;
        let device: SharedProbe = Arc::new(Mutex::new(probe));
        let (line, notes) = open_line(serial.line.clone(), endpoint)?;
        let place = line.path().to_owned();
        let link = endpoint.link_to(&place)?;
        let measure = measurement(Sensor::new(&config.sim), serial.mounting, stage);
        let setup = device_thread_setup(config.servo.priority);
        let task = ProbeTask::start(line, Arc::clone(&device), now_ns, measure, setup);
        Ok(ProbeServer {
            task: task.map_err(no_thread)?,
            device,
            place,
            notes,
            rate_hz,
            kind: config.probe.device.kind(),
            link,
        })
    }

    /// Begins a fault, or ends one.
    pub fn inject(&self, fault: Fault) {
        let mut device = self.device.lock().unwrap_or_else(PoisonError::into_inner);
        device.inject_fault(fault);
    }

    /// The port, or the reader's side of the pseudo terminal.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// The link to the pseudo terminal.
    pub fn link(&self) -> Option<&Path> {
        self.link.as_ref().map(Link::path)
    }

    /// Settings that the port did not accept.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// Measurements per second.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Kind of the device, as in a configuration.
    pub fn kind(&self) -> &'static str {
        self.kind
    }

    /// Bytes and measurements so far.
    pub fn counts(&self) -> &LineCounts {
        self.task.counts()
    }

    /// Whether the serial port is gone.
    pub fn is_lost(&self) -> bool {
        self.counts().is_lost.load(Relaxed)
    }
}

fn simulated() -> EmulatorError {
    let device = EmulatedDevice::Probe;
    EmulatorError::Simulated { device }
}

fn no_thread(source: std::io::Error) -> EmulatorError {
    let device = EmulatedDevice::Probe;
    EmulatorError::Thread { device, source }
}

/// The rate of the configured readings; a polled probe measures somewhat faster.
fn measuring_rate_hz(probe: &ProbeSettings) -> Result<f64, SerialError> {
    let readings_hz = probe.rate_hz.unwrap_or(STREAM_HZ);
    let is_polled = match probe.device.serial() {
        Some(serial) => serial.protocol.decoder()?.request().is_some(),
        None => false,
    };
    Ok(if is_polled {
        MEASUREMENTS_PER_ANSWER * readings_hz
    } else {
        readings_hz
    })
}

fn open_line(
    settings: PortSettings,
    endpoint: &ProbeEndpoint,
) -> Result<(Line, Vec<Note>), SerialError> {
    match endpoint {
        ProbeEndpoint::Terminal(_) => Ok((Line::terminal(settings)?, Vec::new())),
        ProbeEndpoint::Port(path) => {
            let path = path.clone();
            Line::port(PortSettings { path, ..settings })
        }
    }
}

/// The measurement of the probe at a time, in its own metres: the inverse of position = gain * reading + offset.
fn measurement(
    mut sensor: Sensor,
    mounting: Mounting,
    stage: Stage,
) -> impl FnMut(u64) -> f64 + Send {
    move |at_ns| {
        let sensed_m = sensor.sense(stage.position_m(at_ns));
        (sensed_m - mounting.offset_m) / mounting.gain
    }
}
