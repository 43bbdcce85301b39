//! Micro-Epsilon RS422 stream (optoNCDT family): the probe sends three bytes a value, unasked.
//!
//! Source: manual optoNCDT 1420, chapter "Digital interfaces RS422". 921600 baud, 8N1, up to 4 kHz; 33 us a value.
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
//! # What the protocol cannot know
//!
//! There is no checksum, no counter and, at 8N1, no parity: two bits of eight say where a byte belongs, the other six
//! are believed. So
//!
//! * a flipped data bit is a wrong value, by up to half the range;
//! * bytes lost in threes join the parts of two values: `L | M' H'` is wrong by at most 63 counts, `L M | H'` by a multiple
//!   of 4096 counts (6 % of the range) when the signal crosses such a boundary in between;
//! * lost values leave no trace unless a message was cut;
//! * of random bytes one triple in 64 is a message (1/4 L, 1/4 M, 1/4 H with F = 0), one in 256 a value without error
//!   bits, and 64235/65536 of those are in range: 3.83 valid values in 1000 bytes of noise.
//!
//! A jump that the stage cannot make is for the interlocks to see.

use super::decoder::{Damage, Decoder, Event, Sample};
use super::error::{SerialError, positive};

/// Lowest count within the range.
pub const RANGE_START: u32 = 643;
/// Highest count within the range.
pub const RANGE_END: u32 = 64877;
/// Highest count that is a value at all.
const VALUE_MAX: u32 = 0xFFFF;

/// What the probe is set to send at each measurement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cycle {
    /// Values the probe is set to send a cycle, 1 to 32.
    pub values: u8,
    /// Which of them is the displacement, counted from 0.
    pub displacement: u8,
}

/// A probe of this family on the line.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Measuring range, metres.
    pub range_m: f64,
    /// What a cycle of the probe's output holds.
    pub cycle: Cycle,
}

impl Settings {
    /// A probe of this range that sends nothing but the displacement.
    pub fn new(range_m: f64) -> Self {
        Self {
            range_m,
            cycle: Cycle {
                values: 1,
                displacement: 0,
            },
        }
    }

    /// Metres of `x` counts from the start of the range.
    pub fn metres(&self, x: u32) -> f64 {
        (f64::from(x) * 102.0 / 65520.0 - 1.0) / 100.0 * self.range_m
    }

    /// Counts at `position_m`, rounded, within what the probe can say: the device's side.
    pub fn counts(&self, position_m: f64) -> u32 {
        ((position_m / self.range_m * 100.0 + 1.0) / 102.0 * 65520.0)
            .round()
            .clamp(0.0, 65520.0) as u32
    }

    fn event(&self, x: u32) -> Event {
        if x > VALUE_MAX {
            return Event::Fault {
                code: i64::from(x),
                words: words(x),
            };
        }
        let position_m = self.metres(x).clamp(0.0, self.range_m);
        let sample = Sample {
            raw: i64::from(x),
            position_m,
        };
        if (RANGE_START..=RANGE_END).contains(&x) {
            Event::Value(sample)
        } else {
            Event::OutOfRange(sample)
        }
    }
}

/// The three bytes of the 18 bits of `x`: the device's side.
pub fn message(x: u32, first: bool) -> [u8; 3] {
    let six = |shift: u32| (x >> shift) as u8 & 0x3F;
    [
        six(0),
        0x40 | six(6),
        0x80 | u8::from(!first) << 6 | six(12),
    ]
}

/// Words for an error value. The manual at hand says only that errors have 18 bits; the list is from memory of it.
fn words(x: u32) -> &'static str {
    match x {
        262_075 => "the probe has more data than its baud rate carries",
        262_076 => "the probe sees no peak: no target, or too little light",
        262_077 => "the peak lies before the measuring range",
        262_078 => "the peak lies behind the measuring range",
        262_080 => "the probe cannot compute a value",
        262_082 => "the peak is too wide",
        262_083 => "the laser is off",
        _ => "the probe reports an error; its manual lists the number",
    }
}

/// Decodes the stream of one probe.
#[derive(Debug)]
pub struct Optoncdt {
    settings: Settings,
    held: Held,
    /// Place of the next further value in the cycle; `None` until a first value has been seen undamaged.
    place: Option<u8>,
    damage: Damage,
}

/// The part of a message that is there, without its marking bits.
#[derive(Clone, Copy, Debug)]
enum Held {
    Nothing,
    L(u32),
    LM(u32),
}

impl Held {
    fn bytes(self) -> u32 {
        match self {
            Self::Nothing => 0,
            Self::L(_) => 1,
            Self::LM(_) => 2,
        }
    }
}

impl Optoncdt {
    /// A decoder that has heard nothing yet.
    pub fn new(settings: Settings) -> Result<Self, SerialError> {
        positive("range_m", settings.range_m)?;
        let Cycle {
            values,
            displacement,
        } = settings.cycle;
        if !(1..=32).contains(&values) || displacement >= values {
            let value = format!("{displacement} of {values}");
            let wants = "1 to 32 values a cycle, and the displacement one of them, counted from 0";
            return Err(SerialError::Setting {
                name: "cycle",
                value,
                wants,
            });
        }
        Ok(Self {
            settings,
            held: Held::Nothing,
            place: None,
            damage: Damage::default(),
        })
    }

    /// The message is broken: what is held, and `more` bytes, belong to nothing.
    fn break_off(&mut self, more: u32, out: &mut dyn FnMut(Event)) {
        let bytes = std::mem::replace(&mut self.held, Held::Nothing).bytes() + more;
        if bytes > 0 {
            self.place = None;
            self.damage.add(bytes, out);
        }
    }

    fn take_message(&mut self, x: u32, first: bool, out: &mut dyn FnMut(Event)) {
        let Cycle {
            values,
            displacement,
        } = self.settings.cycle;
        let place = if first { Some(0) } else { self.place };
        let Some(place) = place.filter(|place| *place < values) else {
            return self.break_off(3, out);
        };
        self.damage.end(out);
        self.place = Some(place + 1);
        if place == displacement {
            out(self.settings.event(x));
        }
    }
}

impl Decoder for Optoncdt {
    fn feed(&mut self, bytes: &[u8], out: &mut dyn FnMut(Event)) {
        for &byte in bytes {
            let six = u32::from(byte & 0x3F);
            match (byte >> 6, self.held) {
                (0, _) => {
                    self.break_off(0, out);
                    self.held = Held::L(six);
                }
                (1, Held::L(low)) => self.held = Held::LM(low | six << 6),
                (2 | 3, Held::LM(low)) => {
                    self.held = Held::Nothing;
                    self.take_message(low | six << 12, byte & 0x40 == 0, out);
                }
                _ => self.break_off(1, out),
            }
        }
    }

    fn reset(&mut self, out: &mut dyn FnMut(Event)) {
        self.break_off(0, out);
        self.place = None;
        self.damage.end(out);
    }

    fn request(&self) -> Option<&[u8]> {
        None
    }

    fn message_bytes(&self) -> u32 {
        3 * (1 + u32::from(self.settings.cycle.displacement))
    }
}
