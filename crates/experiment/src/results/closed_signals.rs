//! Reference and error of a recorded closed loop, tick by tick, for spectra and simulations.

use bench_recording::{Recording, RecordingError};
use bench_rt::record::{TickRecord, flag};

/// Largest number of ticks: 400 s at 5 kHz. Later ticks are left out.
const MAX_TICKS: usize = 2_000_000;

/// The signals from the tick on in which the loop closed. A missing tick has the values of the one before.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ClosedSignals {
    /// Reference in metres, relative to the rest position.
    pub(crate) reference_m: Vec<f64>,
    /// Reference minus position in metres.
    pub(crate) error_m: Vec<f64>,
}

impl ClosedSignals {
    /// The signals in a recording.
    ///
    /// # Errors
    /// When the recording cannot be read.
    pub(crate) fn of(recording: &Recording) -> Result<ClosedSignals, RecordingError> {
        let mut collector = Collector::default();
        for record in recording.ticks()? {
            collector.push(&record?);
            if collector.signals.error_m.len() >= MAX_TICKS {
                break;
            }
        }
        Ok(collector.signals)
    }
}

#[derive(Default)]
struct Collector {
    signals: ClosedSignals,
    rest_m: f64,
    last_tick: Option<u64>,
}

impl Collector {
    fn push(&mut self, record: &TickRecord) {
        if record.flags & flag::ACTIVE == 0 {
            if self.last_tick.is_none() {
                self.rest_m = record.reference_m;
            }
            return;
        }
        let values = (
            record.reference_m - self.rest_m,
            record.reference_m - record.position_m,
        );
        if !(values.0.is_finite() && values.1.is_finite()) {
            return;
        }
        let ticks = self
            .last_tick
            .map_or(1, |last| record.tick.saturating_sub(last));
        self.add_missing(ticks.saturating_sub(1));
        self.signals.reference_m.push(values.0);
        self.signals.error_m.push(values.1);
        self.last_tick = Some(record.tick);
    }

    /// Repeats the last values for missing ticks.
    fn add_missing(&mut self, ticks: u64) {
        let room = MAX_TICKS.saturating_sub(self.signals.error_m.len());
        let length = self.signals.error_m.len() + (ticks as usize).min(room);
        for values in [&mut self.signals.reference_m, &mut self.signals.error_m] {
            let last = values.last().copied().unwrap_or_default();
            values.resize(length, last);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(tick: u64, reference_m: f64, active: bool) -> TickRecord {
        TickRecord {
            tick,
            reference_m,
            position_m: 1e-4,
            flags: if active { flag::ACTIVE } else { 0 },
            ..TickRecord::default()
        }
    }

    #[test]
    fn a_missing_tick_has_the_values_of_the_one_before() {
        let mut collector = Collector::default();
        for (tick, reference_m, active) in [
            (0, 9.0, false),
            (1, 1e-4, false),
            (2, 1e-4, true),
            (3, 1.5e-4, true),
            (6, 1.2e-4, true),
            (7, 0.0, false),
        ] {
            collector.push(&record(tick, reference_m, active));
        }
        let expected_um = [0.0, 50.0, 50.0, 50.0, 20.0];
        for values in [&collector.signals.reference_m, &collector.signals.error_m] {
            assert_eq!(values.len(), expected_um.len());
            for (value, expected_um) in values.iter().zip(expected_um) {
                assert!((value - 1e-6 * expected_um).abs() < 1e-15, "{values:?}");
            }
        }
    }
}
