//! What is left of an output some of whose samples are no readings: stuck ones, those at a limit, and those that a slow probe repeats.
//!
//! ```text
//! sample of a probe that is stuck, or has no new value    lost: it tells nothing of the output (nor does the first one, as of a dropout to 0)
//! sample at the upper (lower) limit of a clipped output   at least (at most) this
//! other sample                                            its value
//! ```

use super::correction::Correction;
use super::defect::WHOLE;
use super::plateaus::{Limit, Run};

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

/// The output of a record.
#[derive(Clone, Copy, Debug)]
pub(super) struct Channel {
    pub(super) rate_hz: f64,
    /// The step of its values; 0 without one.
    pub(super) step: f64,
    /// Whether values are equal because of the step.
    pub(super) has_step: bool,
}

/// Samples of an output that are no readings.
#[derive(Clone, Debug)]
pub(super) struct NoReadings {
    /// The number of samples for each value of a slow probe.
    pub(super) held: Option<f64>,
    /// The limits of a clipped output.
    pub(super) limits: Vec<Limit>,
    /// Samples that repeat the one before.
    pub(super) runs: Vec<Run>,
}

impl LostReadings {
    /// The readings with what is known to be lost; `None` if nothing is.
    pub(super) fn of(
        output: &[f64],
        channel: Channel,
        samples: &NoReadings,
    ) -> Option<LostReadings> {
        let held = samples.held;
        let mut lost = LostReadings {
            readings: output.iter().copied().map(Reading::Value).collect(),
            corrections: Vec::new(),
        };
        if let Some(samples) = held {
            lost.keep_changes(output, samples)?;
        }
        for limit in &samples.limits {
            lost.set_limit(limit, channel);
        }
        if let Some(samples) = held.filter(|_| !channel.has_step) {
            lost.leave_out_old(samples.round() as usize);
        }
        lost.leave_out(&samples.runs, channel.rate_hz);
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
            let is_new = k % every == phase;
            let is_late = (k + 1..output.len().min(k + every)).any(|later| is_change(&later));
            if !is_new || is_late {
                *reading = Reading::Lost;
            }
        }
        self.corrections.push(Correction::Held { samples: every });
        Some(())
    }

    /// Leaves out the values of a slow probe that are equal to the one before, `every` samples earlier. Without a step they are no new ones.
    fn leave_out_old(&mut self, every: usize) {
        for k in (every..self.readings.len()).rev() {
            let is_value = matches!(self.readings[k], Reading::Value(_));
            if is_value && self.readings[k] == self.readings[k - every] {
                self.readings[k] = Reading::Lost;
            }
        }
    }

    /// Of the samples at a limit only that is known: with a step, the true value is less than half of it below an upper limit.
    fn set_limit(&mut self, limit: &Limit, channel: Channel) {
        let beyond = if limit.is_upper {
            Reading::AtLeast(limit.value - 0.5 * channel.step)
        } else {
            Reading::AtMost(limit.value + 0.5 * channel.step)
        };
        let at_limit = |reading: &Reading| *reading == Reading::Value(limit.value);
        let Some(first) = self.readings.iter().position(at_limit) else {
            return;
        };
        let mut samples = 0;
        for reading in self.readings.iter_mut().filter(|reading| at_limit(reading)) {
            *reading = beyond;
            samples += 1;
        }
        self.corrections.push(Correction::Clipped {
            time_s: first as f64 / channel.rate_hz,
            value: limit.value,
            samples,
        });
    }

    /// Leaves out the samples of runs. Those of a run at a limit are kept.
    fn leave_out(&mut self, runs: &[Run], rate_hz: f64) {
        let is_value = |run: &&Run| matches!(self.readings[run.start], Reading::Value(_));
        let mut runs: Vec<Run> = runs.iter().filter(is_value).copied().collect();
        runs.sort_by_key(|run| run.start);
        let Some(first) = runs.first() else {
            return;
        };
        let mut samples = 0;
        for run in &runs {
            self.readings[run.range()].fill(Reading::Lost);
            samples += run.range().len();
        }
        self.corrections.push(Correction::Repeated {
            time_s: first.start as f64 / rate_hz,
            samples,
            places: runs.len(),
        });
    }
}
