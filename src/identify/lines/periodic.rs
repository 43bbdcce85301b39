//! Periods of one excitation, averaged: no leakage and no smoothing, and the noise is what differs from period to period.
//!
//! ```text
//! H = mean Y / mean U                      at each line k rate/period that was excited
//! E|error of H|^2 = sum over periods of |Y_p - H U_p|^2 / ((P - 1) P |mean U|^2)
//! ```
//!
//! so that noise on the measured input counts as well as that on the output (Pintelon, Schoukens, System Identification, 2nd
//! ed., section 2.5). What the plant does alike in every period, distortion included, is no noise here: a model that
//! misses it is left with a chi^2 above 1. From P periods, chi^2 comes out (P - 1)/(P - 2) times too high.
//!
//! **Drift.** A free body wanders, and a step of d from the end of a period to its begin stands in every line as d/(2 pi f)
//! times the rate. The straight line of least squares does not take it off: it fits the excitation too, and leaves a
//! saw-tooth that is alike in every period. The difference of samples one period apart has no excitation in it: its mean
//! around the period's begin is d, and d n/N is taken off. So the last period serves to show the drift of the one before it.

use nalgebra::Complex;

use crate::identify::spectrum::RealFft;
use crate::identify::{Frf, FrfDatum, FrfPoint, IdentifyError, Signals, band};

/// Periods that are averaged at least: with fewer the scatter says too little of itself.
const LEAST_PERIODS: usize = 4;
/// Samples of a period at least.
const LEAST_PERIOD: usize = 8;
/// The drift over a period is a mean over this part of it to either side of its begin.
const DRIFT_PART: usize = 100;
/// A line below this part of the greatest amplitude in the band is not an excited one.
const EXCITED_RATIO: f64 = 0.01;
/// So many sigma of its own scatter the amplitude of an excited line is above zero.
const EXCITED_SIGMA: f64 = 5.0;
/// Rounding leaves no response truer than this ratio: 10^4 sums of doubles.
pub(super) const ROUNDING: f64 = 1e-12;

/// How a record repeats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Repetition {
    /// Samples a period.
    pub period: usize,
    /// Periods at the beginning that are left out: those in which the plant still settles.
    pub skip: usize,
}

/// What periods show.
#[derive(Clone, Debug, PartialEq)]
pub struct Periods {
    /// The response at the excited lines, each as narrow as the period allows.
    pub frf: Frf,
    /// The same for a fit: one line a block.
    pub frf_data: Vec<FrfDatum>,
    /// Periods that were averaged.
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
        periods.take(line, line_hz);
    }
    let (low_hz, high_hz) = band_hz;
    if periods.frf_data.is_empty() {
        Err(IdentifyError::NotExcited { low_hz, high_hz })
    } else {
        Ok(periods)
    }
}

/// Every line of a band, one entry a period.
pub(super) fn lines(
    signals: &Signals,
    band_hz: (f64, f64),
    repetition: Repetition,
) -> Result<Vec<Line>, IdentifyError> {
    signals.check()?;
    let count = count(signals.len(), repetition)?;
    let bins = band::bins(band_hz, signals.rate_hz, repetition.period)?;
    let input = spectra(&signals.input_a, repetition, count);
    let output = spectra(&signals.output_m, repetition, count);
    Ok(bins.map(|k| Line::of(k, &input, &output)).collect())
}

impl Periods {
    fn take(&mut self, line: &Line, line_hz: f64) {
        let (frequency_hz, response) = (line.number as f64 * line_hz, line.response());
        let variance = line
            .variance()
            .max(ROUNDING * ROUNDING * response.norm_sqr());
        let point = FrfPoint {
            frequency_hz,
            response,
            coherence: line.coherence(),
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

/// Periods that are averaged: those after the first `skip`, less the last whole one, which shows the drift.
fn count(samples: usize, Repetition { period, skip }: Repetition) -> Result<usize, IdentifyError> {
    if period < LEAST_PERIOD || period > samples {
        let (value, least, most) = (period as f64, LEAST_PERIOD as f64, samples as f64);
        return Err(IdentifyError::Setting {
            name: "period",
            value,
            least,
            most,
        });
    }
    let count = (samples / period).saturating_sub(skip).saturating_sub(1);
    if count < LEAST_PERIODS {
        let periods = samples / period;
        return Err(IdentifyError::Periods {
            periods,
            skip,
            least: LEAST_PERIODS + 1,
        });
    }
    Ok(count)
}

/// The spectra of the periods, drift taken off.
fn spectra(
    samples: &[f64],
    Repetition { period, skip }: Repetition,
    count: usize,
) -> Vec<Vec<Complex<f64>>> {
    let fft = RealFft::new(period);
    let of = |p: usize| {
        let start = (skip + p) * period;
        let slope = drift(samples, start, period) / period as f64;
        let straight = |(n, x): (usize, &f64)| x - slope * n as f64;
        let mut straight: Vec<f64> = samples[start..start + period]
            .iter()
            .enumerate()
            .map(straight)
            .collect();
        fft.transform(&mut straight)
    };
    (0..count).map(of).collect()
}

/// By how much a signal drifts over the period from `start` on: the mean of `x[n + period] - x[n]` for n around `start`, as far to
/// both sides as there are samples.
fn drift(samples: &[f64], start: usize, period: usize) -> f64 {
    let reach = (period / DRIFT_PART)
        .min(start)
        .min(samples.len().saturating_sub(start + period + 1));
    let around = start - reach..=start + reach;
    let size = around.clone().count() as f64;
    around
        .map(|n| samples[n + period] - samples[n])
        .sum::<f64>()
        / size
}

/// One line of the spectrum over all periods.
pub(super) struct Line {
    /// Turns in a period.
    pub(super) number: usize,
    pub(super) input: Vec<Complex<f64>>,
    pub(super) output: Vec<Complex<f64>>,
}

impl Line {
    fn of(number: usize, input: &[Vec<Complex<f64>>], output: &[Vec<Complex<f64>>]) -> Line {
        let line = |spectra: &[Vec<Complex<f64>>]| {
            spectra.iter().map(|spectrum| spectrum[number]).collect()
        };
        Line {
            number,
            input: line(input),
            output: line(output),
        }
    }

    fn response(&self) -> Complex<f64> {
        mean(&self.output) / mean(&self.input)
    }

    /// E|error of H|^2.
    fn variance(&self) -> f64 {
        let response = self.response();
        let left: Vec<_> = self
            .output
            .iter()
            .zip(&self.input)
            .map(|(y, u)| y - response * u)
            .collect();
        variance_of_mean(&left) / mean(&self.input).norm_sqr()
    }

    /// |sum Y conj(U)|^2 / (sum |U|^2 sum |Y|^2) over the periods.
    fn coherence(&self) -> f64 {
        let power = |line: &[Complex<f64>]| line.iter().map(|x| x.norm_sqr()).sum::<f64>();
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

pub(super) fn mean(values: &[Complex<f64>]) -> Complex<f64> {
    values.iter().sum::<Complex<f64>>() / values.len() as f64
}

/// E|error of the mean|^2, by the scatter of the values.
pub(super) fn variance_of_mean(values: &[Complex<f64>]) -> f64 {
    let (count, mean) = (values.len() as f64, mean(values));
    values.iter().map(|x| (x - mean).norm_sqr()).sum::<f64>() / ((count - 1.0) * count)
}

/// The lines whose input is above its own noise, and not of another order than the largest.
pub(super) fn excited(lines: &[Line]) -> impl Iterator<Item = &Line> {
    let largest = lines
        .iter()
        .map(|line| mean(&line.input).norm())
        .fold(0.0, f64::max);
    lines.iter().filter(move |line| {
        let amplitude = mean(&line.input).norm();
        let sigma = variance_of_mean(&line.input).sqrt();
        amplitude > 0.0 && amplitude >= EXCITED_RATIO * largest && amplitude > EXCITED_SIGMA * sigma
    })
}
