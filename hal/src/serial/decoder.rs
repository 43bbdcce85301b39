//! Decoders: bytes in, events out.

/// One measurement as the probe sent it, before [`Mounting`](super::Mounting) is applied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The number on the line: counts of a binary protocol, digits without the decimal point of a text protocol.
    pub raw: i64,
    /// Displacement in metres from the start of the measuring range (or from the probe's zero). If the target is out
    /// of range this is the end of the range.
    pub position_m: f64,
}

/// An event that a decoder found in the bytes. The events have the order of the bytes and do not depend on how the
/// bytes were divided into slices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A measurement within the measuring range.
    Value(Sample),
    /// The target is outside the measuring range; the position is the end of the range on that side.
    OutOfRange(Sample),
    /// The probe answered with an error: it could not measure, or it did not accept the request.
    Fault {
        /// Error number of the probe.
        code: i64,
        /// Meaning of the number.
        text: &'static str,
    },
    /// Number of measurements that the probe made and that did not arrive.
    Gap(u32),
    /// Number of values that were received but may be old (the counter did not advance, or went back) and are not used.
    Withheld(u32),
    /// The probe's counter went back: the probe has restarted, or an old answer arrived late.
    Restart,
    /// Number of bytes that do not belong to any message. Long runs are reported in parts.
    Damaged(u32),
    /// The line returned the request, as two-wire RS485 adapters do.
    Echo,
    /// The answer to a request is complete, with or without a value.
    AnswerEnd,
}

/// Decodes the bytes of one probe, without clock and port. A decoder must not panic on any input.
pub trait Decoder: Send {
    /// Decodes the next bytes of the line; slices may have any length.
    fn feed(&mut self, bytes: &[u8], out: &mut dyn FnMut(Event));

    /// Discards an incomplete message; its bytes are reported as damaged. Called before each request.
    fn reset(&mut self, out: &mut dyn FnMut(Event)) {
        let _ = out;
    }

    /// The request that asks for a measurement; `None` if the probe sends without requests.
    fn request(&self) -> Option<&[u8]> {
        None
    }

    /// Length in bytes of the latest message with a measurement. The time that these bytes take on the line is part of
    /// the age of the measurement.
    fn message_bytes(&self) -> u32;
}

/// Counts damaged bytes and reports them in parts that depend on the bytes only, not on the slices. A decoder that calls
/// [`Event::Damaged`] itself, once per broken message, does not need it.
#[derive(Debug, Default)]
pub struct DamageCounter {
    bytes: u32,
}

impl DamageCounter {
    /// A run of damaged bytes is reported at its end and every 64 bytes, so that continuous noise is visible in the
    /// statistics.
    const PART: u32 = 64;

    /// Adds damaged bytes.
    pub fn add(&mut self, bytes: u32, out: &mut dyn FnMut(Event)) {
        self.bytes += bytes;
        if self.bytes >= Self::PART {
            self.report(out);
        }
    }

    /// Reports what was added since the last report. Call it when a valid message begins.
    pub fn report(&mut self, out: &mut dyn FnMut(Event)) {
        if self.bytes > 0 {
            out(Event::Damaged(std::mem::take(&mut self.bytes)));
        }
    }
}

/// The bytes of an incomplete message, oldest first, at most `N`: noise on the line cannot fill the memory.
///
/// ```
/// use bench_hal::serial::Window;
///
/// let mut window = Window::<2>::default();
/// assert!(window.push(b'4') && window.push(b'2'));
/// assert!(!window.push(b'!'), "full");
/// assert_eq!(window.bytes(), b"42");
/// ```
#[derive(Debug)]
pub struct Window<const N: usize> {
    bytes: [u8; N],
    length: usize,
}

impl<const N: usize> Default for Window<N> {
    fn default() -> Self {
        Self {
            bytes: [0; N],
            length: 0,
        }
    }
}

impl<const N: usize> Window<N> {
    /// Appends a byte; returns `false` if the window is full.
    pub fn push(&mut self, byte: u8) -> bool {
        let Some(slot) = self.bytes.get_mut(self.length) else {
            return false;
        };
        *slot = byte;
        self.length += 1;
        true
    }

    /// The bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..self.length] // `push` keeps length <= N
    }

    /// Removes the oldest bytes.
    pub fn drop_front(&mut self, count: usize) {
        let count = count.min(self.length);
        self.bytes.copy_within(count..self.length, 0);
        self.length -= count;
    }

    /// Empties the window and returns the number of bytes that it held.
    pub fn clear(&mut self) -> u32 {
        std::mem::take(&mut self.length) as u32
    }
}
