//! An interferometer that sends its fringe count as a line of text, for example `+000123`.

use bench_hal::serial::emulator::Responder;
use bench_hal::serial::{Decoder, Event, Protocol, Sample, SerialError, Window};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Characters of a line without its end.
const LINE: usize = 7;

#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Interferometer {
    /// Displacement of one count in metres.
    #[schemars(range(min = 1e-12, max = 1e-3))]
    count_m: f64,
}

impl Protocol for Interferometer {
    fn decoder(&self) -> Result<Box<dyn Decoder>, SerialError> {
        Ok(Box::new(LineDecoder {
            count_m: self.count_m,
            line: Window::default(),
        }))
    }

    fn characters_per_reading(&self) -> Option<u32> {
        Some(LINE as u32 + 1)
    }

    /// The probe's side, for `emulate`.
    fn responder(&self) -> Result<Box<dyn Responder>, SerialError> {
        Ok(Box::new(self.clone()))
    }
}

struct LineDecoder {
    count_m: f64,
    line: Window<LINE>,
}

impl LineDecoder {
    /// The number in a complete line. A part of a line is shorter, and is not used.
    fn event(&self) -> Option<Event> {
        let is_complete = self.line.bytes().len() == LINE;
        let text = std::str::from_utf8(self.line.bytes()).ok();
        let raw = text.filter(|_| is_complete)?.parse::<i64>().ok()?;
        let position_m = raw as f64 * self.count_m;
        Some(Event::Value(Sample { raw, position_m }))
    }
}

impl Decoder for LineDecoder {
    fn feed(&mut self, bytes: &[u8], out: &mut dyn FnMut(Event)) {
        for byte in bytes {
            if *byte == b'\n' {
                let event = self.event();
                let length = self.line.clear() + 1;
                out(event.unwrap_or(Event::Damaged(length)));
            } else if !self.line.push(*byte) {
                out(Event::Damaged(self.line.clear() + 1));
            }
        }
    }

    fn message_bytes(&self) -> u32 {
        LINE as u32 + 1
    }
}

impl Responder for Interferometer {
    fn measure(&mut self, position_m: f64) -> Vec<u8> {
        format!("{:+07.0}\n", position_m / self.count_m).into_bytes()
    }

    /// It streams, and takes no requests.
    fn receive(&mut self, _byte: u8) -> Vec<u8> {
        Vec::new()
    }

    fn restart(&mut self) {}

    fn out_of_range_m(&self) -> f64 {
        1.0
    }
}
