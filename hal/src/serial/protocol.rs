//! The protocol of a serial probe: the interface that a new probe implements.

use std::fmt::Debug;
use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::decoder::Decoder;
use super::emulator::Responder;
use super::error::SerialError;

/// The protocol of a probe on a serial line.
///
/// A serial probe consists of a line ([`PortSettings`](super::PortSettings)), a mounting
/// ([`Mounting`](super::Mounting)) and a protocol. The type that implements this trait holds the settings of the
/// protocol, for example the measuring range. The port, the reader thread, the age of the readings and the statistics
/// are the same for every protocol ([`SerialProbe`](super::SerialProbe)).
///
/// # Example
///
/// A probe that sends one byte per measurement: 0 to 250 is the measuring range, 255 means that there is no target.
///
/// ```
/// use bench_hal::serial::{Decoder, Event, Protocol, Sample, SerialError};
///
/// #[derive(Debug)]
/// struct ByteProbe {
///     range_m: f64,
/// }
///
/// impl Protocol for ByteProbe {
///     fn decoder(&self) -> Result<Box<dyn Decoder>, SerialError> {
///         Ok(Box::new(ByteDecoder { range_m: self.range_m }))
///     }
/// }
///
/// struct ByteDecoder {
///     range_m: f64,
/// }
///
/// impl ByteDecoder {
///     fn decode(&self, byte: u8) -> Event {
///         let position_m = f64::from(byte.min(250)) / 250.0 * self.range_m;
///         let sample = Sample { raw: byte.into(), position_m };
///         match byte {
///             0..=250 => Event::Value(sample),
///             255 => Event::Fault { code: 255, text: "no target" },
///             _ => Event::OutOfRange(sample),
///         }
///     }
/// }
///
/// impl Decoder for ByteDecoder {
///     fn feed(&mut self, bytes: &[u8], out: &mut dyn FnMut(Event)) {
///         bytes.iter().for_each(|byte| out(self.decode(*byte)));
///     }
///
///     fn message_bytes(&self) -> u32 {
///         1
///     }
/// }
///
/// let mut decoder = ByteProbe { range_m: 1e-3 }.decoder().unwrap();
/// let mut events = Vec::new();
/// decoder.feed(&[125, 255], &mut |event| events.push(event));
/// assert_eq!(events[0], Event::Value(Sample { raw: 125, position_m: 0.5e-3 }));
/// assert_eq!(events[1], Event::Fault { code: 255, text: "no target" });
/// ```
pub trait Protocol: Debug + Send + Sync {
    /// Checks the settings and returns a decoder that has not received anything yet.
    fn decoder(&self) -> Result<Box<dyn Decoder>, SerialError>;

    /// First and last position in metres that the probe can measure, before the mounting; `None` if it is unknown. A configuration
    /// is refused if the permitted travel of the stage is not within it, so that a wrong scale of the protocol is found.
    fn range_m(&self) -> Option<[f64; 2]> {
        None
    }

    /// Timing of the requests. Used only if [`Decoder::request`] returns a request.
    fn polling(&self) -> Polling {
        Polling::default()
    }

    /// Bytes that are sent once when the port has been opened, for example a command that starts a stream.
    fn start_command(&self) -> &[u8] {
        &[]
    }

    /// Characters on the line from the moment the value is available in the probe (or from the request) to the arrival
    /// of its last byte. `None` if the messages have no fixed length.
    fn characters_per_reading(&self) -> Option<u32> {
        None
    }

    /// The probe's side of the protocol, for tests and rehearsals without hardware
    /// ([`EmulatedProbe`](super::emulator::EmulatedProbe)).
    fn responder(&self) -> Result<Box<dyn Responder>, SerialError> {
        Err(SerialError::NoEmulator)
    }
}

/// Timing of a polled probe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Polling {
    /// Time from one request to the next; 0 sends the next request as soon as the answer is complete.
    #[serde(rename = "interval_s", with = "seconds")]
    #[schemars(with = "f64", range(min = 0.0, max = 60.0))]
    pub interval: Duration,
    /// Time without an answer after which the request is repeated. After opening, and after the first answer that
    /// follows a timeout, the line must be silent for at least twice this time before answers are used.
    #[serde(rename = "timeout_s", with = "seconds")]
    #[schemars(with = "f64", range(min = 0.001, max = 60.0))]
    pub timeout: Duration,
    /// Silence after which a damaged answer is considered complete. It must be longer than the response time of the
    /// probe and than the longest gap that the adapter inserts into an answer (16 ms over USB without low latency).
    #[serde(rename = "quiet_s", with = "seconds")]
    #[schemars(with = "f64", range(min = 0.0001, max = 60.0))]
    pub quiet: Duration,
}

/// A duration as a number of seconds.
mod seconds {
    use std::time::Duration;

    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(time: &Duration, to: S) -> Result<S::Ok, S::Error> {
        time.as_secs_f64().serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Duration, D::Error> {
        let seconds = f64::deserialize(from)?;
        Duration::try_from_secs_f64(seconds).map_err(Error::custom)
    }
}

impl Default for Polling {
    /// No pause between requests, 100 ms timeout, 20 ms of silence after a damaged answer.
    fn default() -> Self {
        Self {
            interval: Duration::ZERO,
            timeout: Duration::from_millis(100),
            quiet: Duration::from_millis(20),
        }
    }
}

impl Polling {
    /// Checks `0 < quiet <= timeout`.
    pub(super) fn check(&self) -> Result<(), SerialError> {
        if !self.quiet.is_zero() && self.quiet <= self.timeout {
            return Ok(());
        }
        Err(SerialError::Setting {
            name: "quiet, timeout",
            value: format!("{:?}, {:?}", self.quiet, self.timeout),
            expected: "both above zero, and the timeout at least as long as the quiet time",
        })
    }
}
