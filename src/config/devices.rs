//! What stands behind amplifier and probe: the simulated stage, or a device with its own settings.
//!
//! A new device is one variant here, one file in `devices/` that opens it, and nothing else.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The device that drives the motor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum AmplifierDevice {
    /// The simulated rig.
    Simulated(SimulatedAmplifier),
    /// A CANopen drive (CiA 301, CiA 402) in torque mode.
    Canopen(CanopenSettings),
    /// A VESC in current control.
    Vesc(VescSettings),
}

/// The amplifier of the simulated rig.
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
    /// CAN interface, as `ip link` names it.
    pub interface: String,
    /// Bit rate of the bus in bit/s.
    #[schemars(range(min = 10000, max = 1000000))]
    pub bit_rate: u32,
    /// Node number of the drive.
    #[schemars(range(min = 1, max = 127))]
    pub node: u8,
    /// Our node number, whose heartbeat the drive watches.
    #[serde(default = "own_node")]
    #[schemars(range(min = 1, max = 127))]
    pub own_node: u8,
    /// Rated current of the drive (0x6075) in amperes: checked against what the drive says.
    #[schemars(range(min = 1e-3, max = 1000.0))]
    pub rated_current_a: f64,
    /// What 1000 counts of the target (0x6071) are.
    #[serde(default)]
    pub target_reference: TargetReference,
    /// The largest current (0x6072) as a ratio of the rated one; needed where the target refers to it.
    #[serde(default = "one")]
    #[schemars(range(min = 0.001, max = 32.0))]
    pub maximum_current_ratio: f64,
    /// Mode of operation.
    #[serde(default)]
    pub mode: TorqueMode,
    /// Slope of profile torque (0x6087) in per mille of rated a second.
    #[serde(default = "steepest")]
    #[schemars(range(min = 1, max = 4294967295u32))]
    pub torque_slope_per_mille_per_s: u32,
    /// How set-points and status are exchanged.
    #[serde(default)]
    pub exchange: ExchangeSettings,
    /// Largest load of the bus, as a ratio of its bit rate.
    #[serde(default = "load_limit")]
    #[schemars(range(min = 0.01, max = 1.0))]
    pub load_limit: f64,
    /// What the identity object (0x1018) must say.
    #[serde(default)]
    pub identity: IdentitySettings,
    /// What the drive does when it no longer hears us (0x6007).
    #[serde(default)]
    pub when_unheard: OnCommunicationLoss,
    /// Who is lost after what time.
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

/// What 1000 counts of the target (0x6071) are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TargetReference {
    /// The rated current, 0x6075.
    #[default]
    Rated,
    /// The maximum, 0x6072.
    Maximum,
}

/// Mode of operation of a drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TorqueMode {
    /// Cyclic synchronous torque if the drive has it, else profile torque.
    #[default]
    CyclicElseProfile,
    /// Cyclic synchronous torque (10).
    Cyclic,
    /// Profile torque (4).
    Profile,
}

/// How set-points and status go over the bus.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ExchangeSettings {
    /// With SYNC where the bus carries it, else asynchronous.
    ByBudget {
        /// Status frames in a second, about.
        #[schemars(range(min = 1.0, max = 1000.0))]
        status_hz: f64,
    },
    /// The drive takes a set-point when it comes.
    Asynchronous {
        /// Status frames in a second.
        #[schemars(range(min = 1.0, max = 1000.0))]
        status_hz: f64,
    },
    /// The drive takes a set-point at the SYNC after it.
    Synchronous {
        /// A status frame after so many SYNCs.
        #[schemars(range(min = 1, max = 240))]
        status_every: u8,
    },
}

impl Default for ExchangeSettings {
    fn default() -> Self {
        ExchangeSettings::ByBudget { status_hz: 500.0 }
    }
}

/// What a drive must say of itself; what is absent is not checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IdentitySettings {
    /// Vendor (0x1018.1).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vendor: Option<u32>,
    /// Product code (0x1018.2).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub product: Option<u32>,
    /// Revision (0x1018.3).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub revision: Option<u32>,
    /// Serial number (0x1018.4).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub serial: Option<u32>,
}

/// What a drive does when it no longer hears us (0x6007).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnCommunicationLoss {
    /// It goes into fault (1).
    Fault,
    /// It disables the voltage (2).
    #[default]
    DisableVoltage,
    /// It stops quickly (3).
    QuickStop,
    /// What it does by itself, for drives without this object: prove by unplugging the bus that it stops.
    OwnReaction,
}

/// Who is lost after what time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CanopenTimeouts {
    /// Between heartbeats of the drive, in seconds.
    #[schemars(range(min = 0.001, max = 60.0))]
    pub heartbeat_s: f64,
    /// The drive is lost after so many seconds without one.
    #[schemars(range(min = 0.001, max = 60.0))]
    pub heartbeat_lost_s: f64,
    /// Between our heartbeats, in seconds.
    #[schemars(range(min = 0.001, max = 60.0))]
    pub own_heartbeat_s: f64,
    /// The drive stops after so many seconds without ours.
    #[schemars(range(min = 0.001, max = 60.0))]
    pub own_heartbeat_lost_s: f64,
    /// While enabled, the drive is lost after so many seconds without a status frame.
    #[schemars(range(min = 0.0001, max = 60.0))]
    pub status_lost_s: f64,
    /// While enabled, the drive is switched off after so many seconds without a command.
    #[schemars(range(min = 0.0001, max = 60.0))]
    pub command_lost_s: f64,
    /// Limit for an answer to an SDO request, in seconds.
    #[schemars(range(min = 0.001, max = 60.0))]
    pub sdo_s: f64,
    /// Limit for a change of state, in seconds.
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
    /// CAN interface, as `ip link` names it.
    pub interface: String,
    /// Bit rate of the bus in bit/s.
    #[schemars(range(min = 10000, max = 1000000))]
    pub bit_rate: u32,
    /// Its number on the bus.
    #[schemars(range(min = 0, max = 254))]
    pub node: u8,
    /// It is lost after so many seconds without STATUS.
    #[serde(default = "vesc_status_lost")]
    #[schemars(range(min = 0.001, max = 60.0))]
    pub status_lost_s: f64,
}

fn vesc_status_lost() -> f64 {
    0.1
}

/// The device that reads the stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ProbeDevice {
    /// The simulated rig.
    Simulated(SimulatedProbe),
    /// Micro-Epsilon capaNCDT 61xx over RS485.
    Capancdt(CapancdtSettings),
    /// Micro-Epsilon RS422 stream (optoNCDT family).
    Optoncdt(OptoncdtSettings),
    /// A probe that writes lines of text.
    Ascii(AsciiSettings),
}

/// The probe of the simulated rig: `[sim]` has its settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimulatedProbe {}

/// A serial port and its line: eight data bits, one stop bit, no flow control.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineSettings {
    /// The port; a link below /dev/serial/by-id keeps its name when adapters are plugged in another order.
    pub port: String,
    /// Bits a second.
    #[schemars(range(min = 300, max = 12000000))]
    pub baud: u32,
    /// Parity of a character.
    #[serde(default)]
    pub parity: Parity,
    /// Ask the driver to hand over bytes at once; without it USB adapters collect them for up to 16 ms.
    #[serde(default = "yes")]
    pub low_latency: bool,
    /// Folder of the lock files.
    #[serde(default = "lock_folder")]
    pub lock_folder: String,
}

fn yes() -> bool {
    true
}

fn lock_folder() -> String {
    "/run/lock".into()
}

/// Parity of a character.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Parity {
    /// None.
    #[default]
    None,
    /// Even.
    Even,
}

/// How a probe is mounted: position = gain (reading) + offset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MountingSettings {
    /// Metres of the stage per metre of the probe; negative if the probe faces against positive force.
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub gain: f64,
    /// Position of the stage at the probe's zero, in metres.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub offset_m: f64,
}

/// When a probe is asked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PollingSettings {
    /// From one request to the next in seconds; 0 asks again as soon as the answer is there.
    #[schemars(range(min = 0.0, max = 60.0))]
    pub interval_s: f64,
    /// How long the probe may stay silent, in seconds.
    #[schemars(range(min = 0.001, max = 60.0))]
    pub timeout_s: f64,
    /// Silence in seconds after which a damaged answer counts as over.
    #[schemars(range(min = 0.0001, max = 60.0))]
    pub quiet_s: f64,
}

impl Default for PollingSettings {
    fn default() -> Self {
        PollingSettings {
            interval_s: 0.0,
            timeout_s: 0.1,
            quiet_s: 0.02,
        }
    }
}

/// A capaNCDT 61xx over RS485.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CapancdtSettings {
    /// The serial line: 230400 baud, even parity as delivered.
    pub line: LineSettings,
    /// Measuring range of the sensor in metres.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub sensor_range_m: f64,
    /// How it is mounted.
    pub mounting: MountingSettings,
    /// Address of the probe.
    #[serde(default = "capancdt_address")]
    #[schemars(range(min = 0, max = 255))]
    pub address: u8,
    /// Our address.
    #[serde(default = "master_address")]
    #[schemars(range(min = 0, max = 255))]
    pub own_address: u8,
    /// Which value of an answer its counter numbers.
    #[serde(default)]
    pub counter: CounterMeaning,
    /// When it is asked.
    #[serde(default)]
    pub polling: PollingSettings,
}

fn capancdt_address() -> u8 {
    0x7E
}

fn master_address() -> u8 {
    1
}

/// Which value of an answer its counter numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CounterMeaning {
    /// The newest.
    #[default]
    NewestValue,
    /// The oldest.
    OldestValue,
}

/// A probe with the three-byte stream of the optoNCDT family.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OptoncdtSettings {
    /// The serial line: 921600 baud as delivered.
    pub line: LineSettings,
    /// Measuring range of the sensor in metres.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub sensor_range_m: f64,
    /// How it is mounted.
    pub mounting: MountingSettings,
    /// Values that the probe is set to send a cycle.
    #[serde(default = "one_value")]
    #[schemars(range(min = 1, max = 32))]
    pub values_per_cycle: u8,
    /// Which of them is the displacement, counted from 0.
    #[serde(default)]
    #[schemars(range(min = 0, max = 31))]
    pub displacement_value: u8,
}

fn one_value() -> u8 {
    1
}

/// A probe that writes lines of text. Texts may hold the escapes `\r`, `\n`, `\t`, `\xNN`, `\\`, `\{`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AsciiSettings {
    /// The serial line.
    pub line: LineSettings,
    /// How it is mounted.
    pub mounting: MountingSettings,
    /// A line with a measurement: literals and `{value}` or `{value:WIDTH.DECIMALS}` once, `{skip}` for what may be there.
    pub pattern: String,
    /// What ends a line.
    #[serde(default = "line_end")]
    pub terminator: String,
    /// Metres of one unit of the number: 1e-3 for millimetres.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub unit_m: f64,
    /// Metres at the number 0.
    #[serde(default)]
    #[schemars(range(min = -10.0, max = 10.0))]
    pub zero_m: f64,
    /// Start of the range in metres.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub lower_m: f64,
    /// End of the range in metres.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub upper_m: f64,
    /// Texts in the place of the value that say: not measured.
    #[serde(default)]
    pub invalid: Vec<String>,
    /// Texts in the place of the value that say: above the range.
    #[serde(default)]
    pub over: Vec<String>,
    /// Texts in the place of the value that say: below the range.
    #[serde(default)]
    pub under: Vec<String>,
    /// A line that reports an error: literals, `{skip}` and `{code}` once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// What to send to get a line; absent if the probe speaks by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub request: Option<String>,
    /// When it is asked, if it must be.
    #[serde(default)]
    pub polling: PollingSettings,
}

fn line_end() -> String {
    "\\r\\n".into()
}
