//! Defects of a record that an estimator would take for signal: spikes, steps, repeated and clipped samples, motion at its ends.
//!
//! A defect is alike from one frequency to the next, so that modes are fitted to it. It is found in the time domain.

mod correction;
mod defect;
mod ends;
mod held;
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
use plateaus::{Quantisation, clipped, repeated};
use prediction::Prediction;
pub use resolution::Resolution;
pub use stray_lines::{StrayLine, stray_lines, without};

/// An output whose step is below this ratio of its noise has as few equal neighbours as one without a step.
const MIN_STEP_RATIO: f64 = 0.1;

/// The first defect of each kind. `cleaned` is the record without its stray lines; its values are no multiples of a step any more.
/// Motion is a defect of a record that must begin and end at rest.
pub fn defects(recorded: &Signals, cleaned: &Signals, ends: Ends) -> Vec<Defect> {
    let step = resolution::step(&recorded.output).unwrap_or(0.0);
    let prediction = Prediction::new(cleaned, step);
    let noise = prediction.as_ref().map_or(0.0, Prediction::noise);
    let quantisation = (step > MIN_STEP_RATIO * noise).then_some(Quantisation { step, noise });
    let lasting = held(recorded, step)
        .or_else(|| clipped(recorded))
        .or_else(|| repeated(recorded, quantisation));
    if lasting.is_some() || ends == Ends::Periods {
        return lasting.into_iter().collect();
    }
    let Some(prediction) = prediction else {
        return Vec::new();
    };
    let mut found = prediction.jumps();
    if ends == Ends::Rest {
        found.extend(motion_at_ends(cleaned, prediction.median_sigma()));
    }
    found
}
