//! The ticks of a recorded run as signals on the loop's regular times.

use super::analysis_error::AnalysisError;
use crate::identify::joint::LoopSignals;
use crate::identify::resampling::Readings;
use crate::identify::{Signals, setpoint_timing};
use crate::recording::Recording;
use crate::rt::record::TickRecord;
use crate::util::running_stats::RunningStats;

/// Ticks that may be filled in, as a ratio of all: each adds an error of its own.
const FILLED_RATIO: f64 = 1e-3;

/// Times that differ by less than this part of a period are the same.
const SAME: f64 = 1e-3;

/// A run on regular times.
pub(super) struct RunSignals {
    /// Reference, command and position.
    pub(super) loop_signals: LoopSignals,
    /// Ticks that were filled in.
    pub(super) filled_ticks: u64,
}

/// Command and position of every tick of a run as they come, missing ones filled in.
pub(super) struct SignalBuilder {
    input_a: Vec<f64>,
    output_m: Vec<f64>,
    reference_m: Vec<f64>,
    /// Periods from each tick to its command.
    late: Vec<f64>,
    readings: Readings,
    /// Mean, and extremes, of the time in seconds from a tick to the measurement it had: minus the age.
    offset_s: RunningStats,
    offset_range_s: (f64, f64),
    before: Option<TickRecord>,
    first_s: f64,
    rate_hz: f64,
    /// Devices answer when they are asked; the simulated stage answers at the tick itself, however late it was served.
    on_devices: bool,
    filled: u64,
    allowed: u64,
    ticks: u64,
}

impl SignalBuilder {
    pub(super) fn new(recording: &Recording, rate_hz: f64) -> Self {
        let on_devices = recording
            .metadata()
            .get("probe")
            .is_some_and(|probe| probe != "simulated");
        SignalBuilder::of(recording.tick_count(), rate_hz, on_devices)
    }

    /// Of a recording of so many ticks.
    fn of(ticks: u64, rate_hz: f64, on_devices: bool) -> Self {
        SignalBuilder {
            input_a: Vec::new(),
            output_m: Vec::new(),
            reference_m: Vec::new(),
            late: Vec::new(),
            readings: Readings::default(),
            offset_s: RunningStats::default(),
            offset_range_s: (f64::INFINITY, f64::NEG_INFINITY),
            before: None,
            first_s: 0.0,
            rate_hz,
            on_devices,
            filled: 0,
            allowed: (ticks as f64 * FILLED_RATIO) as u64,
            ticks,
        }
    }

    pub(super) fn push(&mut self, record: &TickRecord) -> Result<(), AnalysisError> {
        match self.before {
            None => self.first_s = seconds(record.scheduled_ns),
            Some(before) => self.fill(&before, record)?,
        }
        self.take_times(record);
        self.input_a.push(record.command_a);
        self.output_m.push(record.position_m);
        self.reference_m.push(record.reference_m);
        self.before = Some(*record);
        Ok(())
    }

    /// The true times of command and reading. Within a tick longer than a period an amplifier was enabled, and the schedule
    /// began anew after it, as if it had been on time; what its reading's age is counted from is not recorded.
    fn take_times(&mut self, record: &TickRecord) {
        let scheduled_s = seconds(record.scheduled_ns);
        if self.on_devices
            && seconds(record.done_ns.saturating_sub(record.woke_ns)) * self.rate_hz > 1.0
        {
            self.late.push(f64::NAN);
            return;
        }
        let late = (seconds(record.done_ns) - scheduled_s) * self.rate_hz;
        self.late.push(if self.on_devices { late } else { 0.0 });
        let asked_s = if self.on_devices {
            seconds(record.woke_ns)
        } else {
            scheduled_s
        };
        let measured_s = asked_s - seconds(record.probe_age_ns);
        let offset_s = measured_s - scheduled_s;
        self.readings.push(measured_s, record.position_m);
        self.offset_s.push(offset_s);
        self.offset_range_s = (
            self.offset_range_s.0.min(offset_s),
            self.offset_range_s.1.max(offset_s),
        );
    }

    /// Fills the gap between two records, unless all gaps so far are too long: the current held, the position on a straight
    /// line.
    fn fill(&mut self, before: &TickRecord, after: &TickRecord) -> Result<(), AnalysisError> {
        let missing = after.tick.saturating_sub(before.tick).saturating_sub(1);
        let all = self.filled.saturating_add(missing);
        if all > self.allowed {
            return Err(AnalysisError::Gaps {
                missing: all,
                ticks: self.ticks,
                allowed: self.allowed,
            });
        }
        for step in 1..=missing {
            let share = step as f64 / (missing + 1) as f64;
            let between = |from: f64, to: f64| from + share * (to - from);
            self.input_a.push(before.command_a);
            self.late.push(f64::NAN);
            self.output_m
                .push(between(before.position_m, after.position_m));
            self.reference_m
                .push(between(before.reference_m, after.reference_m));
        }
        self.filled += missing;
        Ok(())
    }

    /// Where times differ from tick to tick, the currents as of the median time, the positions as of the mean age.
    pub(super) fn finish(self) -> Result<RunSignals, AnalysisError> {
        if self.input_a.is_empty() {
            return Err(AnalysisError::NothingRan);
        }
        let (rate_hz, filled_ticks) = (self.rate_hz, self.filled);
        let aligned = self.positions();
        let output_m = if aligned.len() == self.output_m.len() {
            aligned
        } else {
            self.output_m
        };
        let signals = Signals {
            rate_hz,
            input_a: currents(self.input_a, self.late),
            output_m,
        };
        Ok(RunSignals {
            loop_signals: LoopSignals {
                signals,
                reference_m: self.reference_m,
            },
            filled_ticks,
        })
    }

    /// The positions at the mean age, where ages differ; else none.
    fn positions(&self) -> Vec<f64> {
        if (self.offset_range_s.1 - self.offset_range_s.0) * self.rate_hz <= SAME {
            return Vec::new();
        }
        let start_s = self.first_s + self.offset_s.mean;
        self.readings
            .at_regular_times(start_s, 1.0 / self.rate_hz, self.output_m.len())
    }
}

/// The currents as of the median time; those whose own is not known (`NAN`) came then.
fn currents(input_a: Vec<f64>, late: Vec<f64>) -> Vec<f64> {
    let mut known: Vec<f64> = late.iter().copied().filter(|late| !late.is_nan()).collect();
    known.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (known.first(), known.last()) else {
        return input_a;
    };
    if last - first <= SAME {
        return input_a;
    }
    let median = known[known.len() / 2];
    let later: Vec<f64> = late
        .into_iter()
        .map(|late| if late.is_nan() { 0.0 } else { late - median })
        .collect();
    setpoint_timing::at_regular_times(&input_a, &later)
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
        let mut gathered = SignalBuilder::of(kept.len() as u64, 1000.0, false);
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
        gathered.finish()
    }

    #[test]
    fn a_thousandth_of_all_ticks_is_filled_in_and_no_more_however_short_the_gaps() {
        // Of 9990 that are there, 9 may be missing: one a thousand, the last at 8500, or a gap of nine.
        let nine =
            gathered(10_000, |tick| tick % 1000 == 500 && tick < 9000).expect("nine are few");
        assert_eq!(nine.filled_ticks, 9);
        let Signals {
            input_a, output_m, ..
        } = nine.loop_signals.signals;
        assert!(input_a.len() == 10_000 && input_a.iter().all(|u| *u == 0.5));
        let straight = |(tick, y): (usize, &f64)| (y - tick as f64 * 1e-9).abs() < 1e-18;
        assert!(
            output_m.iter().enumerate().all(straight),
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
