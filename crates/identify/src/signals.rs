//! Input and output of one run: the data of every estimator.

use core::ops::Range;

use super::error::{IdentifyError, Signal, SignalsError};
use super::mean::mean;

/// A shorter record has too few neighbouring bins to separate a response from noise.
const MIN_SAMPLES: usize = 64;
/// Squares and sums of samples up to this magnitude stay finite.
const MAX_SAMPLE: f64 = 1e100;
/// The input counts as zero while it stays below this ratio of its peak.
const QUIET_RATIO: f64 = 1e-6;
/// A shorter interval of zero input does not determine the rest position accurately enough.
const MIN_QUIET_S: f64 = 0.25;

/// Input and output of one run: one sample per tick, the same tick at the same index.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// Ticks per second.
    pub rate_hz: f64,
    /// Input in the unit of the record; for a run of the bench the current in amperes, as applied by the amplifier.
    pub input: Vec<f64>,
    /// Output in the unit of the record; for a run of the bench the displacement in metres.
    pub output: Vec<f64>,
}

impl Signals {
    /// Number of ticks.
    pub fn len(&self) -> usize {
        self.input.len()
    }

    /// Whether there are no ticks.
    pub fn is_empty(&self) -> bool {
        self.input.is_empty()
    }

    /// The samples of both signals in a range of ticks.
    ///
    /// # Panics
    /// When the range reaches beyond the end of a signal.
    pub fn slice(&self, ticks: Range<usize>) -> Signals {
        Signals {
            rate_hz: self.rate_hz,
            input: self.input[ticks.clone()].to_vec(),
            output: self.output[ticks].to_vec(),
        }
    }

    /// Checks that any estimator can process the signals.
    ///
    /// # Errors
    /// When the signals differ in length, are too short, hold samples that are not finite, or do not change.
    pub fn check(&self) -> Result<(), IdentifyError> {
        check_lengths(self.input.len(), self.output.len())?;
        check_min_samples(self.len(), MIN_SAMPLES)?;
        if !(self.rate_hz.is_finite() && self.rate_hz > 0.0) {
            return Err(SignalsError::Rate {
                rate_hz: self.rate_hz,
            }
            .into());
        }
        check_samples(Signal::Input, &self.input)?;
        check_samples(Signal::Output, &self.output)?;
        Ok(self.check_motion()?)
    }

    fn check_motion(&self) -> Result<(), SignalsError> {
        let samples = self.len();
        if let Some(value) = constant_value(&self.input) {
            return Err(SignalsError::ConstantInput { value, samples });
        }
        if let Some(value) = constant_value(&self.output) {
            return Err(SignalsError::ConstantOutput { value, samples });
        }
        Ok(())
    }

    /// The output minus the straight line through its rest positions before and after the excitation, in the unit of the
    /// output.
    ///
    /// An FFT treats the record as one period of a periodic signal. A constant offset of the probe stays in bin 0,
    /// which no estimate uses. A drift by d over the record is a step from the last sample to the first; it
    /// adds d/(2 pi f) at every frequency. d follows from the interval of zero input before the
    /// excitation and from the second half of the one after it (when the stage has rung out). Without both intervals
    /// only the mean is subtracted.
    pub(super) fn output_without_drift(&self) -> Vec<f64> {
        let (offset, slope) = self.drift();
        let output = self.output.iter().enumerate();
        output.map(|(k, y)| y - offset - slope * k as f64).collect()
    }

    /// Offset and slope per sample of the drift, in the unit of the output.
    fn drift(&self) -> (f64, f64) {
        let (before, after) = self.quiet_intervals();
        let min_samples = (MIN_QUIET_S * self.rate_hz).max(8.0);
        if before.len().min(after.len()) as f64 >= min_samples {
            let (start, end) = (centre(&self.output, before), centre(&self.output, after));
            line_through(start, end)
        } else {
            (mean(&self.output), 0.0)
        }
    }

    /// The interval of zero input before the excitation and the second half of the one after it.
    fn quiet_intervals(&self) -> (Range<usize>, Range<usize>) {
        let peak = self.input.iter().fold(0.0_f64, |peak, u| peak.max(u.abs()));
        let quiet = |u: &&f64| u.abs() <= QUIET_RATIO * peak;
        let before = self.input.iter().take_while(quiet).count();
        let after = self.input.iter().rev().take_while(quiet).count();
        (0..before, self.len() - after / 2..self.len())
    }
}

/// Checks that input and output have the same number of samples.
fn check_lengths(input: usize, output: usize) -> Result<(), SignalsError> {
    if input == output {
        Ok(())
    } else {
        Err(SignalsError::Lengths { input, output })
    }
}

/// Checks that there are enough samples.
pub(super) fn check_min_samples(samples: usize, min: usize) -> Result<(), SignalsError> {
    if samples >= min {
        Ok(())
    } else {
        Err(SignalsError::TooShort { samples, min })
    }
}

fn check_samples(signal: Signal, samples: &[f64]) -> Result<(), SignalsError> {
    let Some(index) = samples.iter().position(|sample| !is_valid(*sample)) else {
        return Ok(());
    };
    Err(SignalsError::Sample {
        signal,
        index,
        value: samples[index],
        max: MAX_SAMPLE,
    })
}

/// Whether a sample is within the limit; NaN is not, as a comparison with it is false.
fn is_valid(sample: f64) -> bool {
    sample.abs() <= MAX_SAMPLE
}

/// The value of all samples, if they are all equal.
fn constant_value(samples: &[f64]) -> Option<f64> {
    let first = *samples.first()?;
    samples.iter().all(|s| *s == first).then_some(first)
}

/// Middle index and mean of a range of samples.
fn centre(samples: &[f64], range: Range<usize>) -> (f64, f64) {
    (
        (range.start + range.end - 1) as f64 / 2.0,
        mean(&samples[range]),
    )
}

/// Offset at index 0 and slope per sample of the line through two points.
fn line_through((k0, y0): (f64, f64), (k1, y1): (f64, f64)) -> (f64, f64) {
    let slope = (y1 - y0) / (k1 - k0);
    (y0 - slope * k0, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn valid() -> Signals {
        let input: Vec<f64> = (0..100).map(|k| f64::from(k % 7)).collect();
        Signals {
            rate_hz: 1000.0,
            output: input.clone(),
            input,
        }
    }

    #[test]
    fn error_of_a_sample_holds_signal_index_and_value() {
        let mut signals = valid();
        signals.output[37] = f64::INFINITY;
        let error = IdentifyError::from(SignalsError::Sample {
            signal: Signal::Output,
            index: 37,
            value: f64::INFINITY,
            max: 1e100,
        });
        assert_eq!(signals.check(), Err(error));
    }

    #[test]
    fn error_of_lengths_holds_both() {
        let mut signals = valid();
        signals.output.truncate(99);
        let (input, output) = (100, 99);
        let error = SignalsError::Lengths { input, output };
        assert_eq!(signals.check(), Err(error.into()));
    }

    #[test]
    fn error_of_the_rate_holds_the_rate() {
        let signals = Signals {
            rate_hz: -1.0,
            ..valid()
        };
        let error = SignalsError::Rate { rate_hz: -1.0 };
        assert_eq!(signals.check(), Err(error.into()));
    }

    #[test]
    fn error_of_a_constant_signal_holds_value_and_number() {
        let mut signals = valid();
        signals.input.fill(0.5);
        let error = SignalsError::ConstantInput {
            value: 0.5,
            samples: 100,
        };
        assert_eq!(signals.check(), Err(error.into()));
    }
}
