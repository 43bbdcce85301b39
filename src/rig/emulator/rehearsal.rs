//! The acting devices of one rehearsal: one stage, one clock, one journal.

use std::sync::atomic::Ordering::Relaxed;
use std::sync::mpsc::Receiver;
use std::time::Instant;

use serde::Serialize;

use super::fault::EmulatedFault;
use super::journal::{EventLog, LogEntry};
use super::probe::ProbeEndpoint;
use super::stage::seconds;
use super::{Amplifier, EmulatorError, Probe, Stage};
use crate::config::{AmplifierDevice, Config};

/// Which devices act, and where.
#[derive(Clone, Debug, Default)]
pub struct EmulatedDevices {
    /// The amplifier, on the interface of the configuration.
    pub amplifier: bool,
    /// The probe, at this end.
    pub probe: Option<ProbeEndpoint>,
    /// The probe's measurements a second, if not as configured.
    pub measuring_rate_hz: Option<f64>,
}

/// Acting devices at work.
pub struct Emulator {
    amplifier: Option<Amplifier>,
    probe: Option<Probe>,
    stage: Stage,
    journal: EventLog,
    entries: Receiver<LogEntry>,
    start: Instant,
    faults: u64,
    probe_was_lost: bool,
}

/// What a rehearsal came to.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Length in seconds.
    pub duration_s: f64,
    /// Frames that the amplifier heard and sent.
    pub frames_received: u64,
    /// Frames that the amplifier sent.
    pub frames_sent: u64,
    /// Largest |current| given, in amperes.
    pub largest_current_a: f64,
    /// Current at the end, in amperes.
    pub current_a: f64,
    /// When the amplifier was enabled first, in seconds.
    pub enabled_s: Option<f64>,
    /// State of the amplifier's power stage at the end.
    pub state: Option<&'static str>,
    /// Measurements that the probe made.
    pub measurements: u64,
    /// Bytes that the probe received.
    pub bytes_received: u64,
    /// Bytes that the probe sent.
    pub bytes_sent: u64,
    /// Where the stage is at the end, in metres.
    pub position_m: f64,
    /// Faults that were asked for.
    pub faults: u64,
}

impl Emulator {
    /// Opens interface and line, and serves from now on.
    pub fn start(config: &Config, cast: &EmulatedDevices) -> Result<Emulator, EmulatorError> {
        let (journal, entries) = EventLog::new();
        let (stage, start) = (Stage::new(config)?, Instant::now());
        let now_ns = move || start.elapsed().as_nanos() as u64;
        let served = |end| Probe::start(config, end, cast.measuring_rate_hz, stage.clone(), now_ns);
        let probe = cast.probe.as_ref().map(served).transpose()?;
        let opened = || Amplifier::open(config, stage.clone(), journal.clone(), start);
        let amplifier = cast.amplifier.then(opened).transpose()?;
        let (faults, probe_was_lost) = (0, false);
        let rehearsal = Emulator {
            amplifier,
            probe,
            stage,
            journal,
            entries,
            start,
            faults,
            probe_was_lost,
        };
        rehearsal.say_what_is_served(config);
        Ok(rehearsal)
    }

    fn say_what_is_served(&self, config: &Config) {
        if let Some(amplifier) = &self.amplifier {
            let place = match &config.amplifier.device {
                AmplifierDevice::Simulated(_) => String::new(),
                AmplifierDevice::Canopen(device) => {
                    format!("node {} on {}", device.node, device.interface)
                }
                AmplifierDevice::Vesc(device) => {
                    format!("node {} on {}", device.node, device.interface)
                }
            };
            self.write(
                "amplifier",
                "serving",
                format!("{} {place}", amplifier.kind()),
            );
        }
        if let Some(probe) = &self.probe {
            let (kind, place, rate_hz) = (probe.kind(), probe.place().display(), probe.rate_hz());
            let link = probe
                .link()
                .map_or(String::new(), |link| format!(" as {}", link.display()));
            self.write(
                "probe",
                "serving",
                format!("{kind} on {place}{link}, {rate_hz} measurements a second"),
            );
            probe.notes().iter().for_each(|note| {
                self.write("probe", "note", format!("{}; {}", note.what, note.remedy))
            });
        }
    }

    /// Seconds since the start.
    pub fn time_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// When the amplifier was enabled first, in seconds.
    pub fn enabled_s(&self) -> Option<f64> {
        self.amplifier
            .as_ref()
            .and_then(|amplifier| amplifier.tally().enabled_s())
    }

    /// Refuses what the devices served here cannot have.
    pub fn check(&self, word: &str, fault: EmulatedFault) -> Result<(), EmulatorError> {
        let not_served = |device| EmulatorError::NotServed {
            word: word.into(),
            device,
        };
        match (fault, &self.amplifier, &self.probe) {
            (EmulatedFault::Amplifier(_), None, _) => Err(not_served("amplifier")),
            (EmulatedFault::Probe(_), _, None) => Err(not_served("probe")),
            (EmulatedFault::Amplifier(fault), Some(amplifier), _) if !amplifier.knows(fault) => {
                Err(EmulatorError::Fault {
                    kind: amplifier.kind(),
                    word: word.into(),
                })
            }
            _ => Ok(()),
        }
    }

    /// Asks for a fault, or for its end.
    pub fn ask(&mut self, word: &str, fault: EmulatedFault) -> Result<(), EmulatorError> {
        self.check(word, fault)?;
        self.faults += u64::from(fault != fault.end());
        let device = if matches!(fault, EmulatedFault::Probe(_)) {
            "probe"
        } else {
            "amplifier"
        };
        self.write(device, "fault", word.into());
        match (fault, &self.amplifier, &self.probe) {
            (EmulatedFault::Amplifier(fault), Some(amplifier), _) => amplifier.ask(fault)?,
            (EmulatedFault::Probe(fault), _, Some(probe)) => probe.ask(fault),
            (EmulatedFault::None, amplifier, probe) => {
                let sound =
                    super::AmplifierFault::Device(bench_hal::can::emulator::DeviceFault::None);
                amplifier
                    .iter()
                    .try_for_each(|amplifier| amplifier.ask(sound))?;
                probe
                    .iter()
                    .for_each(|probe| probe.ask(bench_hal::serial::emulator::Fault::None));
            }
            _ => {}
        }
        Ok(())
    }

    /// What has changed since this was asked last.
    pub fn news(&mut self) -> Vec<LogEntry> {
        let is_lost = self.probe.as_ref().is_some_and(Probe::is_lost);
        if is_lost && !std::mem::replace(&mut self.probe_was_lost, true) {
            self.write(
                "probe",
                "lost",
                "the serial port is gone; plug it in and start anew".into(),
            );
        }
        self.entries.try_iter().collect()
    }

    fn write(&self, device: &'static str, what: &'static str, text: String) {
        let now_ns = self.start.elapsed().as_nanos() as u64;
        let (current_a, enabled) = self
            .amplifier
            .as_ref()
            .map_or((0.0, false), |a| (a.current_a(), a.is_enabled()));
        let position_m = self.stage.position_m(now_ns);
        let (time_s, since_s) = (seconds(now_ns), None);
        self.journal.write(LogEntry {
            time_s,
            device,
            what,
            text,
            enabled,
            current_a,
            position_m,
            since_s,
        });
    }

    /// What it came to so far.
    pub fn summary(&self) -> Summary {
        let (amplifier, carried) = (
            self.amplifier.as_ref(),
            self.probe.as_ref().map(Probe::carried),
        );
        let tally = amplifier.map(Amplifier::tally);
        Summary {
            duration_s: self.time_s(),
            frames_received: tally.map_or(0, |tally| tally.received.load(Relaxed)),
            frames_sent: tally.map_or(0, |tally| tally.sent.load(Relaxed)),
            largest_current_a: tally.map_or(0.0, |tally| tally.largest_a()),
            current_a: amplifier.map_or(0.0, Amplifier::current_a),
            enabled_s: self.enabled_s(),
            state: amplifier.map(Amplifier::state),
            measurements: carried.map_or(0, |carried| carried.measurements.load(Relaxed)),
            bytes_received: carried.map_or(0, |carried| carried.received.load(Relaxed)),
            bytes_sent: carried.map_or(0, |carried| carried.sent.load(Relaxed)),
            position_m: self
                .stage
                .position_m(self.start.elapsed().as_nanos() as u64),
            faults: self.faults,
        }
    }
}
