//! The emulated devices of one rehearsal, with one stage, one clock and one log.

use std::sync::atomic::Ordering::Relaxed;
use std::sync::mpsc::Receiver;
use std::time::Instant;

use bench_hal::serial::emulator::{Fault, LineCounts};
use serde::Serialize;

use super::event_log::{EventLog, LogEntry, LogEvent};
use super::fault::{AmplifierFault, EmulatedFault, FaultRequest};
use super::stage::seconds;
use super::{AmplifierServer, EmulatedDevice, EmulatorError, ProbeEndpoint, ProbeServer, Stage};
use crate::devices::can_amplifier;
use bench_config::{AmplifierDevice, Config};

/// The devices to emulate, and their interfaces.
#[derive(Clone, Debug, Default)]
pub struct EmulatedDevices {
    /// The amplifier, on the configured interface.
    pub amplifier: bool,
    /// The probe, at this endpoint.
    pub probe: Option<ProbeEndpoint>,
    /// Measurements per second of the probe, if not as configured.
    pub measuring_rate_hz: Option<f64>,
}

/// The running emulated devices.
pub struct Emulator {
    amplifier: Option<AmplifierServer>,
    probe: Option<ProbeServer>,
    stage: Stage,
    log: EventLog,
    entries: Receiver<LogEntry>,
    start: Instant,
    faults: u64,
    probe_was_lost: bool,
}

/// Totals of a rehearsal.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Summary {
    /// Length in seconds.
    pub duration_s: f64,
    /// Frames that the amplifier received.
    pub frames_received: u64,
    /// Frames that the amplifier sent.
    pub frames_sent: u64,
    /// Largest |current|, in amperes.
    pub largest_current_a: f64,
    /// Current at the end, in amperes.
    pub current_a: f64,
    /// When the amplifier was first enabled, in seconds.
    pub enabled_s: Option<f64>,
    /// State of the amplifier's power stage at the end.
    pub state: Option<&'static str>,
    /// Measurements of the probe.
    pub measurements: u64,
    /// Bytes that the probe received.
    pub bytes_received: u64,
    /// Bytes that the probe sent.
    pub bytes_sent: u64,
    /// Displacement of the stage at the end, in metres.
    pub position_m: f64,
    /// Faults that were injected.
    pub faults: u64,
}

impl Emulator {
    /// Opens interface and line, and serves from now on.
    pub fn start(config: &Config, devices: &EmulatedDevices) -> Result<Emulator, EmulatorError> {
        let (log, entries) = EventLog::new();
        let stage = Stage::new(config)?;
        let start = Instant::now();
        let mut emulator = Emulator {
            amplifier: None,
            probe: None,
            stage,
            log,
            entries,
            start,
            faults: 0,
            probe_was_lost: false,
        };
        if let Some(endpoint) = &devices.probe {
            emulator.start_probe(config, endpoint, devices.measuring_rate_hz)?;
        }
        if devices.amplifier {
            emulator.start_amplifier(config)?;
        }
        emulator.report_devices(config);
        Ok(emulator)
    }

    fn start_probe(
        &mut self,
        config: &Config,
        endpoint: &ProbeEndpoint,
        rate_hz: Option<f64>,
    ) -> Result<(), EmulatorError> {
        let start = self.start;
        let now_ns = move || start.elapsed().as_nanos() as u64;
        let stage = self.stage.clone();
        self.probe = Some(ProbeServer::start(
            config, endpoint, rate_hz, stage, now_ns,
        )?);
        Ok(())
    }

    fn start_amplifier(&mut self, config: &Config) -> Result<(), EmulatorError> {
        self.amplifier = Some(AmplifierServer::open(
            &config.amplifier.device,
            config.servo.priority,
            self.stage.clone(),
            self.log.clone(),
            self.start,
        )?);
        Ok(())
    }

    fn report_devices(&self, config: &Config) {
        if let Some(amplifier) = &self.amplifier {
            let text = amplifier_place(&config.amplifier.device, amplifier.kind());
            self.write(EmulatedDevice::Amplifier, LogEvent::Serving, text);
        }
        let Some(probe) = &self.probe else { return };
        self.write(EmulatedDevice::Probe, LogEvent::Serving, probe_place(probe));
        for note in probe.notes() {
            self.write(EmulatedDevice::Probe, LogEvent::Note, note.to_string());
        }
    }

    /// Seconds since the start.
    pub fn time_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    fn now_ns(&self) -> u64 {
        self.start.elapsed().as_nanos() as u64
    }

    /// When the amplifier was first enabled, in seconds.
    pub fn enabled_s(&self) -> Option<f64> {
        self.amplifier.as_ref()?.counters().enabled_s()
    }

    /// Refuses a fault that the emulated devices cannot have.
    pub fn check(&self, request: &FaultRequest) -> Result<(), EmulatorError> {
        match request.fault {
            EmulatedFault::None => Ok(()),
            EmulatedFault::Amplifier(fault) => self.check_amplifier(request, fault),
            EmulatedFault::Probe(_) if self.probe.is_some() => Ok(()),
            EmulatedFault::Probe(_) => Err(not_emulated(request, EmulatedDevice::Probe)),
        }
    }

    fn check_amplifier(
        &self,
        request: &FaultRequest,
        fault: AmplifierFault,
    ) -> Result<(), EmulatorError> {
        let Some(amplifier) = &self.amplifier else {
            return Err(not_emulated(request, EmulatedDevice::Amplifier));
        };
        if amplifier.supports(fault) {
            return Ok(());
        }
        Err(EmulatorError::Fault {
            kind: amplifier.kind(),
            fault: request.text.clone(),
        })
    }

    /// Begins a fault, or ends one.
    pub fn inject(&mut self, request: &FaultRequest) -> Result<(), EmulatorError> {
        self.check(request)?;
        let fault = request.fault;
        self.faults += u64::from(fault != fault.end());
        self.write(fault.device(), LogEvent::Fault, request.text.clone());
        match fault {
            EmulatedFault::Probe(fault) => {
                self.inject_into_probe(fault);
                Ok(())
            }
            EmulatedFault::Amplifier(fault) => self.inject_into_amplifier(fault),
            EmulatedFault::None => {
                self.inject_into_probe(Fault::None);
                self.inject_into_amplifier(AmplifierFault::NONE)
            }
        }
    }

    fn inject_into_probe(&self, fault: Fault) {
        if let Some(probe) = &self.probe {
            probe.inject(fault);
        }
    }

    fn inject_into_amplifier(&self, fault: AmplifierFault) -> Result<(), EmulatorError> {
        match &self.amplifier {
            Some(amplifier) => amplifier.inject(fault),
            None => Ok(()),
        }
    }

    /// The log entries since the last call.
    pub fn new_entries(&mut self) -> Vec<LogEntry> {
        let is_lost = self.probe.as_ref().is_some_and(ProbeServer::is_lost);
        if is_lost && !self.probe_was_lost {
            self.probe_was_lost = true;
            let text = "the serial port is gone; connect it and start the emulator again";
            self.write(EmulatedDevice::Probe, LogEvent::Lost, text.into());
        }
        self.entries.try_iter().collect()
    }

    fn write(&self, device: EmulatedDevice, what: LogEvent, text: String) {
        let now_ns = self.now_ns();
        let amplifier = self.amplifier.as_ref();
        self.log.write(LogEntry {
            time_s: seconds(now_ns),
            device,
            what,
            text,
            enabled: amplifier.is_some_and(AmplifierServer::is_enabled),
            current_a: amplifier.map_or(0.0, AmplifierServer::current_a),
            position_m: self.stage.position_m(now_ns),
            since_s: None,
        });
    }

    /// The totals so far.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary {
            duration_s: self.time_s(),
            position_m: self.stage.position_m(self.now_ns()),
            faults: self.faults,
            ..Summary::default()
        };
        if let Some(amplifier) = &self.amplifier {
            summary.add_amplifier(amplifier);
        }
        if let Some(probe) = &self.probe {
            summary.add_line(probe.counts());
        }
        summary
    }
}

impl Summary {
    fn add_amplifier(&mut self, amplifier: &AmplifierServer) {
        let counters = amplifier.counters();
        self.frames_received = counters.received.load(Relaxed);
        self.frames_sent = counters.sent.load(Relaxed);
        self.largest_current_a = counters.largest_a();
        self.enabled_s = counters.enabled_s();
        self.current_a = amplifier.current_a();
        self.state = Some(amplifier.state());
    }

    fn add_line(&mut self, counts: &LineCounts) {
        self.measurements = counts.measurements.load(Relaxed);
        self.bytes_received = counts.received.load(Relaxed);
        self.bytes_sent = counts.sent.load(Relaxed);
    }
}

fn not_emulated(request: &FaultRequest, device: EmulatedDevice) -> EmulatorError {
    let fault = request.text.clone();
    EmulatorError::NotEmulated { fault, device }
}

fn amplifier_place(device: &AmplifierDevice, kind: &str) -> String {
    match can_amplifier(device) {
        Some(can) => {
            let can = can.address();
            format!("{kind} node {} on {}", can.node, can.interface)
        }
        None => kind.into(),
    }
}

fn probe_place(probe: &ProbeServer) -> String {
    let (kind, place) = (probe.kind(), probe.place().display());
    let link = match probe.link() {
        Some(link) => format!(" as {}", link.display()),
        None => String::new(),
    };
    let rate_hz = probe.rate_hz();
    format!("{kind} on {place}{link}, {rate_hz} measurements a second")
}
