//! From a configuration to the rig that it describes: the simulated stage, or real devices behind the same traits.
//!
//! ```text
//!  [amplifier.device] --> amplifier.rs --> CanopenDrive | Vesc  --\
//!                                                                  Devices = Rig (--> Deferred) --> the loop
//!  [probe.device]     --> probe.rs     --> SerialProbe          --/
//! ```
//!
//! `docs/adding-a-probe.md` and `docs/adding-an-amplifier.md` describe how a device is added.

pub mod amplifier;
pub mod canopen;
pub mod deferred;
pub mod probe;
mod reservation;
pub mod vesc;

use std::time::{Duration, Instant};

use bench_hal::serial::{Note, SerialProbe, StatisticsHandle};
use bench_hal::{Devices, DisplacementProbe, Rig, Tick, Validity};

use crate::simulated::SimulatedRig;
use bench_config::{AmplifierDevice, Config, ProbeDevice};
use bench_plant::PlantError;

use deferred::{ComputingDelayError, OutputTiming};

pub use amplifier::{AmplifierError, CanAmplifier, Requirements, can_amplifier};
pub use probe::ProbeError;
pub use reservation::{DeviceInUse, Reservation};

/// How long a probe may take to give its first valid reading.
pub const FIRST_READING: Duration = Duration::from_secs(2);
/// Pause between two attempts to read it.
const RETRY: Duration = Duration::from_millis(1);

/// A rig that cannot be opened. Nothing was moved.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DevicesError {
    /// The model of the simulated stage cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The amplifier.
    #[error("amplifier: {0}; nothing was moved")]
    Amplifier(#[from] AmplifierError),
    /// The probe.
    #[error("probe: {0}; nothing was moved")]
    Probe(#[from] ProbeError),
    /// Only one of both is simulated.
    #[error(
        "amplifier.device is {amplifier} and probe.device is {probe}, but a loop needs two real devices or two simulated ones; set both to `simulated`, or neither"
    )]
    Mixed {
        /// Kind of the amplifier.
        amplifier: &'static str,
        /// Kind of the probe.
        probe: &'static str,
    },
    /// Another process has reserved a device.
    #[error(transparent)]
    InUse(#[from] DeviceInUse),
    /// The computing delay.
    #[error(transparent)]
    ComputingDelay(#[from] ComputingDelayError),
    /// The probe is open, but gives no valid reading.
    #[error(
        "probe: {what} within {} s of opening ({bytes} bytes, {values} values, {damaged} damaged bytes, {timeouts} missing answers received); examine it with `bench doctor`; nothing was moved",
        FIRST_READING.as_secs()
    )]
    NoReading {
        /// The missing reading.
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
    /// The devices of the rig are reserved for this process; `None` for the simulated stage.
    pub reservation: Option<Reservation>,
    /// The rig for the loop.
    pub rig: Box<dyn Rig>,
    /// Identity of the amplifier, as it reports it.
    pub amplifier: String,
    /// Identity of the probe, as far as it is known.
    pub probe: String,
    /// Notes for the operator, for example line settings that the port did not accept.
    pub notes: Vec<String>,
    /// Statistics of the probe, while the loop owns the rig.
    pub watch: Option<StatisticsHandle>,
}

/// Whether amplifier and probe are simulated.
pub fn is_simulated(config: &Config) -> bool {
    matches!(config.amplifier.device, AmplifierDevice::Simulated(_))
        && matches!(config.probe.device, ProbeDevice::Simulated)
}

/// Refuses a configuration in which only one of amplifier and probe is simulated.
pub fn check_kinds(config: &Config) -> Result<(), DevicesError> {
    let amplifier_is_simulated = matches!(config.amplifier.device, AmplifierDevice::Simulated(_));
    let probe_is_simulated = matches!(config.probe.device, ProbeDevice::Simulated);
    if amplifier_is_simulated == probe_is_simulated {
        return Ok(());
    }
    Err(DevicesError::Mixed {
        amplifier: config.amplifier.device.kind(),
        probe: config.probe.device.kind(),
    })
}

/// Refuses what the configured devices cannot do, before anything is opened: a computing delay of several periods, a bus load above the limit, invalid settings, a
/// serial line slower than `probe.transport_s`.
pub fn check(config: &Config) -> Result<(), DevicesError> {
    if !is_simulated(config) {
        OutputTiming::of(&config.servo)?;
    }
    amplifier::check(&config.amplifier, &config.servo)?;
    Ok(probe::check(&config.probe)?)
}

/// Opens the configured rig. Afterwards the amplifier is off, and the probe gives valid readings.
pub fn open(config: &Config) -> Result<OpenRig, DevicesError> {
    if is_simulated(config) {
        return simulate(config);
    }
    check_kinds(config)?;
    let timing = OutputTiming::of(&config.servo)?;
    let reservation = Reservation::take(config)?;
    let mut probe = probe::open(&config.probe, config.servo.priority)?;
    let (amplifier, amplifier_identity) = amplifier::open(&config.amplifier, &config.servo)?;
    wait_for_reading(&mut probe)?;
    Ok(OpenRig {
        reservation: Some(reservation),
        amplifier: amplifier_identity,
        probe: probe::identity(&config.probe.device),
        notes: probe.notes().iter().map(Note::to_string).collect(),
        watch: Some(probe.statistics_handle()),
        rig: timing.apply(Devices { amplifier, probe }),
    })
}

/// Identity of amplifier and probe of the simulated stage.
pub const SIMULATED: &str = "simulated";

/// The simulated stage with the rates, delays and resolutions of the configured devices.
pub fn simulate(config: &Config) -> Result<OpenRig, DevicesError> {
    Ok(OpenRig {
        reservation: None,
        rig: Box::new(SimulatedRig::new(config)?),
        amplifier: SIMULATED.into(),
        probe: SIMULATED.into(),
        notes: Vec::new(),
        watch: None,
    })
}

/// Waits for the first valid reading, because a run without one would trip at once.
fn wait_for_reading(probe: &mut SerialProbe) -> Result<(), DevicesError> {
    match first_reading(probe) {
        Validity::Valid => Ok(()),
        validity => Err(no_reading(validity, probe)),
    }
}

/// Waits for a valid reading, at most [`FIRST_READING`]; returns the validity of the last reading.
pub fn first_reading(probe: &mut SerialProbe) -> Validity {
    let begin = Instant::now();
    loop {
        let validity = probe.latest(Tick::default()).validity;
        if validity == Validity::Valid || begin.elapsed() > FIRST_READING {
            return validity;
        }
        std::thread::sleep(RETRY);
    }
}

fn no_reading(validity: Validity, probe: &SerialProbe) -> DevicesError {
    let statistics = probe.statistics();
    let what = match validity {
        Validity::OutOfRange => "the target stayed outside the probe's range",
        Validity::Faulty => "the probe reported that it cannot measure",
        _ => "no reading was received",
    };
    DevicesError::NoReading {
        what,
        bytes: statistics.bytes,
        values: statistics.values,
        damaged: statistics.damaged_bytes,
        timeouts: statistics.timeouts,
    }
}
