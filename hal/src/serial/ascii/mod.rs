//! Probes that send each measurement as a line of text.
//!
//! The form of the lines is a setting: [`Settings::line`] is a pattern with the fields `{value}`, `{value:WIDTH.DECIMALS}`
//! and `{skip}`. [`Settings::keyence_lk_g`] is the Keyence LK-G over RS-232 [manual LK-G, chapter 5, pages 5-5 and 5-6]:
//!
//! ```text
//! +01.2345 CR     sign and seven characters, in the unit of the display (mm)
//! XXXXXXXX CR     invalid
//! +FFFFFFF CR     over range;  -FFFFFFF under range
//! ER,MA,01 CR     error: the command that it answers, and a number
//! ```
//!
//! Bytes before the first terminator are never used as a value: the beginning of that line may be missing, and a cut
//! number is still a number.
//!
//! Limits of the protocol: a digit that was changed into another digit is not detected. A lost character gives a shorter
//! number unless the pattern fixes the size of the value, as `{value:8.4}` does.

mod format;
mod pattern;
mod settings;

pub use self::format::{LineFormat, Output};
pub use self::settings::{KEYENCE_ERRORS, Settings};
use super::decoder::{DamageCounter, Decoder, Event, Window};
use super::emulator::Responder;
use super::error::SerialError;
use super::protocol::{Polling, Protocol};

/// Longest line, including the terminator.
const LINE_MAX: usize = 128;
/// Longest request that the emulated probe compares; longer input is an unknown command.
const REQUEST_MAX: usize = 64;

impl Protocol for Settings {
    fn decoder(&self) -> Result<Box<dyn Decoder>, SerialError> {
        Ok(Box::new(Ascii::new(self.clone())?))
    }

    fn range_m(&self) -> Option<[f64; 2]> {
        Some([self.lower_m, self.upper_m])
    }

    fn polling(&self) -> Polling {
        self.polling
    }

    fn responder(&self) -> Result<Box<dyn Responder>, SerialError> {
        let format = LineFormat::new(self.clone())?;
        Ok(Box::new(AsciiResponder::new(format)))
    }
}

/// Decodes the lines of one probe.
#[derive(Debug)]
pub struct Ascii {
    format: LineFormat,
    window: Window<LINE_MAX>,
    damage: DamageCounter,
    /// Whether the beginning of the present line has been received.
    is_complete: bool,
    message_bytes: u32,
}

impl Ascii {
    /// A decoder that has not received anything yet.
    pub fn new(settings: Settings) -> Result<Self, SerialError> {
        Ok(Self {
            format: LineFormat::new(settings)?,
            window: Window::default(),
            damage: DamageCounter::default(),
            is_complete: false,
            message_bytes: 0,
        })
    }

    fn take_byte(&mut self, byte: u8, out: &mut dyn FnMut(Event)) {
        if !self.window.push(byte) {
            // Too long for a line: drop its beginning, so that it is not used as a value, and search for its end.
            self.window.drop_front(1);
            self.window.push(byte);
            self.damage.add(1, out);
            self.is_complete = false;
        }
        if let Some(line) = self.window.bytes().strip_suffix(self.format.terminator()) {
            let event = self.format.read(line).filter(|_| self.is_complete);
            self.end_line(event, out);
        }
    }

    fn end_line(&mut self, event: Option<Event>, out: &mut dyn FnMut(Event)) {
        let bytes = self.window.clear();
        self.is_complete = true;
        let Some(event) = event else {
            return self.damage.add(bytes, out);
        };
        self.damage.report(out);
        self.message_bytes = bytes;
        out(event);
        out(Event::AnswerEnd);
    }
}

impl Decoder for Ascii {
    fn feed(&mut self, bytes: &[u8], out: &mut dyn FnMut(Event)) {
        for &byte in bytes {
            self.take_byte(byte, out);
        }
    }

    fn reset(&mut self, out: &mut dyn FnMut(Event)) {
        let discarded = self.window.clear();
        self.damage.add(discarded, out);
        self.damage.report(out);
        // A line begins after a request on a silent line, but anywhere in a stream.
        self.is_complete = self.request().is_some();
    }

    fn request(&self) -> Option<&[u8]> {
        self.format.request()
    }

    fn message_bytes(&self) -> u32 {
        self.message_bytes
    }
}

/// An emulated probe: sends a line at each measurement, or at each request.
struct AsciiResponder {
    format: LineFormat,
    newest_m: f64,
    received: Vec<u8>,
    /// The next line loses its first half: the probe has restarted while sending it.
    is_cut: bool,
}

impl AsciiResponder {
    fn new(format: LineFormat) -> Self {
        Self {
            format,
            newest_m: 0.0,
            received: Vec::new(),
            is_cut: false,
        }
    }

    fn line(&mut self) -> Vec<u8> {
        let line = self.format.write(Output::Position(self.newest_m));
        let lost = if std::mem::take(&mut self.is_cut) {
            line.len() / 2
        } else {
            0
        };
        line[lost..].to_vec()
    }
}

impl Responder for AsciiResponder {
    fn measure(&mut self, position_m: f64) -> Vec<u8> {
        self.newest_m = position_m;
        if self.format.request().is_none() {
            self.line()
        } else {
            Vec::new()
        }
    }

    /// A line for a request, the error of an unknown command for any other line.
    fn receive(&mut self, byte: u8) -> Vec<u8> {
        self.received.push(byte);
        let is_line_end = byte == b'\r' || byte == b'\n';
        let answer = if self.format.request() == Some(&self.received) {
            self.line()
        } else if is_line_end || self.received.len() >= REQUEST_MAX {
            self.format.write(Output::Error(0))
        } else {
            return Vec::new();
        };
        self.received.clear();
        answer
    }

    fn restart(&mut self) {
        self.received.clear();
        self.is_cut = true;
    }

    fn out_of_range_m(&self) -> f64 {
        self.format.out_of_range_m()
    }
}
