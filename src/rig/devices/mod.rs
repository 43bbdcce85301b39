//! From a configuration to the rig that it names: the simulated stage, or real devices behind the same boundary.
//!
//! ```text
//!  [amplifier.device] --> amplifier.rs --> CanopenDrive | Vesc  --\
//!                                                                  Devices = Rig --> the loop
//!  [probe.device]     --> probe.rs     --> SerialProbe          --/
//! ```
//!
//! To add a device: a variant in `config/devices.rs`, and its arm in [`amplifier`] or [`probe`].

pub mod amplifier;
pub mod probe;

use std::time::{Duration, Instant};

use bench_hal::serial::StatisticsHandle;
use bench_hal::{CurrentAmplifier, Devices, DisplacementProbe, Rig, Tick, Validity};

use crate::config::{AmplifierDevice, Config, ProbeDevice};
use crate::model::plant::PlantError;
use crate::rig::simulated::SimulatedRig;

pub use amplifier::AmplifierError;
pub use probe::ProbeError;

/// How long a probe may take to its first reading.
const FIRST_READING: Duration = Duration::from_secs(2);

/// A rig that cannot be opened. Nothing moved.
#[derive(Debug, thiserror::Error)]
pub enum DevicesError {
    /// The model of the simulated stage cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The amplifier.
    #[error("amplifier: {0}; nothing moved")]
    Amplifier(#[from] AmplifierError),
    /// The probe.
    #[error("probe: {0}; nothing moved")]
    Probe(#[from] ProbeError),
    /// One is simulated, the other is not.
    #[error(
        "amplifier.device is {amplifier}, probe.device is {probe}: a current that flows and a reading of another stage make no loop; set both to devices or both to `simulated`"
    )]
    Mixed {
        /// Kind of the amplifier.
        amplifier: &'static str,
        /// Kind of the probe.
        probe: &'static str,
    },
    /// The probe is open, but says nothing of use.
    #[error(
        "probe: {what} within {} s of opening: {bytes} bytes, {values} values, {damaged} damaged bytes, {timeouts} missing answers came; `bench doctor` looks closer; nothing moved",
        FIRST_READING.as_secs()
    )]
    NoReading {
        /// What was missing.
        what: &'static str,
        /// Bytes received.
        bytes: u64,
        /// Values decoded.
        values: u64,
        /// Bytes that belong to no message.
        damaged: u64,
        /// Requests without an answer.
        timeouts: u64,
    },
}

/// An open rig.
pub struct OpenRig {
    /// What the loop drives.
    pub rig: Box<dyn Rig>,
    /// Which amplifier it is, as it says itself.
    pub amplifier: String,
    /// Which probe it is, as far as it can be told.
    pub probe: String,
    /// What a person should know before the run: line settings not taken, and the like.
    pub notes: Vec<String>,
    /// Counts of the probe's reader, while the loop has the rig.
    pub watch: Option<StatisticsHandle>,
}

/// Whether the configuration names no device.
pub fn is_simulated(config: &Config) -> bool {
    matches!(config.amplifier.device, AmplifierDevice::Simulated(_))
        && matches!(config.probe.device, ProbeDevice::Simulated(_))
}

/// Refuses what the named devices cannot do, before anything is opened: what the bus does not carry, settings that make no
/// sense, a line slower than `probe.transport_s` says.
pub fn check(config: &Config) -> Result<(), DevicesError> {
    amplifier::check(config)?;
    Ok(probe::check(config)?)
}

/// Opens what the configuration names. Afterwards the amplifier is off, and the probe gives valid readings.
pub fn open(config: &Config) -> Result<OpenRig, DevicesError> {
    if is_simulated(config) {
        return simulate(config);
    }
    let (amplifier, probe) = (config.amplifier.device.kind(), config.probe.device.kind());
    if "simulated" == amplifier || "simulated" == probe {
        return Err(DevicesError::Mixed { amplifier, probe });
    }
    let mut probe = probe::open(config)?;
    let (amplifier, amplifier_identity) = amplifier::open(config)?;
    let notes = probe
        .notes()
        .iter()
        .map(|note| format!("{}; {}", note.what, note.remedy))
        .collect();
    let watch = probe.statistics_handle();
    wait_for_reading(&mut probe, &watch)?;
    let rig = Box::new(Devices { amplifier, probe });
    let (amplifier, probe) = (amplifier_identity, probe::identity(config));
    Ok(OpenRig {
        rig,
        amplifier,
        probe,
        notes,
        watch: Some(watch),
    })
}

/// The simulated stage with the rates, delays and steps of whatever devices the configuration names.
pub fn simulate(config: &Config) -> Result<OpenRig, DevicesError> {
    let (rig, name) = (Box::new(SimulatedRig::new(config)?), || {
        "simulated".to_string()
    });
    Ok(OpenRig {
        rig,
        amplifier: name(),
        probe: name(),
        notes: Vec::new(),
        watch: None,
    })
}

/// A run that began before the first reading would trip at once.
fn wait_for_reading(
    probe: &mut impl DisplacementProbe,
    watch: &StatisticsHandle,
) -> Result<(), DevicesError> {
    let begin = Instant::now();
    loop {
        let reading = probe.latest(Tick::default());
        if reading.validity == Validity::Valid {
            return Ok(());
        }
        if begin.elapsed() > FIRST_READING {
            return Err(no_reading(reading.validity, watch));
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn no_reading(validity: Validity, watch: &StatisticsHandle) -> DevicesError {
    let s = watch.statistics();
    let what = match validity {
        Validity::OutOfRange => "the target stayed outside the probe's range",
        Validity::Faulty => "the probe said that it cannot measure",
        _ => "no reading came",
    };
    let (bytes, values, damaged, timeouts) = (s.bytes, s.values, s.damaged_bytes, s.timeouts);
    DevicesError::NoReading {
        what,
        bytes,
        values,
        damaged,
        timeouts,
    }
}

impl AmplifierDevice {
    /// The name of the kind, as in a configuration.
    pub fn kind(&self) -> &'static str {
        match self {
            AmplifierDevice::Simulated(_) => "simulated",
            AmplifierDevice::Canopen(_) => "canopen",
            AmplifierDevice::Vesc(_) => "vesc",
        }
    }
}

impl ProbeDevice {
    /// The name of the kind, as in a configuration.
    pub fn kind(&self) -> &'static str {
        match self {
            ProbeDevice::Simulated(_) => "simulated",
            ProbeDevice::Capancdt(_) => "capancdt",
            ProbeDevice::Optoncdt(_) => "optoncdt",
            ProbeDevice::Ascii(_) => "ascii",
        }
    }
}

/// Any amplifier.
pub type Amplifier = Box<dyn CurrentAmplifier>;
