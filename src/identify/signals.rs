//! What an estimator is given: input and output of one run, tick by tick.

use core::ops::Range;

use super::IdentifyError;

/// Fewer samples than this have too few neighbouring bins to tell a response from noise.
const LEAST_SAMPLES: usize = 64;
/// Squares and sums of anything below this stay finite.
const LARGEST_SAMPLE: f64 = 1e100;
/// The input counts as quiet below this part of its peak.
const QUIET_RATIO: f64 = 1e-6;
/// A quiet stretch shorter than this says too little about where the output rests.
const LEAST_QUIET_S: f64 = 0.25;

/// Input and output of one run: one sample a tick, the same tick at the same index.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// Ticks per second.
    pub rate_hz: f64,
    /// Current in amperes, as the amplifier gave it.
    pub input_a: Vec<f64>,
    /// Displacement in metres.
    pub output_m: Vec<f64>,
}

impl Signals {
    /// Number of ticks.
    pub fn len(&self) -> usize {
        self.input_a.len()
    }

    /// Whether there is no tick at all.
    pub fn is_empty(&self) -> bool {
        self.input_a.is_empty()
    }

    /// Whether the signals are fit for any estimator.
    pub fn check(&self) -> Result<(), IdentifyError> {
        let (input, output) = (self.input_a.len(), self.output_m.len());
        if input != output {
            return Err(IdentifyError::Lengths { input, output });
        }
        if input < LEAST_SAMPLES {
            return Err(IdentifyError::TooShort {
                samples: input,
                least: LEAST_SAMPLES,
            });
        }
        if !(self.rate_hz.is_finite() && self.rate_hz > 0.0) {
            return Err(IdentifyError::Rate {
                rate_hz: self.rate_hz,
            });
        }
        check_samples("input_a", &self.input_a)?;
        check_samples("output_m", &self.output_m)?;
        self.check_motion()
    }

    fn check_motion(&self) -> Result<(), IdentifyError> {
        let samples = self.len();
        if let Some(value) = only_value(&self.input_a) {
            return Err(IdentifyError::InputStill { value, samples });
        }
        match only_value(&self.output_m) {
            Some(value) => Err(IdentifyError::OutputStill { value, samples }),
            None => Ok(()),
        }
    }

    /// The output less the straight line through where it rests before and after the excitation, in metres.
    ///
    /// An FFT takes the record for one turn of something periodic. A constant offset c of the probe then stays in bin
    /// 0, which no estimate uses. A drift does not: over the record it makes a step of d metres from the last sample to
    /// the first, that is d/(2 pi f) in metre seconds at every frequency, all along the band. The quiet before and the
    /// last half of the quiet after (when the stage has rung out) show d; without both, only the mean is taken off.
    pub(super) fn output_without_drift_m(&self) -> Vec<f64> {
        let (before, after) = self.quiet();
        let least = (LEAST_QUIET_S * self.rate_hz).max(8.0);
        let enough = before.len().min(after.len()) as f64 >= least;
        let (offset, slope) = if enough {
            line(
                centre(&self.output_m, before),
                centre(&self.output_m, after),
            )
        } else {
            (mean(&self.output_m), 0.0)
        };
        self.output_m
            .iter()
            .enumerate()
            .map(|(k, y)| y - offset - slope * k as f64)
            .collect()
    }

    /// The quiet stretch before the excitation and the last half of the one after it.
    fn quiet(&self) -> (Range<usize>, Range<usize>) {
        let peak = self
            .input_a
            .iter()
            .fold(0.0_f64, |peak, u| peak.max(u.abs()));
        let quiet = |u: &&f64| u.abs() <= QUIET_RATIO * peak;
        let before = self.input_a.iter().take_while(quiet).count();
        let after = self.input_a.iter().rev().take_while(quiet).count();
        (0..before, self.len() - after / 2..self.len())
    }
}

fn check_samples(column: &'static str, samples: &[f64]) -> Result<(), IdentifyError> {
    // A NaN compares as false, and so fails.
    let fit = |sample: &f64| sample.abs() <= LARGEST_SAMPLE;
    match samples.iter().position(|sample| !fit(sample)) {
        Some(index) => Err(IdentifyError::Sample {
            column,
            index,
            value: samples[index],
            limit: LARGEST_SAMPLE,
        }),
        None => Ok(()),
    }
}

/// The value of all samples, if they are all the same.
fn only_value(samples: &[f64]) -> Option<f64> {
    let first = *samples.first()?;
    samples.iter().all(|s| *s == first).then_some(first)
}

fn mean(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len() as f64
}

/// Middle index and mean of a stretch.
fn centre(samples: &[f64], range: Range<usize>) -> (f64, f64) {
    (
        (range.start + range.end - 1) as f64 / 2.0,
        mean(&samples[range]),
    )
}

/// Offset at index 0 and slope per sample of the line through two points.
fn line((k0, y0): (f64, f64), (k1, y1): (f64, f64)) -> (f64, f64) {
    let slope = (y1 - y0) / (k1 - k0);
    (y0 - slope * k0, slope)
}
