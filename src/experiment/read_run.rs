//! The signals of a run, read in the same pass that opens its recording.

use std::collections::BTreeMap;
use std::path::Path;

use super::analysis_error::AnalysisError;
use super::plan::{KIND, RunKind};
use super::signal_builder::{RunSignals, SignalBuilder};
use crate::recording::{Recording, RecordingError};
use crate::rt::arming::State;
use crate::rt::record::{TickRecord, flag};

/// The signals of a run, or why it has none.
pub struct ReadSignals(Result<RunSignals, AnalysisError>);

impl ReadSignals {
    pub(super) fn into_result(self) -> Result<RunSignals, AnalysisError> {
        self.0
    }
}

/// Opens a recording of a loop with this rate and reads the signals of its run. A recording is then decoded once, not twice.
///
/// # Errors
/// Those of [`Recording::open`].
pub fn open_with_signals(
    path: &Path,
    rate_hz: f64,
) -> Result<(Recording, ReadSignals), RecordingError> {
    let mut signals = None;
    let recording = Recording::open_with(path, &mut |metadata, record| {
        let signals = signals.get_or_insert_with(|| Collected::new(metadata, rate_hz));
        signals.take(record);
    })?;
    let signals = signals.map_or(Err(AnalysisError::NothingRan), |signals: Collected| {
        signals.finish(recording.tick_count())
    });
    Ok((recording, ReadSignals(signals)))
}

/// The signals so far.
struct Collected {
    signals: Result<SignalBuilder, AnalysisError>,
    only_closed: bool,
}

impl Collected {
    fn new(metadata: &BTreeMap<String, String>, rate_hz: f64) -> Collected {
        Collected {
            signals: Ok(SignalBuilder::new(metadata, rate_hz)),
            only_closed: is_closed_loop(metadata),
        }
    }

    /// Adds a tick, unless an earlier one has been refused.
    fn take(&mut self, record: &TickRecord) {
        if let Ok(signals) = &mut self.signals
            && is_of_run(record, self.only_closed)
            && let Err(error) = signals.push(record)
        {
            self.signals = Err(error);
        }
    }

    fn finish(self, ticks: u64) -> Result<RunSignals, AnalysisError> {
        self.signals?.finish(ticks)
    }
}

/// Whether the run closed a loop.
pub(super) fn is_closed_loop(metadata: &BTreeMap<String, String>) -> bool {
    let kind = metadata.get(KIND);
    kind.is_some_and(|kind| kind == RunKind::Control.name())
}

/// Whether a tick belongs to the run, or to the part of it with the loop closed.
pub(super) fn is_of_run(record: &TickRecord, only_closed: bool) -> bool {
    let is_closed = record.flags & flag::ACTIVE != 0;
    record.state == State::Running && (is_closed || !only_closed)
}
