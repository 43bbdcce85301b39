//! The lines of the spectrum of a periodic record, with one value per period.
//!
//! **Drift.** A free body drifts. A step of d from the end of a period to its beginning adds d/(2 pi f) times the rate to every
//! line. A straight line by least squares does not remove it: it also fits the excitation, and leaves a saw-tooth that repeats
//! in every period. The difference of samples one period apart does not contain the excitation: its mean around the start of a
//! period is d, and d n/N is subtracted. Therefore the last period only serves to measure the drift of the one before it.

use nalgebra::Complex;

use crate::error::check_setting;
use crate::fft::RealFft;
use crate::{IdentifyError, Signals, band};

/// With fewer averaged periods the scatter is not known well enough.
pub(super) const MIN_PERIODS: usize = 4;
/// Smallest number of samples in a period.
const MIN_PERIOD: usize = 8;
/// The drift is averaged over 1/DRIFT_PART of a period to either side of the start of the period.
const DRIFT_PART: usize = 100;
/// Relative error of a response by rounding: 10^4 sums of doubles.
pub(super) const ROUNDING: f64 = 1e-12;

/// How a record repeats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Repetition {
    /// Samples in a period.
    pub period: usize,
    /// Periods at the beginning of the record to omit, in which the plant settles.
    pub skip: usize,
}

/// Every line of a band, with one value per period.
pub(super) fn lines(
    signals: &Signals,
    band_hz: (f64, f64),
    repetition: Repetition,
) -> Result<Vec<Line>, IdentifyError> {
    signals.check()?;
    let count = averaged_periods(signals.len(), repetition)?;
    let bins = band::bins(band_hz, signals.rate_hz, repetition.period)?;
    let input = spectra(&signals.input, repetition, count);
    let output = spectra(&signals.output, repetition, count);
    Ok(bins.map(|k| Line::new(k, &input, &output)).collect())
}

/// Number of periods that are averaged: those after the first `skip`, without the last whole one, which measures the drift.
pub(super) fn averaged_periods(
    samples: usize,
    Repetition { period, skip }: Repetition,
) -> Result<usize, IdentifyError> {
    check_setting("period", period as f64, MIN_PERIOD as f64, samples as f64)?;
    let periods = samples / period;
    let count = periods.saturating_sub(skip).saturating_sub(1);
    if count >= MIN_PERIODS {
        return Ok(count);
    }
    Err(IdentifyError::Periods {
        skipped: skip,
        periods,
        min: MIN_PERIODS + 1,
    })
}

/// The spectra of the averaged periods, without drift.
fn spectra(
    samples: &[f64],
    Repetition { period, skip }: Repetition,
    count: usize,
) -> Vec<Vec<Complex<f64>>> {
    let fft = RealFft::new(period);
    let starts = (0..count).map(|p| (skip + p) * period);
    starts
        .map(|start| fft.transform(&mut without_drift(samples, start, period)))
        .collect()
}

pub(super) fn without_drift(samples: &[f64], start: usize, period: usize) -> Vec<f64> {
    let slope = drift(samples, start, period) / period as f64;
    let samples = samples[start..start + period].iter().enumerate();
    samples.map(|(n, x)| x - slope * n as f64).collect()
}

/// The drift of a signal over the period from `start` on: the mean of `x[n + period] - x[n]` for n around `start`, as far to
/// both sides as there are samples.
fn drift(samples: &[f64], start: usize, period: usize) -> f64 {
    let available = samples.len().saturating_sub(start + period + 1);
    let reach = (period / DRIFT_PART).min(start).min(available);
    let around = start - reach..=start + reach;
    let size = around.clone().count() as f64;
    around
        .map(|n| samples[n + period] - samples[n])
        .sum::<f64>()
        / size
}

/// One line of the spectrum, with one value per period.
#[derive(Clone)]
pub(super) struct Line {
    /// Cycles in a period.
    pub(super) number: usize,
    pub(super) input: Vec<Complex<f64>>,
    pub(super) output: Vec<Complex<f64>>,
}

impl Line {
    fn new(number: usize, input: &[Vec<Complex<f64>>], output: &[Vec<Complex<f64>>]) -> Line {
        Line {
            number,
            input: input.iter().map(|spectrum| spectrum[number]).collect(),
            output: output.iter().map(|spectrum| spectrum[number]).collect(),
        }
    }

    pub(super) fn response(&self) -> Complex<f64> {
        mean(&self.output) / mean(&self.input)
    }

    /// The line without the linear response to its input.
    pub(super) fn without_linear_part(&self, response: Complex<f64>) -> Line {
        let pairs = self.output.iter().zip(&self.input);
        Line {
            number: self.number,
            input: self.input.clone(),
            output: pairs.map(|(y, u)| y - response * u).collect(),
        }
    }

    /// E|error of H|^2.
    pub(super) fn variance(&self) -> f64 {
        let response = self.response();
        let residuals: Vec<_> = self
            .output
            .iter()
            .zip(&self.input)
            .map(|(y, u)| y - response * u)
            .collect();
        variance_of_mean(&residuals) / mean(&self.input).norm_sqr()
    }

    /// |sum Y conj(U)|^2 / (sum |U|^2 sum |Y|^2) over the periods.
    pub(super) fn coherence(&self) -> f64 {
        let cross: Complex<f64> = self
            .output
            .iter()
            .zip(&self.input)
            .map(|(y, u)| y * u.conj())
            .sum();
        let output = power(&self.output);
        if output > 0.0 {
            (cross.norm() / power(&self.input)) * (cross.norm() / output)
        } else {
            0.0
        }
    }
}

/// The sum of the squared magnitudes.
fn power(values: &[Complex<f64>]) -> f64 {
    values.iter().map(|x| x.norm_sqr()).sum()
}

pub(super) fn mean(values: &[Complex<f64>]) -> Complex<f64> {
    values.iter().sum::<Complex<f64>>() / values.len() as f64
}

/// E|error of the mean|^2, from the scatter of the values.
pub(super) fn variance_of_mean(values: &[Complex<f64>]) -> f64 {
    let (count, mean) = (values.len() as f64, mean(values));
    values.iter().map(|x| (x - mean).norm_sqr()).sum::<f64>() / ((count - 1.0) * count)
}
