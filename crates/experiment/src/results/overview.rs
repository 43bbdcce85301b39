//! A whole run as minima and maxima of short intervals: what a plot can show, with constant memory.

use crate::errors::ExperimentError;
use bench_recording::Recording;
use bench_rt::record::TickRecord;

/// Intervals of an overview: more than a plot has columns.
const INTERVALS: u64 = 1500;

/// Minimum and maximum of a signal in an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Beginning of the interval in seconds since the run began.
    pub time_s: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

/// The signals of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overview {
    /// Reference in metres.
    pub reference_m: Vec<Extent>,
    /// Valid positions in metres.
    pub position_m: Vec<Extent>,
    /// Reference minus valid position in metres.
    pub error_m: Vec<Extent>,
    /// Current set-point in amperes.
    pub current_a: Vec<Extent>,
}

/// The overview of a recording; empty if it has no ticks.
///
/// # Errors
/// When the recording cannot be read.
pub fn overview(recording: &Recording) -> Result<Overview, ExperimentError> {
    let (first, last) = (recording.first_tick(), recording.last_tick());
    let interval_ticks = (last.saturating_sub(first) / INTERVALS).max(1);
    let mut overview = Overview::default();
    for record in recording.ticks()? {
        overview.add(&record?, interval_ticks, first);
    }
    Ok(overview)
}

impl Overview {
    fn add(&mut self, record: &TickRecord, interval_ticks: u64, first: u64) {
        let begins = record
            .tick
            .saturating_sub(first)
            .is_multiple_of(interval_ticks);
        let time_s = record.scheduled_ns as f64 * 1e-9;
        for (extents, value) in [
            (&mut self.reference_m, record.reference_m),
            (&mut self.position_m, record.position_m),
            (&mut self.error_m, record.reference_m - record.position_m),
            (&mut self.current_a, record.command_a),
        ] {
            add_value(extents, value, time_s, begins);
        }
    }
}

/// Adds a value to the last interval, or begins one. What is not a number is left out.
fn add_value(extents: &mut Vec<Extent>, value: f64, time_s: f64, begins: bool) {
    if !value.is_finite() {
        return;
    }
    match extents.last_mut() {
        Some(last) if !begins => {
            last.min = last.min.min(value);
            last.max = last.max.max(value);
        }
        _ => extents.push(Extent {
            time_s,
            min: value,
            max: value,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_spike_of_one_tick_and_its_time() {
        let mut overview = Overview::default();
        for tick in 0..100_000 {
            let spike = f64::from(u8::from(tick == 54_321));
            let record = TickRecord {
                tick,
                scheduled_ns: tick * 200_000,
                position_m: spike,
                command_a: -spike,
                reference_m: f64::NAN,
                ..TickRecord::default()
            };
            overview.add(&record, 66, 0);
        }
        assert_eq!(overview.position_m.len(), 1516);
        let high: Vec<&Extent> = overview.position_m.iter().filter(|e| e.max > 0.5).collect();
        let [spike] = high[..] else {
            panic!("{high:?}")
        };
        let at_s = 54_321.0 * 2e-4;
        assert!(
            (at_s - 66.0 * 2e-4..=at_s).contains(&spike.time_s),
            "{spike:?}"
        );
        assert_eq!(
            overview.current_a.iter().filter(|e| e.min < -0.5).count(),
            1
        );
        assert_eq!(overview.reference_m, []);
    }
}
