//! Micro-Epsilon capaNCDT 61xx (capacitive) over RS485: the master polls, the probe answers with all values since the
//! last request.
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
//! value    0 = start, 0xF00000 = end of the range; a value outside is out of range
//! ```
//!
//! An example in the manuals computes the checksum with function code 43, but its frame has 4C. This module follows the
//! frame and the rule: 7E + 01 + 4C = CB.
//!
//! Limits of the protocol: an 8-bit sum does not detect two errors that cancel or bytes that are swapped, and one noise
//! burst in 256 passes it. Parity (8E1) detects most of these errors earlier, but a pseudo terminal has no parity. The
//! counter has 16 bits: the length of a gap is known modulo 65536.

use std::collections::VecDeque;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::decoder::{DamageCounter, Decoder, Event, Sample, Window};
use super::emulator::Responder;
use super::error::{SerialError, positive};
use super::protocol::{Polling, Protocol};

/// Counts at the end of the range.
pub const FULL_SCALE: i32 = 0xF0_0000;
/// Largest number of values in one answer.
pub const BATCH_MAX: usize = 20;

const SHORT: u8 = 0x10;
const LONG: u8 = 0x68;
const END: u8 = 0x16;
const READ_VALUES: u8 = 0x4C;
const VALUES: u8 = 0x08;
/// LE of an answer without values: DA, SA, function code, counter, m and filler.
const LE_EMPTY: u8 = 3 + 4;
/// Bytes that LE does not count: 68 LE LE 68 before, FCS 16 after.
const FRAMING: usize = 6;
const ANSWER_MAX: usize = FRAMING + LE_EMPTY as usize + 4 * BATCH_MAX;

/// Which value of a batch the counter refers to. The single example in the manuals leaves it open. A wrong choice
/// miscounts gaps by the change of the batch size; it never makes an old value appear as new.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CounterMeaning {
    /// The counter is the number of the newest value.
    #[default]
    NewestValue,
    /// The counter is the number of the oldest value.
    OldestValue,
}

/// Settings of the protocol.
///
/// ```
/// let settings = bench_hal::serial::capancdt::Settings::new(200e-6);
/// assert_eq!(settings.request(), [0x10, 0x7E, 0x01, 0x4C, 0xCB, 0x16]);
/// assert_eq!(settings.metres(0x780000), 100e-6); // half of full scale
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Settings {
    /// Measuring range in metres; it corresponds to [`FULL_SCALE`] counts.
    #[serde(rename = "sensor_range_m")]
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub range_m: f64,
    /// Address of the probe.
    #[serde(rename = "address", default = "probe_address")]
    #[schemars(range(min = 0, max = 255))]
    pub probe_address: u8,
    /// Address of this computer.
    #[serde(rename = "own_address", default = "master_address")]
    #[schemars(range(min = 0, max = 255))]
    pub master_address: u8,
    /// Which value the counter refers to.
    #[serde(default)]
    pub counter: CounterMeaning,
    /// Timing of the requests.
    #[serde(default)]
    pub polling: Polling,
}

fn probe_address() -> u8 {
    0x7E
}

fn master_address() -> u8 {
    0x01
}

impl Settings {
    /// A probe with this measuring range and the factory's addresses.
    pub fn new(range_m: f64) -> Self {
        Self {
            range_m,
            probe_address: probe_address(),
            master_address: master_address(),
            counter: CounterMeaning::default(),
            polling: Polling::default(),
        }
    }

    /// The request for all values since the last request.
    pub fn request(&self) -> [u8; 6] {
        let (to, from) = (self.probe_address, self.master_address);
        let checksum = sum(&[to, from, READ_VALUES]);
        [SHORT, to, from, READ_VALUES, checksum, END]
    }

    /// The answer of the probe with the newest [`BATCH_MAX`] of `values`, oldest first.
    pub fn answer(&self, counter: u16, values: &[i32]) -> Vec<u8> {
        let values = &values[values.len().saturating_sub(BATCH_MAX)..];
        let m = values.len() as u8; // at most BATCH_MAX
        let mut frame = self.answer_header(LE_EMPTY + 4 * m).to_vec();
        frame.extend(counter.to_le_bytes());
        frame.extend([m, 0]);
        frame.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        frame.extend([sum(&frame[4..]), END]);
        frame
    }

    fn answer_header(&self, le: u8) -> [u8; 7] {
        let (to, from) = (self.master_address, self.probe_address);
        [LONG, le, le, LONG, to, from, VALUES]
    }

    /// Position of `raw` counts, in metres.
    pub fn metres(&self, raw: i32) -> f64 {
        f64::from(raw) / f64::from(FULL_SCALE) * self.range_m
    }

    /// Counts at `position_m`, rounded.
    pub fn counts(&self, position_m: f64) -> i32 {
        (position_m / self.range_m * f64::from(FULL_SCALE)).round() as i32
    }

    fn event(&self, raw: i32) -> Event {
        let sample = Sample {
            raw: i64::from(raw),
            position_m: self.metres(raw.clamp(0, FULL_SCALE)),
        };
        if (0..=FULL_SCALE).contains(&raw) {
            Event::Value(sample)
        } else {
            Event::OutOfRange(sample)
        }
    }
}

impl Protocol for Settings {
    fn decoder(&self) -> Result<Box<dyn Decoder>, SerialError> {
        Ok(Box::new(Capancdt::new(self.clone())?))
    }

    fn range_m(&self) -> Option<[f64; 2]> {
        Some([0.0, self.range_m])
    }

    fn polling(&self) -> Polling {
        self.polling
    }

    /// The request and an answer with one value.
    fn characters_per_reading(&self) -> Option<u32> {
        Some((self.request().len() + self.answer(0, &[0]).len()) as u32)
    }

    fn responder(&self) -> Result<Box<dyn Responder>, SerialError> {
        Ok(Box::new(CapancdtResponder::new(self.clone())))
    }
}

/// The checksum `FCS`: the low 8 bits of the sum.
fn sum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

/// Decodes the answers of one probe and follows its counter.
#[derive(Debug)]
pub struct Capancdt {
    settings: Settings,
    request: [u8; 6],
    window: Window<ANSWER_MAX>,
    damage: DamageCounter,
    /// Number of the newest value so far.
    newest: Option<u16>,
    message_bytes: u32,
}

impl Capancdt {
    /// A decoder that has not received anything yet.
    pub fn new(settings: Settings) -> Result<Self, SerialError> {
        positive("range_m", settings.range_m)?;
        Ok(Self {
            request: settings.request(),
            settings,
            window: Window::default(),
            damage: DamageCounter::default(),
            newest: None,
            message_bytes: 0,
        })
    }

    /// Takes all complete frames out of the window.
    fn search(&mut self, out: &mut dyn FnMut(Event)) {
        loop {
            match Candidate::find(self.window.bytes(), &self.settings, &self.request) {
                Candidate::Incomplete => return,
                Candidate::None => {
                    self.window.drop_front(1);
                    self.damage.add(1, out);
                }
                Candidate::Echo => {
                    self.damage.report(out);
                    out(Event::Echo);
                    self.window.drop_front(self.request.len());
                }
                Candidate::Answer { length } => {
                    self.damage.report(out);
                    self.take_answer(length, out);
                }
            }
        }
    }

    fn take_answer(&mut self, length: usize, out: &mut dyn FnMut(Event)) {
        self.message_bytes = length as u32;
        let mut frame = [0; ANSWER_MAX];
        frame[..length].copy_from_slice(&self.window.bytes()[..length]);
        self.window.drop_front(length);
        let data = &frame[7..length - 2]; // Candidate::Answer has at least 13 bytes
        let counter = u16::from_le_bytes([data[0], data[1]]);
        let values = data[4..].as_chunks::<4>().0;
        let new = self.follow_counter(counter, values.len(), out);
        for raw in &values[values.len() - new..] {
            out(self.settings.event(i32::from_le_bytes(*raw)));
        }
        out(Event::AnswerEnd);
    }

    /// Number of new values in the batch: the newest ones, as many as the counter has advanced.
    fn follow_counter(&mut self, counter: u16, batch: usize, out: &mut dyn FnMut(Event)) -> usize {
        let newest = match self.settings.counter {
            CounterMeaning::NewestValue => counter,
            CounterMeaning::OldestValue => counter.wrapping_add(batch as u16).wrapping_sub(1),
        };
        let Some(previous) = self.newest.replace(newest) else {
            return batch;
        };
        let mut advance = usize::from(newest.wrapping_sub(previous));
        if advance >= 0x8000 {
            out(Event::Restart);
            advance = 0;
        }
        if advance > batch {
            out(Event::Gap((advance - batch) as u32));
        }
        if advance < batch {
            out(Event::Withheld((batch - advance) as u32));
        }
        batch.min(advance)
    }
}

impl Decoder for Capancdt {
    fn feed(&mut self, bytes: &[u8], out: &mut dyn FnMut(Event)) {
        for &byte in bytes {
            self.window.push(byte); // has room: a full window is never Incomplete
            self.search(out);
        }
    }

    fn reset(&mut self, out: &mut dyn FnMut(Event)) {
        let discarded = self.window.clear();
        self.damage.add(discarded, out);
        self.damage.report(out);
    }

    fn request(&self) -> Option<&[u8]> {
        Some(&self.request)
    }

    fn message_bytes(&self) -> u32 {
        self.message_bytes
    }
}

/// A possible meaning of the bytes at the front of the window.
enum Candidate {
    Incomplete,
    None,
    Echo,
    Answer { length: usize },
}

impl Candidate {
    fn find(bytes: &[u8], settings: &Settings, request: &[u8; 6]) -> Self {
        match bytes.first() {
            None => Self::Incomplete,
            Some(&LONG) => Self::long(bytes, settings),
            Some(&SHORT) if !agree(bytes, request) => Self::None,
            Some(&SHORT) if bytes.len() < request.len() => Self::Incomplete,
            Some(&SHORT) => Self::Echo,
            Some(_) => Self::None,
        }
    }

    fn long(bytes: &[u8], settings: &Settings) -> Self {
        let Some(&le) = bytes.get(1) else {
            return Self::Incomplete;
        };
        let Some(m) = batch_size(le) else {
            return Self::None;
        };
        if !agree(bytes, &settings.answer_header(le)) {
            return Self::None;
        }
        let length = usize::from(le) + FRAMING;
        match bytes.get(..length) {
            None => Self::Incomplete,
            Some(frame) if is_answer(frame, m) => Self::Answer { length },
            Some(_) => Self::None,
        }
    }
}

/// Whether checksum, end and number of values of a whole frame are correct.
fn is_answer(frame: &[u8], m: u8) -> bool {
    let (body, tail) = frame[4..].split_at(frame.len() - FRAMING);
    tail == [sum(body), END] && body[5] == m
}

/// Whether the common length of both slices has the same bytes.
fn agree(bytes: &[u8], pattern: &[u8]) -> bool {
    bytes
        .iter()
        .zip(pattern)
        .all(|(byte, wanted)| byte == wanted)
}

/// Number of values in an answer with this LE; `None` if no answer has it.
fn batch_size(le: u8) -> Option<u8> {
    let values = le.checked_sub(LE_EMPTY)?;
    let is_valid = values % 4 == 0 && usize::from(values / 4) <= BATCH_MAX;
    is_valid.then_some(values / 4)
}

/// An emulated probe: stores the newest [`BATCH_MAX`] values and sends them on request.
struct CapancdtResponder {
    settings: Settings,
    request: [u8; 6],
    /// Number of the next measurement.
    counter: u16,
    unsent: VecDeque<i32>,
    /// The last received bytes, as many as a request has.
    received: VecDeque<u8>,
}

impl CapancdtResponder {
    fn new(settings: Settings) -> Self {
        Self {
            request: settings.request(),
            settings,
            counter: 0,
            unsent: VecDeque::new(),
            received: VecDeque::new(),
        }
    }

    fn answer(&mut self) -> Vec<u8> {
        let values = Vec::from(std::mem::take(&mut self.unsent));
        let number = match self.settings.counter {
            CounterMeaning::NewestValue => self.counter.wrapping_sub(1),
            CounterMeaning::OldestValue => self.counter.wrapping_sub(values.len() as u16),
        };
        self.settings.answer(number, &values)
    }
}

/// Appends `item` and drops the oldest items until at most `length` are left.
fn push_limited<T>(queue: &mut VecDeque<T>, item: T, length: usize) {
    queue.push_back(item);
    queue.drain(..queue.len().saturating_sub(length));
}

impl Responder for CapancdtResponder {
    fn measure(&mut self, position_m: f64) -> Vec<u8> {
        let counts = self.settings.counts(position_m);
        push_limited(&mut self.unsent, counts, BATCH_MAX);
        self.counter = self.counter.wrapping_add(1);
        Vec::new()
    }

    fn receive(&mut self, byte: u8) -> Vec<u8> {
        push_limited(&mut self.received, byte, self.request.len());
        if self.received.iter().eq(&self.request) {
            self.answer()
        } else {
            Vec::new()
        }
    }

    fn restart(&mut self) {
        self.counter = 0;
        self.unsent.clear();
        self.received.clear();
    }

    fn out_of_range_m(&self) -> f64 {
        2.0 * self.settings.range_m
    }
}
