//! What a decoder has to say, and what every decoder is.

/// One measurement of a probe, before it is mounted anywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The number on the line: counts of a binary protocol, digits without the point of a written one.
    pub raw: i64,
    /// Metres from the start of the probe's range (or its own zero), before mounting; the range's end when out of range.
    pub position_m: f64,
}

/// What a decoder found in the bytes it was fed. In order of the bytes, and the same however they were sliced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A measurement within the probe's range.
    Value(Sample),
    /// The target is outside the range; the position is the range's end on that side.
    OutOfRange(Sample),
    /// The probe answers, but says that it did not measure or did not understand.
    Fault {
        /// The probe's own number.
        code: i64,
        /// What that number means.
        words: &'static str,
    },
    /// The probe made so many measurements that never arrived.
    Gap(u32),
    /// So many values arrived that are not known to be new (counter did not advance, or jumped back): not handed out.
    Withheld(u32),
    /// The probe's counter went back: it has restarted, or an answer of the past has come up.
    Restart,
    /// So many bytes belonged to nothing. A long run is reported in pieces.
    Damaged(u32),
    /// The line returned our own request, as two-wire RS485 adapters do.
    Echo,
    /// The answer to a request is complete, with or without a value.
    AnswerEnd,
}

/// Bytes in, events out; no clock, no port. Never panics, whatever the bytes.
pub trait Decoder: Send {
    /// Takes the next bytes of the line, in slices of any size.
    fn feed(&mut self, bytes: &[u8], out: &mut dyn FnMut(Event));

    /// Forgets a message begun (its bytes count as damaged): what comes next starts a message, or is searched for one.
    fn reset(&mut self, out: &mut dyn FnMut(Event));

    /// What to send to get an answer; `None` if the probe speaks by itself.
    fn request(&self) -> Option<&[u8]>;

    /// Bytes of the latest message that carried a measurement: the line was busy with them after the measurement.
    fn message_bytes(&self) -> u32;
}

/// Counts skipped bytes and reports them in pieces whose size depends on the bytes alone, not on the slicing.
#[derive(Debug, Default)]
pub(super) struct Damage {
    bytes: u32,
}

impl Damage {
    /// A run is reported when it ends, and every so many bytes: noise without end must show in the statistics.
    const PIECE: u32 = 64;

    pub(super) fn add(&mut self, bytes: u32, out: &mut dyn FnMut(Event)) {
        self.bytes += bytes;
        if self.bytes >= Self::PIECE {
            self.end(out);
        }
    }

    pub(super) fn end(&mut self, out: &mut dyn FnMut(Event)) {
        if self.bytes > 0 {
            out(Event::Damaged(std::mem::take(&mut self.bytes)));
        }
    }
}

/// The bytes of a message not yet complete: at most `N`, oldest first.
#[derive(Debug)]
pub(super) struct Window<const N: usize> {
    bytes: [u8; N],
    len: usize,
}

impl<const N: usize> Default for Window<N> {
    fn default() -> Self {
        Self {
            bytes: [0; N],
            len: 0,
        }
    }
}

impl<const N: usize> Window<N> {
    /// Appends a byte; `false` if there was no room for it.
    pub(super) fn push(&mut self, byte: u8) -> bool {
        let Some(slot) = self.bytes.get_mut(self.len) else {
            return false;
        };
        *slot = byte;
        self.len += 1;
        true
    }

    pub(super) fn held(&self) -> &[u8] {
        &self.bytes[..self.len] // len never passes N: push
    }

    pub(super) fn drop_front(&mut self, count: usize) {
        let count = count.min(self.len);
        self.bytes.copy_within(count..self.len, 0);
        self.len -= count;
    }

    /// Empties the window and says how many bytes were in it.
    pub(super) fn clear(&mut self) -> u32 {
        std::mem::take(&mut self.len) as u32
    }
}
