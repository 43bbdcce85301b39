//! Micro-Epsilon capaNCDT 61xx (capacitive) over RS485: the master asks, the probe answers with all values since.
//!
//! Source: manuals capaNCDT 6110/IP and 61x4, chapter "RS485 interface". 230400 baud, 8E1, half duplex.
//!
//! ```text
//! request  10 DA SA 4C FCS 16                       10 7E 01 4C CB 16
//! answer   68 LE LE 68 DA SA 08 data FCS 16
//!
//! DA, SA   destination and source address: the probe is 7E, the master 01
//! LE       bytes from DA to the end of data: bytes of data + 3
//! FCS      sum of the bytes from DA to the end of data, low 8 bits
//! data     counter u16, m u8, filler u8, m values i32; little endian, oldest value first, m <= 20
//! value    0 = start, 0xF00000 = end of the range; what lies beyond is out of range
//! ```
//!
//! The manuals add up a checksum with function code 43 in an example whose frame has 4C; the frame, and the rule, hold:
//! 7E + 01 + 4C = CB.
//!
//! What the protocol cannot know: an 8-bit sum does not see two errors that cancel or bytes that changed places, and one
//! burst in 256 passes it. Parity (8E1) catches most of those before they get here, except on a pseudo terminal, which
//! has none. The counter has 16 bits: a gap is known modulo 65536.

use super::decoder::{Damage, Decoder, Event, Sample, Window};
use super::error::{SerialError, positive};

/// Counts at the end of the range.
pub const FULL_SCALE: i32 = 0xF0_0000;
/// Most values one answer carries.
pub const BATCH_MAX: usize = 20;

const SHORT: u8 = 0x10;
const LONG: u8 = 0x68;
const END: u8 = 0x16;
const READ_VALUES: u8 = 0x4C;
const VALUES: u8 = 0x08;
/// DA, SA, function code, then counter, m and filler.
const LE_EMPTY: u8 = 3 + 4;
/// 68 LE LE 68 before what LE counts, FCS 16 after it.
const AROUND: usize = 6;
const LONGEST: usize = AROUND + LE_EMPTY as usize + 4 * BATCH_MAX;

/// Which value of a batch the counter numbers. The manuals' single example leaves it open; a wrong choice miscounts gaps
/// by the change of batch size, and never makes an old value new.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CounterMeaning {
    /// The counter is the number of the newest value.
    #[default]
    NewestValue,
    /// The counter is the number of the oldest value.
    OldestValue,
}

/// A probe of this family on the line.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Measuring range, metres: what [`FULL_SCALE`] counts are.
    pub range_m: f64,
    /// The probe's address.
    pub probe_address: u8,
    /// Our address.
    pub master_address: u8,
    /// What the counter numbers.
    pub counter: CounterMeaning,
}

impl Settings {
    /// A probe of this range at the factory's addresses.
    pub fn new(range_m: f64) -> Self {
        Self {
            range_m,
            probe_address: 0x7E,
            master_address: 0x01,
            counter: CounterMeaning::default(),
        }
    }

    /// The request for all values since the last one.
    pub fn request(&self) -> [u8; 6] {
        let (to, from) = (self.probe_address, self.master_address);
        [
            SHORT,
            to,
            from,
            READ_VALUES,
            sum(&[to, from, READ_VALUES]),
            END,
        ]
    }

    /// The probe's answer with the newest [`BATCH_MAX`] of `values`, oldest first: the device's side.
    pub fn answer(&self, counter: u16, values: &[i32]) -> Vec<u8> {
        let values = &values[values.len().saturating_sub(BATCH_MAX)..];
        let m = values.len() as u8; // at most BATCH_MAX
        let le = LE_EMPTY + 4 * m;
        let mut frame = vec![
            LONG,
            le,
            le,
            LONG,
            self.master_address,
            self.probe_address,
            VALUES,
        ];
        frame.extend(counter.to_le_bytes());
        frame.extend([m, 0]);
        frame.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        frame.extend([sum(&frame[4..]), END]);
        frame
    }

    /// Metres of `raw` counts.
    pub fn metres(&self, raw: i32) -> f64 {
        f64::from(raw) / f64::from(FULL_SCALE) * self.range_m
    }

    /// Counts at `position_m`, rounded: the device's side.
    pub fn counts(&self, position_m: f64) -> i32 {
        (position_m / self.range_m * f64::from(FULL_SCALE)).round() as i32
    }

    fn event(&self, raw: i32) -> Event {
        let position_m = self.metres(raw.clamp(0, FULL_SCALE));
        let sample = Sample {
            raw: i64::from(raw),
            position_m,
        };
        if (0..=FULL_SCALE).contains(&raw) {
            Event::Value(sample)
        } else {
            Event::OutOfRange(sample)
        }
    }
}

/// `FCS`: the 8-bit sum.
fn sum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

/// Decodes the answers of one probe and follows its counter.
#[derive(Debug)]
pub struct Capancdt {
    settings: Settings,
    request: [u8; 6],
    window: Window<LONGEST>,
    damage: Damage,
    newest: Option<u16>,
    message_bytes: u32,
}

impl Capancdt {
    /// A decoder that has heard nothing yet.
    pub fn new(settings: Settings) -> Result<Self, SerialError> {
        positive("range_m", settings.range_m)?;
        let request = settings.request();
        let (window, damage) = (Window::default(), Damage::default());
        Ok(Self {
            settings,
            request,
            window,
            damage,
            newest: None,
            message_bytes: 0,
        })
    }

    fn search(&mut self, out: &mut dyn FnMut(Event)) {
        loop {
            match Verdict::of(self.window.held(), &self.settings, &self.request) {
                Verdict::Incomplete => return,
                Verdict::Foreign => {
                    self.window.drop_front(1);
                    self.damage.add(1, out);
                }
                Verdict::Echo => {
                    self.damage.end(out);
                    out(Event::Echo);
                    self.window.drop_front(self.request.len());
                }
                Verdict::Answer(length) => self.take_answer(length, out),
            }
        }
    }

    fn take_answer(&mut self, length: usize, out: &mut dyn FnMut(Event)) {
        self.damage.end(out);
        self.message_bytes = length as u32;
        let mut data = [0; LONGEST];
        data[..length].copy_from_slice(&self.window.held()[..length]);
        self.window.drop_front(length);
        let data = &data[7..length - 2]; // an answer has 13 bytes or more: Verdict
        let (counter, values) = (
            u16::from_le_bytes([data[0], data[1]]),
            data[4..].as_chunks::<4>().0,
        );
        let fresh = self.follow_counter(counter, values.len(), out);
        values[values.len() - fresh..]
            .iter()
            .for_each(|raw| out(self.settings.event(i32::from_le_bytes(*raw))));
        out(Event::AnswerEnd);
    }

    /// How many of the batch's newest values are new: as many as the counter has advanced.
    fn follow_counter(&mut self, counter: u16, batch: usize, out: &mut dyn FnMut(Event)) -> usize {
        let newest = match self.settings.counter {
            CounterMeaning::NewestValue => counter,
            CounterMeaning::OldestValue => counter.wrapping_add(batch as u16).wrapping_sub(1),
        };
        let Some(before) = self.newest.replace(newest) else {
            return batch;
        };
        let mut advance = usize::from(newest.wrapping_sub(before));
        if advance >= 0x8000 {
            out(Event::Restart);
            advance = 0;
        }
        let fresh = batch.min(advance);
        if advance > batch {
            out(Event::Gap((advance - batch) as u32));
        }
        if batch > fresh {
            out(Event::Withheld((batch - fresh) as u32));
        }
        fresh
    }
}

impl Decoder for Capancdt {
    fn feed(&mut self, bytes: &[u8], out: &mut dyn FnMut(Event)) {
        for &byte in bytes {
            self.window.push(byte); // has room: a window of LONGEST bytes is never Incomplete
            self.search(out);
        }
    }

    fn reset(&mut self, out: &mut dyn FnMut(Event)) {
        let begun = self.window.clear();
        self.damage.add(begun, out);
        self.damage.end(out);
    }

    fn request(&self) -> Option<&[u8]> {
        Some(&self.request)
    }

    fn message_bytes(&self) -> u32 {
        self.message_bytes
    }
}

/// What the bytes at the front of the window are.
enum Verdict {
    Incomplete,
    Foreign,
    Echo,
    Answer(usize),
}

impl Verdict {
    fn of(bytes: &[u8], settings: &Settings, request: &[u8; 6]) -> Self {
        match bytes.first() {
            None => Self::Incomplete,
            Some(&LONG) => Self::of_long(bytes, settings),
            Some(&SHORT) if !begins(bytes, request) => Self::Foreign,
            Some(&SHORT) if bytes.len() < request.len() => Self::Incomplete,
            Some(&SHORT) => Self::Echo,
            Some(_) => Self::Foreign,
        }
    }

    fn of_long(bytes: &[u8], settings: &Settings) -> Self {
        let Some(&le) = bytes.get(1) else {
            return Self::Incomplete;
        };
        let Some(m) = batch_of(le) else {
            return Self::Foreign;
        };
        let header = [
            LONG,
            le,
            le,
            LONG,
            settings.master_address,
            settings.probe_address,
            VALUES,
        ];
        if !begins(bytes, &header) {
            return Self::Foreign;
        }
        let length = usize::from(le) + AROUND;
        let Some(frame) = bytes.get(..length) else {
            return Self::Incomplete;
        };
        let (body, tail) = (&frame[4..length - 2], &frame[length - 2..]);
        if tail == [sum(body), END] && body[5] == m {
            Self::Answer(length)
        } else {
            Self::Foreign
        }
    }
}

/// Whether `bytes` is `pattern`, as far as there are bytes.
fn begins(bytes: &[u8], pattern: &[u8]) -> bool {
    bytes
        .iter()
        .zip(pattern)
        .all(|(byte, wanted)| byte == wanted)
}

/// Values in an answer of this length; `None` if no answer has it.
fn batch_of(le: u8) -> Option<u8> {
    let values = le.checked_sub(LE_EMPTY)?;
    (values % 4 == 0 && usize::from(values / 4) <= BATCH_MAX).then_some(values / 4)
}
