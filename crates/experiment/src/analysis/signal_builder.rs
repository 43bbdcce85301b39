//! The ticks of a recorded run as signals at regular times.

use std::collections::BTreeMap;

use super::aligned_readings::AlignedReadings;
use super::analysis_error::AnalysisError;
use super::missing_ticks::{MAX_RATIO, MissingTicks, check_lost, check_ratio};
use super::run_signals::RunSignals;
use bench_base::running_stats::RunningStats;
use bench_identify::joint::LoopSignals;
use bench_identify::resampling::Readings;
use bench_identify::{Signals, setpoint_timing};
use bench_rt::record::TickRecord;

/// Times that differ by less than this ratio of a period are treated as equal.
const SAME_TIME_RATIO: f64 = 1e-3;

/// Largest age of a reading: the upper bound of `interlock.probe_stale_s`, at which a loop trips.
const MAX_AGE_S: f64 = 10.0;

/// Ticks that are missing between two records.
struct Missing {
    /// Number of ticks before them in the signals without them.
    index: usize,
    ticks: u64,
    /// How many of them the loop served, although their records are lost.
    lost: u64,
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
            Some(last) => self.note_missing(last, record),
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

    fn note_missing(&mut self, last_tick: u64, next: &TickRecord) {
        let ticks = next.tick.saturating_sub(last_tick).saturating_sub(1);
        if ticks > 0 {
            self.missing.push(Missing {
                index: self.input_a.len(),
                ticks,
                lost: ticks.saturating_sub(u64::from(next.missed_ticks)),
            });
        }
    }

    /// Interpolates the missing ticks: current by zero-order hold, position and reference linearly. Returns them; fails if there are
    /// too many.
    fn fill(&mut self) -> Result<MissingTicks, AnalysisError> {
        let filled = missing_ticks(&self.missing, self.input_a.len())?;
        if !filled.is_empty() {
            let missing = &self.missing;
            self.input_a = with_missing(&self.input_a, missing, |before, _, _| before);
            self.late = with_missing(&self.late, missing, |_, _, _| f64::NAN);
            self.output_m = with_missing(&self.output_m, missing, between);
            self.reference_m = with_missing(&self.reference_m, missing, between);
        }
        Ok(filled)
    }

    /// The signals. If the times differ from tick to tick, currents are shifted to the median time and positions to the mean age.
    pub(super) fn finish(mut self) -> Result<RunSignals, AnalysisError> {
        if self.input_a.is_empty() {
            return Err(AnalysisError::NothingRan);
        }
        let missing = self.fill()?;
        let aligned = self.aligned_readings(&missing);
        let signals = Signals {
            rate_hz: self.rate_hz,
            input: aligned_currents(self.input_a, self.late),
            output: self.output_m,
        };
        let loop_signals = LoopSignals {
            signals,
            reference_m: self.reference_m,
        };
        Ok(RunSignals::new(loop_signals, missing, aligned))
    }

    /// The readings, to be shifted to the mean age; `None` if all ages are equal.
    fn aligned_readings(&mut self, missing: &MissingTicks) -> Option<AlignedReadings> {
        let (low_s, high_s) = self.offset_range_s;
        if (high_s - low_s) * self.rate_hz <= SAME_TIME_RATIO {
            return None;
        }
        let start_s = self.first_s + self.offset_s.mean;
        let readings = std::mem::take(&mut self.readings);
        let aligned = AlignedReadings::new(readings, start_s, 1.0 / self.rate_hz);
        Some(aligned.with_missing(&missing.indices))
    }
}

/// The missing ticks beside `recorded` ones; fails if there are too many.
fn missing_ticks(missing: &[Missing], recorded: usize) -> Result<MissingTicks, AnalysisError> {
    let sum = |of: fn(&Missing) -> u64| missing.iter().map(of).fold(0, u64::saturating_add);
    check_lost(sum(|gap| gap.lost), recorded as u64)?;
    let count = sum(|gap| gap.ticks);
    check_ratio(count, recorded as u64, MAX_RATIO)?;
    let mut indices = Vec::with_capacity(count as usize);
    for gap in missing {
        let first = gap.index + indices.len();
        indices.extend(first..first + gap.ticks as usize);
    }
    let ticks = recorded + indices.len();
    Ok(MissingTicks { indices, ticks })
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

    /// The ticks from 0 to `count`, without those that the loop missed.
    fn gathered(count: u64, is_missed: impl Fn(u64) -> bool) -> Result<RunSignals, AnalysisError> {
        let kept: Vec<u64> = (0..count).filter(|tick| !is_missed(*tick)).collect();
        let mut next = 0;
        let mut gathered = SignalBuilder::of(1000.0, false);
        for tick in kept {
            let (ns, position_m) = (tick * 1_000_000, tick as f64 * 1e-9);
            let times = TickRecord {
                scheduled_ns: ns,
                woke_ns: ns,
                done_ns: ns,
                missed_ticks: (tick - next) as u32,
                ..TickRecord::default()
            };
            next = tick + 1;
            gathered.push(&TickRecord {
                tick,
                position_m,
                command_a: 0.5,
                ..times
            })?;
        }
        gathered.finish()
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
    fn missing_ticks_are_on_a_line_and_hold_the_current() {
        // Single ticks, and a gap of nine.
        let is_missed = |tick: u64| tick % 1000 == 500 || (2500..2509).contains(&tick);
        let gathered = gathered(10_000, is_missed).expect("18 are few");
        assert_eq!(gathered.filled_ticks(), 18);
        let expected: Vec<usize> = (0..10_000).filter(|tick| is_missed(*tick as u64)).collect();
        assert_eq!(gathered.missing().indices, expected);
        let Signals { input, output, .. } = gathered.loop_signals.signals;
        assert!(input.len() == 10_000 && input.iter().all(|u| *u == 0.5));
        let straight = |(tick, y): (usize, &f64)| (y - tick as f64 * 1e-9).abs() < 1e-18;
        assert!(
            output.iter().enumerate().all(straight),
            "on a straight line"
        );
    }

    #[test]
    fn accepts_at_most_a_twentieth_of_missing_ticks() {
        // A twentieth of 10,000 ticks; 9,499 recorded ones allow 499.9 missing ones.
        let accepted = gathered(10_000, |tick| tick % 20 == 10).expect("500 are few enough");
        assert_eq!(accepted.filled_ticks(), 500);
        let Err(error) = gathered(10_000, |tick| tick % 20 == 10 || tick == 5000) else {
            panic!("501 are too many")
        };
        assert!(
            matches!(
                error,
                AnalysisError::Gaps {
                    missing: 501,
                    ticks: 9499,
                    allowed: 499,
                }
            ),
            "{error}"
        );
        assert!(error.to_string().contains("501 ticks are missing"));
    }

    #[test]
    fn rejects_more_than_a_thousandth_of_lost_records() {
        // Records without a count of missed ticks before them: the loop served these ticks with currents that are not known.
        let with_lost = |lost: u64| {
            let mut gathered = SignalBuilder::of(1000.0, false);
            for tick in (0..10_000).filter(|tick| !(5000..5000 + lost).contains(tick)) {
                gathered.push(&TickRecord {
                    tick,
                    ..TickRecord::default()
                })?;
            }
            gathered.finish()
        };
        assert_eq!(with_lost(10).expect("a thousandth").filled_ticks(), 10);
        let error = with_lost(11).err().expect("too many");
        assert!(
            matches!(error, AnalysisError::LostRecords { lost: 11, .. }),
            "{error}"
        );
    }

    #[test]
    fn rejects_gap_of_any_size_without_filling_it() {
        for missed_ticks in [0, u32::MAX] {
            let mut gathered = SignalBuilder::of(1000.0, false);
            for tick in [0, u64::from(u32::MAX) + 1] {
                let record = TickRecord {
                    tick,
                    missed_ticks,
                    ..TickRecord::default()
                };
                gathered.push(&record).expect("a tick");
            }
            let error = gathered.finish().err().expect("too many");
            let is_refused = match error {
                AnalysisError::LostRecords { .. } => missed_ticks == 0,
                AnalysisError::Gaps { .. } => missed_ticks > 0,
                _ => false,
            };
            assert!(is_refused, "{missed_ticks}: {error}");
        }
    }
}
