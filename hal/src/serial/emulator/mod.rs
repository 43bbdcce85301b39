//! Emulated probes: the probe's side of a serial line, for tests and rehearsals without hardware.
//!
//! ```text
//! Responder (protocol) --> EmulatedProbe (sampling, faults) --> ProbeTask (thread) --> Line (pseudo terminal or port)
//! ```
//!
//! A protocol implements [`Responder`]; sampling, faults and the line are the same for every protocol. [`Responder`] and
//! [`EmulatedProbe`] use neither a clock nor a port: the caller passes the time and the position of the stage.
//!
//! Positions are in metres of the probe: from the start of its measuring range (capaNCDT, optoNCDT) or from its zero
//! (ASCII).

mod fault;
mod line;
mod probe;
mod responder;
mod task;

pub use self::fault::Fault;
pub use self::line::Line;
pub use self::probe::EmulatedProbe;
pub use self::responder::Responder;
pub use self::task::{LineCounts, ProbeTask, SharedProbe};
