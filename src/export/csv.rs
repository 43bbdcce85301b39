//! A header line, and a line for each tick. A cell without a measurement is empty; numbers read back to the same double.

use std::io::Write;

use super::file::Output;
use super::{ExportError, SIGNALS, Sample};
use crate::recording::Recording;

pub(super) fn write(recording: &Recording, out: &mut Output) -> Result<(), ExportError> {
    writeln!(out, "{}", SIGNALS.map(|signal| signal.name).join(","))?;
    for record in recording.ticks()? {
        let record = record?;
        for (index, signal) in SIGNALS.iter().enumerate() {
            if index > 0 {
                out.write_all(b",")?;
            }
            match (signal.value)(&record) {
                Sample::Real(Some(value)) => write!(out, "{value:e}")?,
                Sample::Real(None) => {}
                Sample::Count(count) => write!(out, "{count}")?,
            }
        }
        out.write_all(b"\n")?;
    }
    Ok(())
}
