//! The serial probes: their codecs by the manuals' bytes and by any bytes, and the driver over pseudo terminals.

mod ages;
mod any_bytes;
mod ascii;
mod capancdt;
mod faults;
mod line;
mod optoncdt;
mod ownership;
mod support;
