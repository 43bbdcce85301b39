//! Displacement probes over a serial port.
//!
//! ```text
//! port --bytes--> decoder --events--> reader thread --newest, with its time--> cell --> SerialProbe::latest   (the loop)
//!   ^                                      |                                                in the tick: no lock
//!   +------------- request ----------------+---> statistics (atomics)
//! ```
//!
//! * [`capancdt`], [`optoncdt`], [`ascii`]: what the probes say, byte by byte, for both sides of the line; no clock, no port.
//! * [`SerialProbe`]: the driver. Its thread owns the port, asks where the protocol asks and listens where it streams.
//! * [`emulator`]: pretend probes with faults on request, to rehearse and to test.
//!
//! # What a reading is worth
//!
//! *Valid* means: the bytes kept every rule of the protocol, the probe did not object, and the value is in range. How much
//! that is depends on the protocol; each module says what its protocol cannot know.
//!
//! *Sequence* counts measurements, those included that a counter shows to be lost. It rises only with new ones: values
//! that the probe repeats are withheld.
//!
//! *Age* is never understated knowingly: an answer counts from its request, a message of a stream from before its first
//! byte. Where nobody can tell (a reader that was kept from running, a backlog, an answer that may belong to an older
//! request) the value is counted and not handed out. A damaged message is no reading; the one before it ages. When the
//! port is lost the last reading stays, aging and `Faulty`. A probe that says it cannot measure gives a new `Faulty`
//! reading whose position is not a number.

pub mod ascii;
pub mod capancdt;
mod cell;
mod decoder;
pub mod emulator;
mod error;
mod lock;
mod low_latency;
pub mod optoncdt;
mod pattern;
mod poller;
mod port;
mod probe;
mod reader;
mod statistics;

pub use decoder::{Decoder, Event, Sample};
pub use error::SerialError;
pub use port::{Note, Parity, PortSettings};
pub use probe::{Polling, ProbeSettings, Protocol, SerialProbe, StatisticsHandle};
pub use reader::Mounting;
pub use statistics::Statistics;
