//! What is left of an output some of whose samples are no readings: stuck ones, those at a limit, and those that a slow probe repeats.
//!
//! ```text
//! sample of a probe that is stuck, or has no new value    lost: it tells nothing of the output
//! sample at the upper (lower) limit of a clipped output   at least (at most) this
//! other sample                                            its value
//! ```

use super::correction::Correction;
use super::defect::WHOLE;
use super::plateaus::{Limit, Run};
use crate::Signals;

/// At most this ratio of the changes of a slow probe lie between its readings, because a value was late.
const MAX_LATE_RATIO: f64 = 0.02;

/// What a sample tells of the output at its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// Its value.
    Value(f64),
    /// It is this value or a larger one.
    AtLeast(f64),
    /// It is this value or a smaller one.
    AtMost(f64),
    /// Nothing.
    Lost,
}

/// The readings of an output of which some samples are none.
#[derive(Clone, Debug, PartialEq)]
pub struct LostReadings {
    /// One for each sample.
    pub readings: Vec<Reading>,
    /// What is left out.
    pub corrections: Vec<Correction>,
}

impl LostReadings {
    /// The readings with what is known to be lost; `None` if nothing is. `held` is the number of samples for each value of a slow probe.
    pub(super) fn of(
        recorded: &Signals,
        held: Option<f64>,
        limits: &[Limit],
        runs: &[Run],
    ) -> Option<LostReadings> {
        let rate_hz = recorded.rate_hz;
        let mut lost = LostReadings {
            readings: recorded
                .output
                .iter()
                .copied()
                .map(Reading::Value)
                .collect(),
            corrections: Vec::new(),
        };
        if let Some(samples) = held {
            lost.keep_changes(&recorded.output, samples)?;
        }
        for limit in limits {
            lost.set_limit(limit, rate_hz);
        }
        lost.leave_out(runs, rate_hz);
        (!lost.corrections.is_empty()).then_some(lost)
    }

    /// Keeps every n-th sample, at which the output may change; `None` if it does not change at every n-th one with a whole number n.
    fn keep_changes(&mut self, output: &[f64], samples: f64) -> Option<()> {
        let every = samples.round() as usize;
        if every < 2 || (samples - samples.round()).abs() > WHOLE * samples {
            return None;
        }
        let is_change = |k: &usize| output[k - 1] != output[*k];
        let mut changes = vec![0; every];
        for k in (1..output.len()).filter(is_change) {
            changes[k % every] += 1;
        }
        let all: usize = changes.iter().sum();
        let phase = (0..every).max_by_key(|phase| changes[*phase])?;
        if (all - changes[phase]) as f64 > MAX_LATE_RATIO * all as f64 {
            return None;
        }
        for (k, reading) in self.readings.iter_mut().enumerate() {
            // The first value of the record is that of its first sample, or of one before.
            let is_new = k % every == phase;
            let is_late = (k + 1..output.len().min(k + every)).any(|later| is_change(&later));
            if !is_new || is_late {
                *reading = Reading::Lost;
            }
        }
        self.corrections.push(Correction::Held { samples: every });
        Some(())
    }

    /// Of the samples at a limit only that is known.
    fn set_limit(&mut self, limit: &Limit, rate_hz: f64) {
        let beyond = if limit.is_upper {
            Reading::AtLeast(limit.value)
        } else {
            Reading::AtMost(limit.value)
        };
        let mut samples = 0;
        for reading in &mut self.readings {
            if *reading == Reading::Value(limit.value) {
                *reading = beyond;
                samples += 1;
            }
        }
        self.corrections.push(Correction::Clipped {
            time_s: limit.first as f64 / rate_hz,
            value: limit.value,
            samples,
        });
    }

    /// Leaves out the samples that repeat the first one of a run. A run at a limit is no repetition.
    fn leave_out(&mut self, runs: &[Run], rate_hz: f64) {
        let is_value = |run: &&Run| matches!(self.readings[run.start], Reading::Value(_));
        let mut runs: Vec<Run> = runs.iter().filter(is_value).copied().collect();
        runs.sort_by_key(|run| run.start);
        let Some(first) = runs.first() else {
            return;
        };
        let mut samples = 0;
        for run in &runs {
            self.readings[run.repetitions()].fill(Reading::Lost);
            samples += run.repetitions().len();
        }
        self.corrections.push(Correction::Repeated {
            time_s: (first.start + 1) as f64 / rate_hz,
            samples,
            places: runs.len(),
        });
    }
}
