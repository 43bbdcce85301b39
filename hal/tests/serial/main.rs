//! The serial probes: decoders with the examples of the manuals and with arbitrary bytes, and the driver over pseudo
//! terminals.

mod ages;
mod any_bytes;
mod ascii;
mod capancdt;
mod faults;
mod line;
mod optoncdt;
mod ownership;
mod support;
