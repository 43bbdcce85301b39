//! Micro-Epsilon RS422 stream (optoNCDT family): the probe sends three bytes per value, without requests.
//!
//! Source: manual optoNCDT 1420, chapter "Digital interfaces RS422". 921600 baud, 8N1, up to 4 kHz; 33 us per value.
//!
//! ```text
//! L  0 0 D5  D4  D3  D2  D1  D0
//! M  0 1 D11 D10 D9  D8  D7  D6
//! H  1 F D17 D16 D15 D14 D13 D12      F: 0 = first value of a cycle, 1 = a further one
//!
//! x = D15..D0:  d = (x * 102 / 65520 - 1) / 100 * range;  643..=64877 is within the range
//! D17 or D16 set: not a value but an error
//! ```
//!
//! # Limits of the protocol
//!
//! There is no checksum, no counter and, at 8N1, no parity: two bits of each byte give its place in the message, the
//! other six cannot be checked. Therefore:
//!
//! * A flipped data bit gives a wrong value; the error is up to half the range.
//! * Bytes lost in groups of three join the parts of two values: `L | M' H'` is wrong by at most 63 counts, `L M | H'` by
//!   a multiple of 4096 counts (6 % of the range) if the signal crosses such a boundary in between.
//! * Lost values are not detected unless a message was cut.
//! * Of random bytes, one triple in 64 is a message (1/4 L, 1/4 M, 1/4 H with F = 0), one in 256 a value without error
//!   bits, and 64235/65536 of those are in range: 3.83 valid values in 1000 bytes of noise.
//!
//! Jumps that the stage cannot make are left to the interlocks.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::decoder::{DamageCounter, Decoder, Event, Sample};
use super::emulator::Responder;
use super::error::{SerialError, positive};
use super::protocol::Protocol;

/// Lowest count within the range.
pub const RANGE_START: u32 = 643;
/// Highest count within the range.
pub const RANGE_END: u32 = 64877;
/// Highest 16-bit value; a larger number is an error code.
const VALUE_MAX: u32 = 0xFFFF;
/// Stands beside the number of an error. The manual that this module follows says only that errors have 18 bits, so it gives no
/// number a meaning.
const ERROR_TEXT: &str = "the probe reports an error; see its manual for the number";

/// The values that the probe sends at each measurement.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Cycle {
    /// Number of values per cycle, 1 to 32.
    #[serde(rename = "values_per_cycle", default = "one_value")]
    #[schemars(range(min = 1, max = 32))]
    pub values: u8,
    /// Index of the displacement among them, from 0.
    #[serde(rename = "displacement_value", default)]
    #[schemars(range(min = 0, max = 31))]
    pub displacement: u8,
}

fn one_value() -> u8 {
    1
}

/// Settings of the protocol.
///
/// ```
/// let settings = bench_hal::serial::optoncdt::Settings::new(10e-3);
/// assert!((settings.metres(32760) - 5e-3).abs() < 1e-15); // the middle of the range
/// assert_eq!(settings.counts(5e-3), 32760);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Settings {
    /// Measuring range in metres.
    #[serde(rename = "sensor_range_m")]
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub range_m: f64,
    /// The values per cycle.
    #[serde(flatten)]
    pub cycle: Cycle,
}

impl Settings {
    /// A probe with this measuring range that sends only the displacement.
    pub fn new(range_m: f64) -> Self {
        Self {
            range_m,
            cycle: Cycle {
                values: 1,
                displacement: 0,
            },
        }
    }

    /// Position of `x` counts in metres from the start of the range.
    pub fn metres(&self, x: u32) -> f64 {
        (f64::from(x) * 102.0 / 65520.0 - 1.0) / 100.0 * self.range_m
    }

    /// Counts at `position_m`, rounded and limited to 0..=65520.
    pub fn counts(&self, position_m: f64) -> u32 {
        let counts = (position_m / self.range_m * 100.0 + 1.0) / 102.0 * 65520.0;
        counts.round().clamp(0.0, 65520.0) as u32
    }

    fn event(&self, x: u32) -> Event {
        if x > VALUE_MAX {
            return Event::Fault {
                code: i64::from(x),
                text: ERROR_TEXT,
            };
        }
        let sample = Sample {
            raw: i64::from(x),
            position_m: self.metres(x).clamp(0.0, self.range_m),
        };
        if (RANGE_START..=RANGE_END).contains(&x) {
            Event::Value(sample)
        } else {
            Event::OutOfRange(sample)
        }
    }
}

impl Protocol for Settings {
    fn decoder(&self) -> Result<Box<dyn Decoder>, SerialError> {
        Ok(Box::new(Optoncdt::new(self.clone())?))
    }

    fn range_m(&self) -> Option<[f64; 2]> {
        Some([0.0, self.range_m])
    }

    fn characters_per_reading(&self) -> Option<u32> {
        Some(3 * u32::from(self.cycle.values))
    }

    fn responder(&self) -> Result<Box<dyn Responder>, SerialError> {
        Ok(Box::new(OptoncdtResponder {
            settings: self.clone(),
            is_cut: false,
        }))
    }
}

/// The message with the 18 bits of `x`.
pub fn message(x: u32, is_first: bool) -> [u8; 3] {
    let [low, middle, high] = [0, 6, 12].map(|shift| (x >> shift) as u8 & 0x3F);
    [low, 0x40 | middle, 0x80 | u8::from(!is_first) << 6 | high]
}

/// Decodes the stream of one probe.
#[derive(Debug)]
pub struct Optoncdt {
    settings: Settings,
    partial: Partial,
    /// Index of the next further value in the cycle; `None` until a first value has been received undamaged.
    next_index: Option<u8>,
    damage: DamageCounter,
}

/// The received part of a message, without its marking bits.
#[derive(Clone, Copy, Debug)]
enum Partial {
    Empty,
    Low(u32),
    LowMiddle(u32),
}

impl Partial {
    fn bytes(self) -> u32 {
        match self {
            Self::Empty => 0,
            Self::Low(_) => 1,
            Self::LowMiddle(_) => 2,
        }
    }
}

impl Optoncdt {
    /// A decoder that has not received anything yet.
    pub fn new(settings: Settings) -> Result<Self, SerialError> {
        positive("range_m", settings.range_m)?;
        let Cycle {
            values,
            displacement,
        } = settings.cycle;
        if !(1..=32).contains(&values) || displacement >= values {
            return Err(SerialError::Setting {
                name: "cycle",
                value: format!("{displacement} of {values}"),
                expected: "1 to 32 values per cycle, and the index of the displacement, from 0, below that number",
            });
        }
        Ok(Self {
            settings,
            partial: Partial::Empty,
            next_index: None,
            damage: DamageCounter::default(),
        })
    }

    fn take_byte(&mut self, byte: u8, out: &mut dyn FnMut(Event)) {
        let data = u32::from(byte & 0x3F);
        match (byte >> 6, self.partial) {
            (0, _) => {
                self.discard(0, out);
                self.partial = Partial::Low(data);
            }
            (1, Partial::Low(low)) => self.partial = Partial::LowMiddle(low | data << 6),
            (2 | 3, Partial::LowMiddle(low)) => {
                self.partial = Partial::Empty;
                self.take_message(low | data << 12, byte & 0x40 == 0, out);
            }
            _ => self.discard(1, out),
        }
    }

    /// Reports the partial message and `more` bytes as damaged.
    fn discard(&mut self, more: u32, out: &mut dyn FnMut(Event)) {
        let bytes = std::mem::replace(&mut self.partial, Partial::Empty).bytes() + more;
        if bytes > 0 {
            self.next_index = None;
            self.damage.add(bytes, out);
        }
    }

    fn take_message(&mut self, x: u32, is_first: bool, out: &mut dyn FnMut(Event)) {
        let cycle = &self.settings.cycle;
        let index = if is_first { Some(0) } else { self.next_index };
        let Some(index) = index.filter(|index| *index < cycle.values) else {
            return self.discard(3, out);
        };
        self.damage.report(out);
        self.next_index = Some(index + 1);
        if index == cycle.displacement {
            out(self.settings.event(x));
        }
    }
}

impl Decoder for Optoncdt {
    fn feed(&mut self, bytes: &[u8], out: &mut dyn FnMut(Event)) {
        for &byte in bytes {
            self.take_byte(byte, out);
        }
    }

    fn reset(&mut self, out: &mut dyn FnMut(Event)) {
        self.discard(0, out);
        self.next_index = None;
        self.damage.report(out);
    }

    fn message_bytes(&self) -> u32 {
        3 * (1 + u32::from(self.settings.cycle.displacement))
    }
}

/// An emulated probe: sends a cycle at each measurement.
struct OptoncdtResponder {
    settings: Settings,
    /// The next cycle is cut off after two bytes: the probe has restarted while sending it.
    is_cut: bool,
}

impl Responder for OptoncdtResponder {
    /// One cycle; the values other than the displacement are zero.
    fn measure(&mut self, position_m: f64) -> Vec<u8> {
        let Cycle {
            values,
            displacement,
        } = self.settings.cycle;
        let mut cycle = vec![0; usize::from(values)];
        if let Some(x) = cycle.get_mut(usize::from(displacement)) {
            *x = self.settings.counts(position_m);
        }
        let mut bytes = Vec::new();
        for (index, x) in cycle.into_iter().enumerate() {
            bytes.extend(message(x, index == 0));
        }
        if std::mem::take(&mut self.is_cut) {
            bytes.truncate(2);
        }
        bytes
    }

    fn receive(&mut self, _byte: u8) -> Vec<u8> {
        Vec::new()
    }

    fn restart(&mut self) {
        self.is_cut = true;
    }

    fn out_of_range_m(&self) -> f64 {
        2.0 * self.settings.range_m
    }
}
