//! The register of probes.
//!
//! A new serial probe is its protocol in `hal`, and one line in [`PROBES`]. A probe of another crate is added by
//! [`register_probe`].

use std::borrow::Cow;
use std::sync::Arc;

use bench_base::kinds::{KindExists, Kinds, Table, TableKind, settings_in};
use bench_hal::serial::{Mounting, PortSettings, Protocol, ascii, capancdt, optoncdt};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{DeserializeOwned, Error as _};
use serde::ser::{Error as _, Serializer};
use serde::{Deserialize, Deserializer, Serialize};

/// The devices that read the stage by the `kind` of their table.
static PROBES: Kinds<TableKind<ProbeDevice>> = Kinds::new(
    "kind",
    const {
        &[
            TableKind::new(SIMULATED, SimulatedTable::json_schema, read_simulated),
            serial::<capancdt::Settings>("capancdt"),
            serial::<optoncdt::Settings>("optoncdt"),
            serial::<ascii::Settings>("ascii"),
        ]
    },
);

/// Settings of the protocol of a serial probe.
pub trait ProtocolSettings:
    Protocol + Clone + Serialize + DeserializeOwned + JsonSchema + 'static
{
}

impl<P> ProtocolSettings for P where
    P: Protocol + Clone + Serialize + DeserializeOwned + JsonSchema + 'static
{
}

/// Adds a serial probe that a configuration may name as `kind` in its table `[probe.device]`. Call it before the command line's
/// `main`.
///
/// ```
/// use bench_config::{Source, load, register_probe};
/// use bench_hal::serial::{Decoder, Event, Protocol, Sample, SerialError};
/// use schemars::JsonSchema;
/// use serde::{Deserialize, Serialize};
///
/// /// A probe that sends one byte per measurement.
/// #[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
/// struct ByteProbe {
///     /// Displacement of one count in metres.
///     #[schemars(range(min = 1e-12, max = 1e-3))]
///     count_m: f64,
/// }
///
/// impl Protocol for ByteProbe {
///     fn decoder(&self) -> Result<Box<dyn Decoder>, SerialError> {
///         Ok(Box::new(*self))
///     }
/// }
///
/// impl Decoder for ByteProbe {
///     fn feed(&mut self, bytes: &[u8], out: &mut dyn FnMut(Event)) {
///         for byte in bytes {
///             let position_m = f64::from(*byte) * self.count_m;
///             out(Event::Value(Sample { raw: (*byte).into(), position_m }));
///         }
///     }
///     fn message_bytes(&self) -> u32 {
///         1
///     }
/// }
///
/// register_probe::<ByteProbe>("byte")?;
/// let device = "probe.device={ kind = 'byte', line = { port = '/dev/ttyUSB0', baud = 921600 }, \
///               mounting = { gain = 1.0, offset_m = 0.0 }, count_m = 1e-6 }";
/// let config = load(&Source { config: Some("lab".into()), sets: vec![device.into()], ..Source::default() })?;
/// assert_eq!(config.probe.device.kind(), "byte");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn register_probe<P: ProtocolSettings>(kind: &'static str) -> Result<(), KindExists> {
    PROBES.add(serial::<P>(kind))
}

/// The device that reads the stage.
#[derive(Clone, Debug, PartialEq)]
pub enum ProbeDevice {
    /// The probe of the simulated stage; its settings are in `[sim]`.
    Simulated,
    /// A probe on a serial port.
    Serial(SerialDevice),
}

/// A probe on a serial port, with any protocol.
#[derive(Clone, Debug)]
pub struct SerialDevice {
    /// The serial line.
    pub line: PortSettings,
    /// How the probe is mounted.
    pub mounting: Mounting,
    /// The protocol.
    pub protocol: Arc<dyn Protocol>,
    kind: &'static str,
    /// The settings of the protocol.
    settings: Table,
}

impl PartialEq for SerialDevice {
    /// A protocol is given by its kind and its settings.
    fn eq(&self, other: &SerialDevice) -> bool {
        (self.kind, &self.line, &self.mounting, &self.settings)
            == (other.kind, &other.line, &other.mounting, &other.settings)
    }
}

/// The table of a serial probe: line, mounting, and the settings of its protocol.
#[derive(Serialize, Deserialize, JsonSchema)]
struct SerialTable<P> {
    /// The serial line.
    line: PortSettings,
    /// How the probe is mounted.
    mounting: Mounting,
    /// The protocol.
    #[serde(flatten)]
    protocol: P,
}

/// The probe of the simulated stage; its settings are in `[sim]`.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SimulatedTable {}

/// The name of the kind of the simulated probe.
const SIMULATED: &str = "simulated";

/// A probe on a serial port with the protocol `P`.
const fn serial<P: ProtocolSettings>(kind: &'static str) -> TableKind<ProbeDevice> {
    TableKind::new(kind, SerialTable::<P>::json_schema, read_serial::<P>)
}

fn read_simulated(_: &'static str, table: Table) -> Result<ProbeDevice, serde_json::Error> {
    let SimulatedTable {} = settings_in(table)?;
    Ok(ProbeDevice::Simulated)
}

fn read_serial<P: ProtocolSettings>(
    kind: &'static str,
    table: Table,
) -> Result<ProbeDevice, serde_json::Error> {
    let table: SerialTable<P> = settings_in(table)?;
    // With all defaults, so that a recording has each setting.
    let settings = table_of(&table.protocol)?;
    Ok(ProbeDevice::Serial(SerialDevice {
        line: table.line,
        mounting: table.mounting,
        protocol: Arc::new(table.protocol),
        kind,
        settings,
    }))
}

/// Settings as a table, without those that are absent.
fn table_of(settings: &impl Serialize) -> Result<Table, serde_json::Error> {
    let value = serde_json::to_value(settings)?;
    let mut table: Table = serde_json::from_value(value)?;
    table.retain(|_, value| !value.is_null());
    Ok(table)
}

impl<'de> Deserialize<'de> for ProbeDevice {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let table = Table::deserialize(from)?;
        PROBES.read(table).map_err(D::Error::custom)
    }
}

impl Serialize for ProbeDevice {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        self.table().map_err(S::Error::custom)?.serialize(to)
    }
}

impl JsonSchema for ProbeDevice {
    fn schema_name() -> Cow<'static, str> {
        "ProbeDevice".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = PROBES.schema(generator);
        schema.insert(
            "description".into(),
            "The device that reads the stage.".into(),
        );
        schema
    }
}

impl ProbeDevice {
    /// The name of the kind, as in a configuration.
    pub fn kind(&self) -> &'static str {
        match self {
            ProbeDevice::Simulated => SIMULATED,
            ProbeDevice::Serial(device) => device.kind,
        }
    }

    /// Line, mounting and protocol; `None` for the simulated probe.
    pub fn serial(&self) -> Option<&SerialDevice> {
        match self {
            ProbeDevice::Simulated => None,
            ProbeDevice::Serial(device) => Some(device),
        }
    }

    /// The table in a configuration.
    fn table(&self) -> Result<Table, serde_json::Error> {
        let settings = match self {
            ProbeDevice::Simulated => Table::new(),
            ProbeDevice::Serial(device) => table_of(&SerialTable {
                line: device.line.clone(),
                mounting: device.mounting,
                protocol: device.settings.clone(),
            })?,
        };
        let mut table = Table::new();
        table.insert("kind".into(), self.kind().into());
        table.extend(settings);
        Ok(table)
    }

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

impl SerialDevice {
    /// Lowest and highest position of the stage in metres that the probe can measure as mounted; `None` if its range is unknown.
    pub fn stage_range_m(&self) -> Option<[f64; 2]> {
        let Mounting { gain, offset_m } = self.mounting;
        let [first_m, last_m] = self.protocol.range_m()?;
        let ends_m = [gain * first_m + offset_m, gain * last_m + offset_m];
        Some([ends_m[0].min(ends_m[1]), ends_m[0].max(ends_m[1])])
    }
}
