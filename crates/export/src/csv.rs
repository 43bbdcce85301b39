//! A header line, and a line for each tick or frequency. A cell without a measurement is empty; numbers read back to the
//! same double.

use std::io::{self, Write};
use std::path::Path;

use super::file::Output;
use super::rows::{self, Rows};
use super::{ExportError, SIGNALS, Signal, Value};
use bench_identify::{Frf, frf_csv};
use bench_recording::Recording;
use bench_rt::record::TickRecord;

pub(super) fn signals(recording: &Path, out: &mut Output) -> Result<Recording, ExportError> {
    writeln!(out, "{}", SIGNALS.map(|signal| signal.name).join(","))?;
    rows::open(recording, &mut Lines(out))
}

/// The table that `bench identify` writes.
pub(super) fn response(frf: &Frf, out: &mut Output) -> Result<(), ExportError> {
    let text = frf_csv::to_string(frf, frf_csv::METRES_PER_AMPERE);
    Ok(out.write_all(text.as_bytes())?)
}

/// Writes a line for each tick.
struct Lines<'a>(&'a mut Output);

impl Rows for Lines<'_> {
    fn push(&mut self, record: &TickRecord) -> Result<(), ExportError> {
        let out = &mut self.0;
        for (index, signal) in SIGNALS.iter().enumerate() {
            if index > 0 {
                out.write_all(b",")?;
            }
            write_cell(out, signal, record)?;
        }
        Ok(out.write_all(b"\n")?)
    }
}

fn write_cell(out: &mut Output, signal: &Signal, record: &TickRecord) -> io::Result<()> {
    match signal.value {
        Value::Real(_, value) => match value(record) {
            Some(value) => write!(out, "{value:e}"),
            None => Ok(()),
        },
        Value::Count(value) => write!(out, "{}", value(record)),
    }
}
