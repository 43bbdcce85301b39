//! The ticks of a recording, one after the other.

use std::path::Path;

use super::ExportError;
use bench_recording::Recording;
use bench_rt::record::TickRecord;

/// Takes the ticks of a recording.
pub(super) trait Rows {
    /// Takes the next tick.
    fn push(&mut self, record: &TickRecord) -> Result<(), ExportError>;
}

/// Opens a recording and passes on its ticks while it is checked, so that it is decoded once. An error of the recording is reported
/// before one of `rows`.
pub(super) fn open(path: &Path, rows: &mut dyn Rows) -> Result<Recording, ExportError> {
    let mut pushed = Ok(());
    let recording = Recording::open_with(path, &mut |_, record| {
        if pushed.is_ok() {
            pushed = rows.push(record);
        }
    })?;
    pushed.map(|()| recording)
}

/// Passes on the ticks of an open recording.
pub(super) fn read(recording: &Recording, rows: &mut dyn Rows) -> Result<(), ExportError> {
    for record in recording.ticks()? {
        rows.push(&record?)?;
    }
    Ok(())
}
