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

    /// Checks that the reference of a loop belongs to the signals and changes.
    ///
    /// # Errors
    /// When it differs from the signals in length, has samples that are not finite, or does not change.
    pub fn check_reference(&self, reference: &[f64]) -> Result<(), IdentifyError> {
        self.check_reference_length(reference)?;
        check_samples(Signal::Reference, reference)?;
        let samples = reference.len();
        match constant_value(reference) {
            Some(value) => Err(SignalsError::ConstantReference { value, samples }.into()),
            None => Ok(()),
        }
    }

    /// Checks that a reference has as many samples as the signals.
    pub(super) fn check_reference_length(&self, reference: &[f64]) -> Result<(), SignalsError> {
        let (reference, signals) = (reference.len(), self.len());
        if reference == signals {
            Ok(())
        } else {
            Err(SignalsError::ReferenceLength { reference, signals })
        }
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

    /// Reference, input and output without the steps from the end of the record to its beginning.
    ///
    /// An FFT treats the record as one period of a periodic signal. A set-point that ends elsewhere than it began makes a step of d in each
    /// signal, which adds d/(2 pi f) at every frequency. With x k/n of the step x of each signal subtracted, where n is the number of
    /// samples k, they have the spectra of their changes from sample to sample, divided by 1 - exp(-2 pi j f T): the ratios of these are
    /// those of a record from rest to rest. The steps follow from the interval before the first change of the reference, and from the second
    /// half of the one after the last. Without both intervals the signals are returned as they are.
    pub(super) fn without_steps(&self, reference: &[f64]) -> [Vec<f64>; 3] {
        let (before, after) = rest_intervals(reference);
        let min_samples = (MIN_QUIET_S * self.rate_hz).max(8.0);
        let signals = [reference, &self.input, &self.output];
        if (before.len().min(after.len()) as f64) < min_samples {
            return signals.map(<[f64]>::to_vec);
        }
        signals.map(|samples| without_step(samples, before.clone(), after.clone()))
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

/// The interval before the first change of a signal, and the second half of the one after the last.
fn rest_intervals(samples: &[f64]) -> (Range<usize>, Range<usize>) {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return (0..0, 0..0);
    };
    let low = samples.iter().copied().fold(f64::INFINITY, f64::min);
    let high = samples.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let is_near = |x: f64, rest: f64| (x - rest).abs() <= QUIET_RATIO * (high - low);
    let before = samples.iter().take_while(|x| is_near(**x, *first)).count();
    let after = samples
        .iter()
        .rev()
        .take_while(|x| is_near(**x, *last))
        .count();
    (0..before, samples.len() - after / 2..samples.len())
}

/// A signal minus the straight line over the whole record that rises by the step between two intervals.
fn without_step(samples: &[f64], before: Range<usize>, after: Range<usize>) -> Vec<f64> {
    let step = mean(&samples[after]) - mean(&samples[before]);
    let slope = step / samples.len() as f64;
    let samples = samples.iter().enumerate();
    samples.map(|(k, x)| x - slope * k as f64).collect()
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
    fn errors_of_a_reference_hold_its_length_its_sample_and_its_value() {
        let signals = valid();
        let mut reference = signals.input.clone();
        reference[41] = f64::NAN;
        let error = signals.check_reference(&reference).expect_err("a NaN");
        assert!(
            error
                .to_string()
                .contains("the reference is NaN at sample 41")
        );
        let error = signals.check_reference(&reference[1..]);
        let (reference, samples) = (99, 100);
        let lengths = SignalsError::ReferenceLength {
            reference,
            signals: samples,
        };
        assert_eq!(error, Err(lengths.into()));
        let value = 0.5;
        let constant = SignalsError::ConstantReference { value, samples };
        assert_eq!(signals.check_reference(&[value; 100]), Err(constant.into()));
    }

    #[test]
    fn ratio_of_a_step_is_that_of_its_changes() {
        // The reference goes from 1 to 3 in 100 samples; y[k] = 0.9 y[k-1] + 0.1 r[k] follows with a gain of 1, u = 2 r + 1.
        let n = 2000;
        let level = |k: usize| ((k.clamp(500, 600) - 500) as f64 / 100.0) * 2.0 + 1.0;
        let reference: Vec<f64> = (0..n).map(level).collect();
        let mut y = 1.0;
        let mut output = Vec::new();
        for r in &reference {
            y = 0.9 * y + 0.1 * r;
            output.push(y);
        }
        let input = reference.iter().map(|r| 2.0 * r + 1.0).collect();
        let signals = Signals {
            rate_hz: 1000.0,
            input,
            output,
        };
        let fft = crate::fft::RealFft::new(n);
        let spectra = signals.without_steps(&reference);
        let [r, u, y] = spectra.map(|samples| fft.below_nyquist(samples));
        // The spectrum of the ramp is zero at bin 20.
        for k in 1..15 {
            let back = nalgebra::Complex::cis(-std::f64::consts::TAU * k as f64 / n as f64);
            let filter = (-back * 0.9 + 1.0).inv() * 0.1;
            // Spectra of some 100 samples of 1 against the rounding of 2000 samples of 1.
            assert!((u[k] / r[k] - 2.0).norm() < 1e-9, "{k}");
            assert!((y[k] / r[k] / filter - 1.0).norm() < 1e-9, "{k}");
        }
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
