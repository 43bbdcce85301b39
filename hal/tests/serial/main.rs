//! The serial probes: their codecs by the manuals' bytes and by any bytes.

mod any_bytes;
mod ascii;
mod capancdt;
mod optoncdt;
mod support;
