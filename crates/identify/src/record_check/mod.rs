//! Defects of a record that an estimator would take for signal: spikes, steps, repeated and clipped samples, motion at its ends.
//!
//! A defect is alike from one frequency to the next, so that modes are fitted to it. It is found in the time domain.

mod correction;
mod defect;
mod ends;
mod held;
mod lost;
mod outlier;
mod plateaus;
mod prediction;
mod resolution;
mod stray_lines;
#[cfg(test)]
mod tests;

use super::Signals;
pub use correction::{Corrected, Correction};
pub use defect::Defect;
use ends::motion_at_ends;
pub use ends::{Ends, input_ratio_at_end, input_ratio_at_start};
use held::held;
use lost::{Channel, NoReadings};
pub use lost::{LostReadings, Reading};
pub(crate) use plateaus::limit_of_input;
use plateaus::{Quantisation, limits, repeated};
use prediction::Prediction;
pub use resolution::Resolution;
pub use stray_lines::{StrayLine, stray_lines, without};

/// An output whose step is below this ratio of its noise has as few equal neighbours as one without a step.
const MIN_STEP_RATIO: f64 = 0.1;

/// What a record is checked for.
#[derive(Clone, Debug, Default)]
pub struct Checked {
    /// The first defect of each kind.
    pub defects: Vec<Defect>,
    /// The readings that are left, if the defects are lost ones.
    pub lost: Option<LostReadings>,
    /// Standard deviation of the times of the readings in seconds, if they are irregular and the record does not state them.
    pub jitter_s: Option<f64>,
}

impl Checked {
    fn of(defects: Vec<Defect>) -> Checked {
        Checked {
            defects,
            lost: None,
            jitter_s: None,
        }
    }
}

/// Checks a record. `cleaned` is the record without its stray lines; its values are no multiples of a step any more.
/// Motion is a defect of a record that must begin and end at rest.
pub fn check(recorded: &Signals, cleaned: &Signals, ends: Ends) -> Checked {
    let step = resolution::step(&recorded.output).unwrap_or(0.0);
    let prediction = Prediction::new(cleaned, step);
    let noise = prediction.as_ref().map_or(0.0, Prediction::noise);
    let quantisation = (step > MIN_STEP_RATIO * noise).then_some(Quantisation { step, noise });
    if let Some(lasting) = lasting(recorded, step, quantisation) {
        return lasting;
    }
    let Some(prediction) = prediction.filter(|_| ends != Ends::Periods) else {
        return Checked::default();
    };
    let mut found = prediction.jumps();
    if ends == Ends::Rest {
        found.extend(motion_at_ends(cleaned, prediction.median_sigma()));
    }
    Checked {
        jitter_s: prediction.jitter_s(),
        ..Checked::of(found)
    }
}

/// The samples of an output that are no readings.
fn no_readings(recorded: &Signals, step: f64, quantisation: Option<Quantisation>) -> NoReadings {
    let held = held(recorded, step);
    // A slow probe holds each of its values, so that the samples between them are no plateau.
    let every = held.map_or(1, |samples| samples.round().max(1.0) as usize);
    let values: Vec<f64> = recorded.output.iter().copied().step_by(every).collect();
    let runs = match held {
        Some(_) => Vec::new(),
        None => repeated(recorded, quantisation),
    };
    NoReadings {
        held,
        limits: limits(&values),
        runs,
    }
}

/// A defect that lasts for many samples.
fn lasting(recorded: &Signals, step: f64, quantisation: Option<Quantisation>) -> Option<Checked> {
    let rate_hz = recorded.rate_hz;
    let channel = Channel {
        rate_hz,
        step,
        has_step: quantisation.is_some(),
    };
    let samples = no_readings(recorded, step, quantisation);
    let defect = if let Some(every) = samples.held {
        Defect::Held {
            samples: every,
            probe_hz: rate_hz / every,
        }
    } else if let Some(limit) = samples.limits.first() {
        limit.defect(rate_hz)
    } else {
        samples.runs.first()?.defect(recorded, channel.has_step)
    };
    let lost = defect
        .loses_readings()
        .then(|| LostReadings::of(&recorded.output, channel, &samples));
    Some(Checked {
        defects: vec![defect],
        lost: lost.flatten(),
        jitter_s: None,
    })
}
