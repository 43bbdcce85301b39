//! The register of amplifiers, and their settings.

use bench_hal::can::drive::{ExpectedIdentity, TorqueMode};
use bench_hal::can::scale::Reference;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The device that drives the motor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum AmplifierDevice {
    /// The amplifier of the simulated stage.
    Simulated(SimulatedAmplifier),
    /// A CANopen drive (CiA 301, CiA 402) in torque mode.
    Canopen(CanopenSettings),
    /// A VESC in current control.
    Vesc(VescSettings),
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

/// The amplifier of the simulated stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimulatedAmplifier {
    /// Step of the current in amperes; 0 for none.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub current_step_a: f64,
}

/// A CANopen drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CanopenSettings {
    /// CAN interface, as `ip link` names it. Linux allows 15 characters.
    #[schemars(length(min = 1, max = 15))]
    pub interface: String,
    /// Bit rate of the bus in bit/s.
    #[schemars(range(min = 10000, max = 1000000))]
    pub bit_rate: u32,
    /// Node number of the drive.
    #[schemars(range(min = 1, max = 127))]
    pub node: u8,
    /// Node number of this computer, whose heartbeat the drive monitors.
    #[serde(default = "own_node")]
    #[schemars(range(min = 1, max = 127))]
    pub own_node: u8,
    /// Rated current of the drive (0x6075) in amperes. It is compared with the value in the drive.
    #[schemars(range(min = 1e-3, max = 1000.0))]
    pub rated_current_a: f64,
    /// The current that 1000 counts of the target (0x6071) represent.
    #[serde(default)]
    pub target_reference: Reference,
    /// Maximum current (0x6072) as a ratio of the rated current; needed if the target refers to it.
    #[serde(default = "one")]
    #[schemars(range(min = 0.001, max = 32.0))]
    pub maximum_current_ratio: f64,
    /// Mode of operation.
    #[serde(default)]
    pub mode: TorqueMode,
    /// Slope of profile torque (0x6087) in per mille of the rated current per second.
    #[serde(default = "steepest")]
    #[schemars(range(min = 1, max = 4294967295u32))]
    pub torque_slope_per_mille_per_s: u32,
    /// Exchange of set-points and status.
    #[serde(default)]
    pub exchange: ExchangeSettings,
    /// Limit of the bus load, as a ratio of the bit rate.
    #[serde(default = "load_limit")]
    #[schemars(range(min = 0.01, max = 1.0))]
    pub load_limit: f64,
    /// Expected values of the identity object (0x1018).
    #[serde(default)]
    pub identity: ExpectedIdentity,
    /// Reaction of the drive to the loss of communication (0x6007).
    #[serde(default)]
    pub on_communication_loss: OnCommunicationLoss,
    /// Heartbeat periods and timeouts.
    #[serde(default)]
    pub times: CanopenTimeouts,
}

fn own_node() -> u8 {
    127
}

fn one() -> f64 {
    1.0
}

fn steepest() -> u32 {
    u32::MAX
}

fn load_limit() -> f64 {
    0.8
}

/// How set-points and status frames are exchanged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ExchangeSettings {
    /// With SYNC if the bus load allows it, otherwise asynchronous.
    ByBudget {
        /// Approximate number of status frames per second.
        #[schemars(range(min = 1.0, max = 1000.0))]
        status_hz: f64,
    },
    /// The drive applies a set-point when it arrives.
    Asynchronous {
        /// Status frames per second.
        #[schemars(range(min = 1.0, max = 1000.0))]
        status_hz: f64,
    },
    /// The drive applies a set-point at the next SYNC.
    Synchronous {
        /// Number of SYNCs per status frame.
        #[schemars(range(min = 1, max = 240))]
        status_every: u8,
    },
}

impl Default for ExchangeSettings {
    fn default() -> Self {
        ExchangeSettings::ByBudget { status_hz: 500.0 }
    }
}

/// Reaction of a drive to the loss of communication (0x6007).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnCommunicationLoss {
    /// State fault (1).
    Fault,
    /// Disable the voltage (2).
    #[default]
    DisableVoltage,
    /// Quick stop (3).
    QuickStop,
    /// The drive's own reaction, for drives without this object. Unplug the bus to verify that the drive stops.
    OwnReaction,
}

/// Heartbeat periods and timeouts of a CANopen drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CanopenTimeouts {
    /// Heartbeat period of the drive, in seconds.
    #[schemars(range(min = 0.001, max = 60.0))]
    pub heartbeat_s: f64,
    /// Timeout of the drive's heartbeat, in seconds.
    #[schemars(range(min = 0.001, max = 60.0))]
    pub heartbeat_lost_s: f64,
    /// Heartbeat period of this computer, in seconds.
    #[schemars(range(min = 0.001, max = 60.0))]
    pub own_heartbeat_s: f64,
    /// The drive stops after this time without the computer's heartbeat, in seconds.
    #[schemars(range(min = 0.001, max = 60.0))]
    pub own_heartbeat_lost_s: f64,
    /// Timeout of the status frames while the drive is enabled, in seconds.
    #[schemars(range(min = 0.0001, max = 60.0))]
    pub status_lost_s: f64,
    /// The drive is switched off after this time without a command while it is enabled, in seconds.
    #[schemars(range(min = 0.0001, max = 60.0))]
    pub command_lost_s: f64,
    /// Timeout of an SDO request, in seconds.
    #[schemars(range(min = 0.001, max = 60.0))]
    pub sdo_s: f64,
    /// Timeout of a change of state, in seconds.
    #[schemars(range(min = 0.001, max = 60.0))]
    pub state_s: f64,
}

impl Default for CanopenTimeouts {
    fn default() -> Self {
        CanopenTimeouts {
            heartbeat_s: 0.02,
            heartbeat_lost_s: 0.07,
            own_heartbeat_s: 0.02,
            own_heartbeat_lost_s: 0.07,
            status_lost_s: 0.02,
            command_lost_s: 0.02,
            sdo_s: 0.5,
            state_s: 2.0,
        }
    }
}

/// A VESC.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VescSettings {
    /// CAN interface, as `ip link` names it. Linux allows 15 characters.
    #[schemars(length(min = 1, max = 15))]
    pub interface: String,
    /// Bit rate of the bus in bit/s.
    #[schemars(range(min = 10000, max = 1000000))]
    pub bit_rate: u32,
    /// Number of the VESC on the bus.
    #[schemars(range(min = 0, max = 254))]
    pub node: u8,
    /// Timeout of the STATUS frames, in seconds.
    #[serde(default = "vesc_status_lost")]
    #[schemars(range(min = 0.001, max = 60.0))]
    pub status_lost_s: f64,
}

fn vesc_status_lost() -> f64 {
    0.1
}
