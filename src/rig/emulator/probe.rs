//! A probe that acts as the configured one, and looks at the stage.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex, PoisonError};

use bench_hal::serial::emulator::{EmulatedProbe, Fault, Line, LineCounts, ProbeTask, SharedProbe};
use bench_hal::serial::{Note, PortSettings};

use super::EmulatorError;
use super::link::Link;
use super::stage::Stage;
use crate::config::{Config, MountingSettings, ProbeDevice};
use crate::rig::devices::probe::port;
use crate::rig::simulated::Sensor;
use crate::util::thread_priority::device_thread_setup;

/// Measurements a second of a probe that speaks by itself, if the configuration does not say.
const STREAM_HZ: f64 = 4000.0;
/// A probe that is asked measures faster than it is asked, so that each answer carries a value or two.
const MEASUREMENTS_PER_ANSWER: f64 = 1.5;

/// Where the probe's end of the line is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ProbeEndpoint {
    /// A pseudo terminal, with a link of this name to the reader's end.
    Terminal(Option<PathBuf>),
    /// A serial port: a null-modem cable, the other end of a pair.
    Port(PathBuf),
}

/// A probe at work; dropping it closes the line.
pub struct Probe {
    task: ProbeTask,
    device: SharedProbe,
    place: PathBuf,
    notes: Vec<Note>,
    rate_hz: f64,
    kind: &'static str,
    link: Option<Link>,
}

impl Probe {
    /// Serves the probe of the configuration at `end`. `now_ns` is the stage's clock.
    pub fn start(
        config: &Config,
        end: &ProbeEndpoint,
        rate_hz: Option<f64>,
        stage: Stage,
        now_ns: impl Fn() -> u64 + Send + 'static,
    ) -> Result<Probe, EmulatorError> {
        let device = &config.probe.device;
        let simulated = || EmulatorError::Simulated { device: "probe" };
        let protocol = device.protocol().ok_or_else(simulated)?;
        let rate_hz = rate_hz.unwrap_or_else(|| measuring_rate_hz(config));
        let acting: SharedProbe = Arc::new(Mutex::new(EmulatedProbe::new(&*protocol, rate_hz)?));
        let (line, notes) = line(port(device.line().ok_or_else(simulated)?), end)?;
        let place = line.path().to_owned();
        let link = match end {
            ProbeEndpoint::Terminal(Some(path)) => Some(Link::new(path, &place)?),
            _ => None,
        };
        let task = ProbeTask::start(
            line,
            Arc::clone(&acting),
            now_ns,
            measure(config, stage),
            device_thread_setup(config.servo.priority),
        );
        let task = task.map_err(|source| EmulatorError::Thread {
            device: "probe",
            source,
        })?;
        Ok(Probe {
            task,
            device: acting,
            place,
            notes,
            rate_hz,
            kind: device.kind(),
            link,
        })
    }

    /// Misbehaves from now on.
    pub fn ask(&self, fault: Fault) {
        self.device
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .inject_fault(fault);
    }

    /// The port, or the reader's end of the pseudo terminal.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// The link to the pseudo terminal.
    pub fn link(&self) -> Option<&Path> {
        self.link.as_ref().map(Link::path)
    }

    /// What the port did not take.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// Measurements a second.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Kind of the device, as in a configuration.
    pub fn kind(&self) -> &'static str {
        self.kind
    }

    /// What has gone over the line.
    pub fn carried(&self) -> &LineCounts {
        self.task.counts()
    }

    /// Whether the line is lost: the port is gone.
    pub fn is_lost(&self) -> bool {
        self.carried().is_lost.load(Relaxed)
    }
}

/// As fast as the configured readings come, a probe that is asked somewhat faster.
pub fn measuring_rate_hz(config: &Config) -> f64 {
    let is_asked = match &config.probe.device {
        ProbeDevice::Capancdt(_) => true,
        ProbeDevice::Ascii(device) => device.request.is_some(),
        ProbeDevice::Optoncdt(_) | ProbeDevice::Simulated(_) => false,
    };
    let answers_hz = config.probe.rate_hz.unwrap_or(STREAM_HZ);
    if is_asked {
        MEASUREMENTS_PER_ANSWER * answers_hz
    } else {
        answers_hz
    }
}

fn line(settings: PortSettings, end: &ProbeEndpoint) -> Result<(Line, Vec<Note>), EmulatorError> {
    Ok(match end {
        ProbeEndpoint::Terminal(_) => (Line::terminal(settings)?, Vec::new()),
        ProbeEndpoint::Port(path) => Line::port(PortSettings {
            path: path.clone(),
            ..settings
        })?,
    })
}

/// What the probe measures at a time, in its own metres: position = gain (reading) + offset, the other way round.
fn measure(config: &Config, stage: Stage) -> impl FnMut(u64) -> f64 + Send + use<> {
    let MountingSettings { gain, offset_m } =
        config.probe.device.mounting().unwrap_or(MountingSettings {
            gain: 1.0,
            offset_m: 0.0,
        });
    let mut sensor = Sensor::new(config);
    move |at_ns| (sensor.sense(stage.position_m(at_ns)) - offset_m) / gain
}
