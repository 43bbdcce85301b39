//! The register of probes.

use std::sync::Arc;

use bench_hal::serial::{Mounting, PortSettings, Protocol, ascii, capancdt, optoncdt};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Makes [`ProbeDevice`] from the registered serial probes: documentation, variant, `kind` in the configuration and settings of
/// the protocol.
macro_rules! serial_probes {
    ($($(#[$doc:meta])+ $variant:ident = $kind:literal: $settings:ty;)+) => {
        /// The device that reads the stage.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "kind")]
        pub enum ProbeDevice {
            /// The probe of the simulated stage.
            #[serde(rename = "simulated")]
            Simulated(SimulatedProbe),
            $($(#[$doc])+ #[serde(rename = $kind)] $variant(SerialDevice<$settings>),)+
        }

        impl ProbeDevice {
            /// The name of the kind, as in a configuration.
            pub fn kind(&self) -> &'static str {
                match self {
                    ProbeDevice::Simulated(_) => "simulated",
                    $(ProbeDevice::$variant(_) => $kind,)+
                }
            }

            /// Line, mounting and protocol; `None` for the simulated probe.
            pub fn serial(&self) -> Option<SerialParts> {
                match self {
                    ProbeDevice::Simulated(_) => None,
                    $(ProbeDevice::$variant(device) => Some(device.parts()),)+
                }
            }
        }
    };
}

serial_probes! {
    /// Micro-Epsilon capaNCDT 61xx over RS485.
    Capancdt = "capancdt": capancdt::Settings;
    /// Micro-Epsilon RS422 stream (optoNCDT family).
    Optoncdt = "optoncdt": optoncdt::Settings;
    /// A probe that sends lines of text.
    Ascii = "ascii": ascii::Settings;
}

/// The probe of the simulated stage; its settings are in `[sim]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimulatedProbe {}

/// A probe on a serial port: line, mounting, and the settings of its protocol.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SerialDevice<P> {
    /// The serial line.
    pub line: PortSettings,
    /// How the probe is mounted.
    pub mounting: Mounting,
    /// The protocol.
    #[serde(flatten)]
    pub protocol: P,
}

/// The parts of a serial probe, for any protocol.
#[derive(Clone, Debug)]
pub struct SerialParts {
    /// The serial line.
    pub line: PortSettings,
    /// How the probe is mounted.
    pub mounting: Mounting,
    /// The protocol.
    pub protocol: Arc<dyn Protocol>,
}

impl ProbeDevice {
    /// Metres of the stage per metre of the probe, by the mounting; 1 for the simulated probe.
    pub fn mounting_gain(&self) -> f64 {
        self.serial().map_or(1.0, |serial| serial.mounting.gain)
    }

    /// The scales between probe and position as text, for plans and certificates; `None` for the simulated probe.
    pub fn scale_text(&self) -> Option<String> {
        let serial = self.serial()?;
        let Mounting { gain, offset_m } = serial.mounting;
        let range = match serial.protocol.range_m() {
            Some([first_m, last_m]) => format!("{} to {} mm", 1e3 * first_m, 1e3 * last_m),
            None => "unknown".into(),
        };
        Some(format!(
            "{}, range {range}, mounting gain {gain}, offset {} mm",
            self.kind(),
            1e3 * offset_m
        ))
    }
}

impl SerialParts {
    /// Lowest and highest position of the stage in metres that the probe can measure as mounted; `None` if its range is unknown.
    pub fn stage_range_m(&self) -> Option<[f64; 2]> {
        let Mounting { gain, offset_m } = self.mounting;
        let [first_m, last_m] = self.protocol.range_m()?;
        let ends_m = [gain * first_m + offset_m, gain * last_m + offset_m];
        Some([ends_m[0].min(ends_m[1]), ends_m[0].max(ends_m[1])])
    }
}

impl<P: Protocol + Clone + 'static> SerialDevice<P> {
    fn parts(&self) -> SerialParts {
        SerialParts {
            line: self.line.clone(),
            mounting: self.mounting,
            protocol: Arc::new(self.protocol.clone()),
        }
    }
}
