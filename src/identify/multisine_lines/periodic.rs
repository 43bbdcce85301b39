//! Averages over the periods of an excitation: no leakage, no smoothing; the noise is what differs between the periods.
//!
//! ```text
//! H = mean Y / mean U                      at each line k rate/period that is excited
//! E|error of H|^2 = sum over periods of |Y_p - H U_p|^2 / ((P - 1) P |mean U|^2)
//! ```
//!
//! so that noise on the measured input counts as well as that on the output (Pintelon, Schoukens, System Identification, 2nd
//! ed., section 2.5). What the plant repeats in every period, distortion included, is not noise here: a model that does not
//! describe it has a reduced chi-square above 1. With P periods, chi-square is (P - 1)/(P - 2) times too high.
//!
//! **Drift.** A free body drifts. A step of d from the end of a period to its beginning adds d/(2 pi f) times the rate to every
//! line. A straight line by least squares does not remove it: it also fits the excitation, and leaves a saw-tooth that repeats
//! in every period. The difference of samples one period apart does not contain the excitation: its mean around the start of a
//! period is d, and d n/N is subtracted. Therefore the last period only serves to measure the drift of the one before it.

use nalgebra::Complex;

use crate::identify::error::check_setting;
use crate::identify::fft::RealFft;
use crate::identify::{Frf, FrfDatum, FrfPoint, IdentifyError, Signals, band};

/// With fewer averaged periods the scatter is not known well enough.
const MIN_PERIODS: usize = 4;
/// Smallest number of samples in a period.
const MIN_PERIOD: usize = 8;
/// The drift is averaged over 1/DRIFT_PART of a period to either side of the start of the period.
const DRIFT_PART: usize = 100;
/// A line below this ratio of the largest amplitude in the band is not excited.
const EXCITED_RATIO: f64 = 0.01;
/// The amplitude of an excited line exceeds this multiple of its standard deviation.
const EXCITED_SIGMAS: f64 = 5.0;
/// Ratio of amplitudes of the weakest excited line and of the strongest distortion: 10 dB.
const DISTORTION_GAP: f64 = 3.0;
/// A pattern has at least this many lines.
const MIN_PATTERN: usize = 8;
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

/// The response by averages over periods.
#[derive(Clone, Debug, PartialEq)]
pub struct Periods {
    /// The response at the excited lines; the resolution is the distance of the lines.
    pub frf: Frf,
    /// The same for a fit, one datum per line.
    pub frf_data: Vec<FrfDatum>,
    /// Number of averaged periods.
    pub count: usize,
}

/// The response at the excited lines of `band_hz`.
///
/// # Errors
/// When the signals, the band or the periods allow no estimate: see [`IdentifyError`].
pub fn estimate(
    signals: &Signals,
    band_hz: (f64, f64),
    repetition: Repetition,
) -> Result<Periods, IdentifyError> {
    let lines = lines(signals, band_hz, repetition)?;
    let line_hz = signals.rate_hz / repetition.period as f64;
    let count = lines.first().map_or(0, |line| line.input.len());
    let mut periods = Periods {
        frf: Frf::default(),
        frf_data: Vec::new(),
        count,
    };
    for line in excited(&lines) {
        periods.push(line, line_hz);
    }
    if periods.frf_data.is_empty() {
        Err(IdentifyError::not_excited(band_hz))
    } else {
        Ok(periods)
    }
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
    let input = spectra(&signals.input_a, repetition, count);
    let output = spectra(&signals.output_m, repetition, count);
    Ok(bins.map(|k| Line::new(k, &input, &output)).collect())
}

impl Periods {
    fn push(&mut self, line: &Line, line_hz: f64) {
        let (frequency_hz, response) = (line.number as f64 * line_hz, line.response());
        let variance = line
            .variance()
            .max(ROUNDING * ROUNDING * response.norm_sqr());
        let coherence = line.coherence();
        let point = FrfPoint {
            frequency_hz,
            response,
            coherence,
            variance,
            resolution_hz: line_hz,
        };
        if self.frf.push(point) && variance > 0.0 {
            self.frf_data.push(FrfDatum {
                frequency_hz,
                spread_hz: 0.0,
                response,
                variance,
            });
        }
    }
}

/// Number of periods that are averaged: those after the first `skip`, without the last whole one, which measures the drift.
fn averaged_periods(
    samples: usize,
    Repetition { period, skip }: Repetition,
) -> Result<usize, IdentifyError> {
    check_setting("period", period as f64, MIN_PERIOD as f64, samples as f64)?;
    let periods = samples / period;
    let count = periods.saturating_sub(skip).saturating_sub(1);
    if count >= MIN_PERIODS {
        return Ok(count);
    }
    Err(IdentifyError::Periods(format!(
        "too few periods remain after omitting {skip} of {periods} whole ones, at least {} are needed (the last is used for the drift only); record more periods, omit fewer, or check the length of the period",
        MIN_PERIODS + 1
    )))
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

fn without_drift(samples: &[f64], start: usize, period: usize) -> Vec<f64> {
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

    fn response(&self) -> Complex<f64> {
        mean(&self.output) / mean(&self.input)
    }

    /// E|error of H|^2.
    fn variance(&self) -> f64 {
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
    fn coherence(&self) -> f64 {
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

/// The lines whose input exceeds its own noise, [`EXCITED_RATIO`] of the largest, and the distortion between the excited lines.
pub(super) fn excited(lines: &[Line]) -> impl Iterator<Item = &Line> {
    let amplitude = |line: &Line| mean(&line.input).norm();
    let largest = lines.iter().map(amplitude).fold(0.0, f64::max);
    let significant: Vec<&Line> = lines
        .iter()
        .filter(|line| {
            let sigma = variance_of_mean(&line.input).sqrt();
            let amplitude = amplitude(line);
            amplitude > 0.0
                && amplitude >= EXCITED_RATIO * largest
                && amplitude > EXCITED_SIGMAS * sigma
        })
        .collect();
    let limit = distortion_limit(&significant);
    significant
        .into_iter()
        .filter(move |line| amplitude(line) > limit)
}

/// The largest amplitude that is distortion of a measured input; 0 without any.
///
/// Sorted by amplitude, the excited lines precede the others by [`DISTORTION_GAP`]. They have a pattern, such as only odd lines, that
/// the others do not have.
fn distortion_limit(lines: &[&Line]) -> f64 {
    let mut sorted: Vec<(f64, usize)> = lines
        .iter()
        .map(|line| (mean(&line.input).norm(), line.number))
        .collect();
    sorted.sort_by(|a, b| b.0.total_cmp(&a.0));
    let gap = |k: &usize| sorted[k - 1].0 / sorted[*k].0;
    let widest = (MIN_PATTERN..sorted.len()).max_by(|a, b| gap(a).total_cmp(&gap(b)));
    let Some(first) = widest.filter(|k| gap(k) >= DISTORTION_GAP) else {
        return 0.0;
    };
    let (excited, others) = sorted.split_at(first);
    let origin = excited[0].1;
    let distance = |line: &(f64, usize)| line.1.abs_diff(origin);
    let step = excited
        .iter()
        .map(distance)
        .fold(0, greatest_common_divisor);
    let outside = others
        .iter()
        .filter(|line| distance(line) % step.max(1) != 0);
    if step > 1 && 4 * outside.count() >= others.len() {
        others[0].0
    } else {
        0.0
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}
