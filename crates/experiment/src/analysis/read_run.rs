//! The signals of a run, read in the same pass that opens its recording.

use std::collections::BTreeMap;
use std::path::Path;

use super::analysis_error::AnalysisError;
use super::run_signals::RunSignals;
use super::signal_builder::SignalBuilder;
use crate::plan::{KIND, RunKind};
use bench_config::whole;
use bench_recording::{Preceding, Recording, RecordingError};
use bench_rt::arming::State;
use bench_rt::record::{TickRecord, flag};

/// The signals of a run, or why it has none. `None` if they are not read yet, by default or because the configuration does not precede
/// the ticks in the file.
#[derive(Default)]
pub struct ReadSignals(Option<Result<RunSignals, AnalysisError>>);

impl ReadSignals {
    pub(super) fn into_result(self) -> Option<Result<RunSignals, AnalysisError>> {
        self.0
    }
}

/// Opens a recording and reads the signals of its run. A recording is then decoded once, not twice.
///
/// # Errors
/// Those of [`Recording::open`].
pub fn open_with_signals(path: &Path) -> Result<(Recording, ReadSignals), RecordingError> {
    let mut collected = None;
    let recording = Recording::open_with(path, &mut |preceding, record| {
        if let Some(signals) = collected.get_or_insert_with(|| Collected::new(preceding)) {
            signals.take(record);
        }
    })?;
    let collected: Option<Collected> = collected.flatten();
    let signals = collected.map(Collected::finish);
    Ok((recording, ReadSignals(signals)))
}

/// The signals so far.
struct Collected {
    signals: Result<SignalBuilder, AnalysisError>,
    only_closed: bool,
}

impl Collected {
    /// `None` without a configuration.
    fn new(preceding: &Preceding<'_>) -> Option<Collected> {
        let config = whole(
            "the configuration of the recording",
            preceding.config_toml()?,
        )
        .ok()?;
        let rate_hz = config.servo.rate_hz;
        Some(Collected {
            signals: Ok(SignalBuilder::new(preceding.metadata, rate_hz)),
            only_closed: is_closed_loop(preceding.metadata),
        })
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

    fn finish(self) -> Result<RunSignals, AnalysisError> {
        self.signals?.finish()
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
