//! The ticks of a recorded run as signals at regular times.

use std::collections::BTreeMap;

use super::analysis_error::AnalysisError;
use bench_base::running_stats::RunningStats;
use bench_identify::joint::LoopSignals;
use bench_identify::resampling::Readings;
use bench_identify::{Signals, setpoint_timing};
use bench_rt::record::TickRecord;

/// Largest ratio of interpolated ticks: each of them adds an error.
const FILLED_RATIO: f64 = 1e-3;

/// Times that differ by less than this ratio of a period are treated as equal.
const SAME_TIME_RATIO: f64 = 1e-3;

/// Largest age of a reading: the upper bound of `interlock.probe_stale_s`, at which a loop trips.
const MAX_AGE_S: f64 = 10.0;

/// The signals of a run at regular times.
pub(crate) struct RunSignals {
    /// Reference, command and position.
    pub(super) loop_signals: LoopSignals,
    /// Number of interpolated ticks.
    pub(crate) filled_ticks: u64,
}

/// Ticks that are missing between two records.
struct Missing {
    /// Number of ticks before them in the signals without them.
    index: usize,
    /// The last tick before them.
    after_tick: u64,
    ticks: u64,
}

/// Collects reference, command and position of every tick of a run, and interpolates missing ticks.
pub(super) struct SignalBuilder {
    input_a: Vec<f64>,
    output_m: Vec<f64>,
    reference_m: Vec<f64>,
    /// Time from each tick to its command, in periods; NaN if it is not known.
    late: Vec<f64>,
    readings: Readings,
    /// Mean and range of the time in seconds from a tick to the measurement of its reading, which is minus the age.
    offset_s: RunningStats,
    offset_range_s: (f64, f64),
    last_tick: Option<u64>,
    first_s: f64,
    rate_hz: f64,
    /// Devices answer when they are read; the simulated stage answers at the scheduled time, even if the tick was late.
    on_devices: bool,
    missing: Vec<Missing>,
}

impl SignalBuilder {
    /// For a recording with this metadata.
    pub(super) fn new(metadata: &BTreeMap<String, String>, rate_hz: f64) -> Self {
        let probe = metadata.get("probe");
        SignalBuilder::of(rate_hz, probe.is_some_and(|probe| probe != "simulated"))
    }

    fn of(rate_hz: f64, on_devices: bool) -> Self {
        SignalBuilder {
            input_a: Vec::new(),
            output_m: Vec::new(),
            reference_m: Vec::new(),
            late: Vec::new(),
            readings: Readings::default(),
            offset_s: RunningStats::default(),
            offset_range_s: (f64::INFINITY, f64::NEG_INFINITY),
            last_tick: None,
            first_s: 0.0,
            rate_hz,
            on_devices,
            missing: Vec::new(),
        }
    }

    pub(super) fn push(&mut self, record: &TickRecord) -> Result<(), AnalysisError> {
        check_age(record)?;
        match self.last_tick {
            None => self.first_s = seconds(record.scheduled_ns),
            Some(last) => self.note_missing(last, record.tick),
        }
        self.push_times(record);
        self.input_a.push(record.command_a);
        self.output_m.push(record.position_m);
        self.reference_m.push(record.reference_m);
        self.last_tick = Some(record.tick);
        Ok(())
    }

    /// Adds the true times of command and reading. They are not known in a tick that is longer than a period: the amplifier was
    /// enabled in it, the schedule began anew after it, and the age of its reading refers to an unknown time.
    fn push_times(&mut self, record: &TickRecord) {
        let scheduled_s = seconds(record.scheduled_ns);
        let duration_s = seconds(record.done_ns.saturating_sub(record.woke_ns));
        if self.on_devices && duration_s * self.rate_hz > 1.0 {
            self.late.push(f64::NAN);
            return;
        }
        let (read_s, late) = if self.on_devices {
            let late = (seconds(record.done_ns) - scheduled_s) * self.rate_hz;
            (seconds(record.woke_ns), late)
        } else {
            (scheduled_s, 0.0)
        };
        self.late.push(late);
        let measured_s = read_s - seconds(record.probe_age_ns);
        self.readings.push(measured_s, record.position_m);
        self.push_offset(measured_s - scheduled_s);
    }

    fn push_offset(&mut self, offset_s: f64) {
        let (low_s, high_s) = self.offset_range_s;
        self.offset_s.push(offset_s);
        self.offset_range_s = (low_s.min(offset_s), high_s.max(offset_s));
    }

    fn note_missing(&mut self, last_tick: u64, next_tick: u64) {
        let ticks = next_tick.saturating_sub(last_tick).saturating_sub(1);
        if ticks > 0 {
            self.missing.push(Missing {
                index: self.input_a.len(),
                after_tick: last_tick,
                ticks,
            });
        }
    }

    /// Interpolates the missing ticks: current by zero-order hold, position and reference linearly. Returns their number; fails
    /// if there are too many.
    fn fill(&mut self, ticks: u64) -> Result<u64, AnalysisError> {
        let filled = missing_ticks(&self.missing, ticks)?;
        if filled > 0 {
            let missing = &self.missing;
            self.input_a = with_missing(&self.input_a, missing, |before, _, _| before);
            self.late = with_missing(&self.late, missing, |_, _, _| f64::NAN);
            self.output_m = with_missing(&self.output_m, missing, between);
            self.reference_m = with_missing(&self.reference_m, missing, between);
        }
        Ok(filled)
    }

    /// The signals of a recording with this number of ticks. If the times differ from tick to tick, currents are shifted to the median time and positions to the mean
    /// age.
    pub(super) fn finish(mut self, ticks: u64) -> Result<RunSignals, AnalysisError> {
        if self.input_a.is_empty() {
            return Err(AnalysisError::NothingRan);
        }
        let filled_ticks = self.fill(ticks)?;
        let aligned_m = self.aligned_positions();
        let signals = Signals {
            rate_hz: self.rate_hz,
            input: aligned_currents(self.input_a, self.late),
            output: aligned_m.unwrap_or(self.output_m),
        };
        Ok(RunSignals {
            loop_signals: LoopSignals {
                signals,
                reference_m: self.reference_m,
            },
            filled_ticks,
        })
    }

    /// The positions at the mean age; `None` if all ages are equal.
    fn aligned_positions(&self) -> Option<Vec<f64>> {
        let (low_s, high_s) = self.offset_range_s;
        if (high_s - low_s) * self.rate_hz <= SAME_TIME_RATIO {
            return None;
        }
        let start_s = self.first_s + self.offset_s.mean;
        let (period_s, count) = (1.0 / self.rate_hz, self.output_m.len());
        let aligned = self.readings.at_regular_times(start_s, period_s, count);
        Some(aligned).filter(|aligned| aligned.len() == count)
    }
}

/// Number of missing ticks beside `ticks` recorded ones; fails if there are too many.
fn missing_ticks(missing: &[Missing], ticks: u64) -> Result<u64, AnalysisError> {
    let allowed = (ticks as f64 * FILLED_RATIO) as u64;
    let mut all = 0u64;
    for gap in missing {
        all = all.saturating_add(gap.ticks);
        if all > allowed {
            return Err(AnalysisError::Gaps {
                missing: all,
                after: gap.after_tick,
                ticks,
                allowed,
            });
        }
    }
    Ok(all)
}

/// A signal with values at the missing ticks. `value` is given the values before and after them, and the share of the time between
/// the two that has passed.
fn with_missing(
    signal: &[f64],
    missing: &[Missing],
    value: impl Fn(f64, f64, f64) -> f64,
) -> Vec<f64> {
    let mut filled = Vec::with_capacity(signal.len());
    let mut done = 0;
    for gap in missing {
        filled.extend_from_slice(&signal[done..gap.index]);
        done = gap.index;
        let (before, after) = (signal[gap.index - 1], signal[gap.index]);
        let share = |step: u64| step as f64 / (gap.ticks + 1) as f64;
        filled.extend((1..=gap.ticks).map(|step| value(before, after, share(step))));
    }
    filled.extend_from_slice(&signal[done..]);
    filled
}

/// Linear interpolation.
fn between(before: f64, after: f64, share: f64) -> f64 {
    before + share * (after - before)
}

/// The currents at the median time. A current whose time is not known (NaN) is treated as if it took effect then.
fn aligned_currents(input_a: Vec<f64>, late: Vec<f64>) -> Vec<f64> {
    let mut known: Vec<f64> = late.iter().copied().filter(|late| !late.is_nan()).collect();
    known.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (known.first(), known.last()) else {
        return input_a;
    };
    if last - first <= SAME_TIME_RATIO {
        return input_a;
    }
    let median = known[known.len() / 2];
    let later = late.into_iter().map(|late| late - median);
    let later: Vec<f64> = later.map(|x| if x.is_nan() { 0.0 } else { x }).collect();
    setpoint_timing::at_regular_times(&input_a, &later)
}

/// Refuses a reading that no loop would have used: the resampling would need a grid of its age.
fn check_age(record: &TickRecord) -> Result<(), AnalysisError> {
    let age_s = seconds(record.probe_age_ns);
    if age_s <= MAX_AGE_S {
        Ok(())
    } else {
        Err(AnalysisError::ReadingAge {
            tick: record.tick,
            age_s,
            limit_s: MAX_AGE_S,
        })
    }
}

fn seconds(ns: u64) -> f64 {
    ns as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ticks from 0 to `count`, without those that are `lost`.
    fn gathered(count: u64, lost: impl Fn(u64) -> bool) -> Result<RunSignals, AnalysisError> {
        let kept: Vec<u64> = (0..count).filter(|tick| !lost(*tick)).collect();
        let ticks = kept.len() as u64;
        let mut gathered = SignalBuilder::of(1000.0, false);
        for tick in kept {
            let (ns, position_m) = (tick * 1_000_000, tick as f64 * 1e-9);
            let times = TickRecord {
                scheduled_ns: ns,
                woke_ns: ns,
                done_ns: ns,
                ..TickRecord::default()
            };
            gathered.push(&TickRecord {
                tick,
                position_m,
                command_a: 0.5,
                ..times
            })?;
        }
        gathered.finish(ticks)
    }

    #[test]
    fn rejects_reading_older_than_any_loop_uses() {
        for (probe_age_ns, is_accepted) in [
            (10_000_000_000, true),
            (10_000_001_000, false),
            (i64::MAX as u64, false),
            (u64::MAX, false),
        ] {
            let mut gathered = SignalBuilder::of(1000.0, false);
            let record = TickRecord {
                tick: 7,
                probe_age_ns,
                ..TickRecord::default()
            };
            match gathered.push(&record) {
                Ok(()) => assert!(is_accepted, "{probe_age_ns}"),
                Err(error) => assert!(
                    !is_accepted && error.to_string().contains("tick 7"),
                    "{error}"
                ),
            }
        }
    }

    #[test]
    fn interpolates_at_most_a_thousandth_of_all_ticks() {
        // 9990 recorded ticks allow 9 missing ones: here one per thousand, the last at tick 8500; then one gap of
        // nine.
        let nine =
            gathered(10_000, |tick| tick % 1000 == 500 && tick < 9000).expect("nine are few");
        assert_eq!(nine.filled_ticks, 9);
        let Signals { input, output, .. } = nine.loop_signals.signals;
        assert!(input.len() == 10_000 && input.iter().all(|u| *u == 0.5));
        let straight = |(tick, y): (usize, &f64)| (y - tick as f64 * 1e-9).abs() < 1e-18;
        assert!(
            output.iter().enumerate().all(straight),
            "on a straight line"
        );
        assert_eq!(
            gathered(10_000, |tick| (500..509).contains(&tick))
                .expect("nine")
                .filled_ticks,
            9
        );
        for lost in [
            |tick: u64| tick % 1000 == 500,
            |tick: u64| (500..510).contains(&tick),
        ] {
            let Err(error) = gathered(10_000, lost) else {
                panic!("ten of 9990 are too many")
            };
            assert!(
                matches!(
                    error,
                    AnalysisError::Gaps {
                        missing: 10,
                        allowed: 9,
                        ..
                    }
                ),
                "{error}"
            );
        }
    }
}
