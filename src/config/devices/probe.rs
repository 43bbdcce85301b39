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

impl<P: Protocol + Clone + 'static> SerialDevice<P> {
    fn parts(&self) -> SerialParts {
        SerialParts {
            line: self.line.clone(),
            mounting: self.mounting,
            protocol: Arc::new(self.protocol.clone()),
        }
    }
}
