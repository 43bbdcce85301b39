//! Displacement probes on a serial port.
//!
//! ```text
//! port --bytes--> decoder --events--> reader thread --newest measurement--> cell --> SerialProbe::latest (in the tick)
//!   ^                                      |
//!   +-------------- request ---------------+---> statistics (atomics)
//! ```
//!
//! * [`Protocol`] is the interface of a protocol; [`capancdt`], [`optoncdt`] and [`ascii`] implement it.
//! * [`SerialProbe`] is the driver. Its reader thread owns the port, polls the probe or listens to its stream.
//! * [`emulator`] contains emulated probes with faults, for tests and rehearsals.
//!
//! # To add a probe
//!
//! Write one file in this folder with a type that implements [`Protocol`] (see the example there), and declare it below
//! with `pub mod`.
//!
//! # Meaning of a reading
//!
//! `validity` is `Valid` if the bytes obey all rules of the protocol, the probe reports no error, and the value is in range.
//! Each protocol module states which errors its protocol cannot detect. If the probe reports that it cannot measure, the
//! reading is `Faulty` and its position is NaN. If the port is lost, the last reading remains, becomes `Faulty`, and its age
//! grows.
//!
//! `sequence` counts measurements, including those that were lost according to the probe's counter. It increases only with
//! new measurements; repeated values are withheld.
//!
//! `age_ns` is an upper bound as far as the driver can determine it: the age of an answer counts from its request, the age of
//! a message of a stream from the time before its first byte. If the driver cannot determine the age (the reader thread was
//! suspended, a backlog of bytes, an answer that may belong to an earlier request), the value is counted but not
//! published. A damaged message gives no reading.

pub mod ascii;
pub mod capancdt;
mod cell;
mod decoder;
pub mod emulator;
mod error;
mod ioctl;
mod lock;
mod mounting;
mod note;
pub mod optoncdt;
mod poller;
mod port;
mod probe;
mod protocol;
mod reader;
mod statistics;

pub use decoder::{DamageCounter, Decoder, Event, Sample, Window};
pub use error::SerialError;
pub use mounting::Mounting;
pub use note::Note;
pub use port::{Parity, PortSettings};
pub use probe::{ProbeSettings, SerialProbe, StatisticsHandle};
pub use protocol::{Polling, Protocol};
pub use statistics::Statistics;
