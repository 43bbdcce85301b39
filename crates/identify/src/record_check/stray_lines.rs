//! Sinusoids in the output that do not come from the input, as from the mains.
//!
//! ```text
//! y_n = Re(c exp(j w n)) + ...          c, w: constant over the whole record
//! ```
//!
//! A mode that a sweep excites has this amplitude in a part of the record only. A line of the input has one in the output, too.

use std::borrow::Cow;
use std::f64::consts::{PI, TAU};
use std::fmt;

use nalgebra::Complex;

use crate::Signals;
use crate::fft::RealFft;

/// The record is divided into this number of parts ...
const PARTS: usize = 8;
/// ... and the amplitude is the same in at least this number: a sweep passes the frequency in one or two.
const STEADY_PARTS: usize = 6;
/// The line is determined from those of least deviation: beside its frequency a sweep changes the amplitude a little.
const BEST_PARTS: usize = 4;
/// Amplitudes are the same if they differ by less than this ratio.
const STEADY_RATIO: f64 = 0.3;
/// A line exceeds the median power of the frequencies around by this factor. Noise does so with the probability 2^-60.
const LINE_POWER: f64 = 60.0;
/// A bin of the input that exceeds the median by this factor explains a line of the output. It is lower than that of the output,
/// because a sweep can raise the frequencies around. Noise exceeds it with the probability 2^-10.
const INPUT_LINE_POWER: f64 = 10.0;
/// Nearest and farthest of the frequencies around a line, in bins. The window widens a line to three bins.
const AROUND: (usize, usize) = (4, 20);
/// Smallest number of periods in a part of the record.
const MIN_PERIODS: usize = 4;
/// Largest number of lines.
const MAX_LINES: usize = 8;
/// Corrections of the frequency of a line.
const CORRECTIONS: usize = 3;

/// A sinusoid in the whole output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrayLine {
    /// Frequency in hertz.
    pub frequency_hz: f64,
    /// c, in units of the output.
    pub amplitude: Complex<f64>,
}

impl fmt::Display for StrayLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the output has a sinusoid of {:.3e} at {:.3} Hz from beginning to end that the excitation does not have; it was subtracted; remove its source, such as the mains",
            self.amplitude.norm(),
            self.frequency_hz
        )
    }
}

/// The lines of the output, the strongest first, then those that only its rest behind the excitation shows: among the frequencies of a
/// mode that a sweep excites, a line is no peak of the whole record.
pub fn stray_lines(signals: &Signals) -> Vec<StrayLine> {
    let (output, input) = (power(&signals.output), power(&signals.input));
    let first = (MIN_PERIODS * PARTS).max(AROUND.1);
    let bins = peaks(&output, first);
    let bins = bins.filter(|bin| !is_line(&input, *bin, INPUT_LINE_POWER));
    let mut bins: Vec<usize> = bins.collect();
    bins.sort_by(|a, b| output[*b].total_cmp(&output[*a]));
    let of_bins = bins.into_iter().map(|bin| bin as f64);
    let mut lines: Vec<StrayLine> = Vec::new();
    for bin in of_bins.chain(peaks_at_rest(signals)) {
        let line = steady_line(signals, bin).filter(|line| !is_known(&lines, line, signals));
        lines.extend(line);
        if lines.len() == MAX_LINES {
            break;
        }
    }
    lines
}

/// The bins from a first one on with far more power than those around.
fn peaks(power: &[f64], first: usize) -> impl Iterator<Item = usize> {
    let end = power.len().saturating_sub(AROUND.1);
    (first..end).filter(|bin| is_line(power, *bin, LINE_POWER))
}

/// The peaks of the output where the input rests at the end of the record, in bins of the whole record.
fn peaks_at_rest(signals: &Signals) -> Vec<f64> {
    let (input, output) = (&signals.input, &signals.output);
    let Some(last) = input.last() else {
        return Vec::new();
    };
    let active = input.iter().rposition(|u| u != last);
    let rest = &output[active.map_or(0, |k| k + 1)..];
    if rest.len() < output.len() / PARTS {
        return Vec::new();
    }
    let bin = output.len() as f64 / rest.len() as f64;
    let first = MIN_PERIODS.max(AROUND.1);
    let peaks: Vec<usize> = peaks(&power(rest), first).collect();
    peaks.into_iter().map(|k| k as f64 * bin).collect()
}

/// Whether a line is one of those that are found: they are farther apart than a bin.
fn is_known(found: &[StrayLine], line: &StrayLine, signals: &Signals) -> bool {
    let bin_hz = signals.rate_hz / signals.len() as f64;
    let mut found = found.iter();
    found.any(|other| (other.frequency_hz - line.frequency_hz).abs() < bin_hz)
}

/// The signals with an output without the lines.
pub fn without<'a>(signals: &'a Signals, lines: &[StrayLine]) -> Cow<'a, Signals> {
    if lines.is_empty() {
        return Cow::Borrowed(signals);
    }
    let mut cleaned = signals.clone();
    for line in lines {
        let omega = TAU * line.frequency_hz / signals.rate_hz;
        for (n, y) in cleaned.output.iter_mut().enumerate() {
            *y -= (line.amplitude * Complex::cis(omega * n as f64)).re;
        }
    }
    Cow::Owned(cleaned)
}

/// The power of a signal with a Hann window in each bin.
fn power(samples: &[f64]) -> Vec<f64> {
    let mut windowed = windowed(samples);
    let spectrum = RealFft::new(windowed.len()).transform(&mut windowed);
    spectrum.iter().map(Complex::norm_sqr).collect()
}

/// The samples less their mean, with a Hann window.
fn windowed(samples: &[f64]) -> Vec<f64> {
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    let step = PI / samples.len() as f64;
    let samples = samples.iter().enumerate();
    samples
        .map(|(n, y)| (y - mean) * (step * (n as f64 + 0.5)).sin().powi(2))
        .collect()
}

/// Whether a bin is a local maximum and exceeds the median of the bins around by a factor.
fn is_line(power: &[f64], bin: usize, factor: f64) -> bool {
    let (near, far) = AROUND;
    let (below, above) = (bin - far..bin + 1 - near, bin + near..bin + far + 1);
    let mut around = [&power[below], &power[above]].concat();
    let middle = around.len() / 2;
    let (_, median, _) = around.select_nth_unstable_by(middle, f64::total_cmp);
    let is_peak = power[bin] >= power[bin - 1] && power[bin] > power[bin + 1];
    is_peak && power[bin] > factor * *median
}

/// The line near a place between the bins, if its amplitude is the same in most parts of the record.
fn steady_line(signals: &Signals, bin: f64) -> Option<StrayLine> {
    let output = &signals.output;
    let length = output.len() / PARTS;
    let mut omega = TAU * bin / output.len() as f64;
    omega += median_advance(&amplitudes(output, omega)) / length as f64;
    for _ in 0..CORRECTIONS {
        let amplitudes = amplitudes(output, omega);
        let advance = mean_advance(&steady(&amplitudes)?);
        omega += advance / length as f64;
    }
    let steady = steady(&amplitudes(output, omega))?;
    let sum: Complex<f64> = steady.iter().map(|(_, amplitude)| amplitude).sum();
    Some(StrayLine {
        frequency_hz: omega * signals.rate_hz / TAU,
        amplitude: sum / steady.len() as f64,
    })
}

/// The amplitude at a frequency in radians a sample, with the phase at the first sample of the record, in each part.
fn amplitudes(output: &[f64], omega: f64) -> Vec<Complex<f64>> {
    let length = output.len() / PARTS;
    let parts = output.chunks_exact(length).take(PARTS).enumerate();
    let amplitude = |(part, samples): (usize, &[f64])| {
        let phase = |n: usize| -omega * (part * length + n) as f64;
        let samples = windowed(samples).into_iter().enumerate();
        let sum: Complex<f64> = samples.map(|(n, y)| Complex::cis(phase(n)) * y).sum();
        // The mean of the window is 1/2.
        sum * 4.0 / length as f64
    };
    parts.map(amplitude).collect()
}

/// The median of the phase advances from part to part.
fn median_advance(amplitudes: &[Complex<f64>]) -> f64 {
    let advances = amplitudes
        .windows(2)
        .map(|pair| (pair[1] * pair[0].conj()).arg());
    median(advances.collect())
}

/// The parts nearest to the median amplitude, if most have it.
fn steady(amplitudes: &[Complex<f64>]) -> Option<Vec<(usize, Complex<f64>)>> {
    let of =
        |component: fn(&Complex<f64>) -> f64| median(amplitudes.iter().map(component).collect());
    let middle = Complex::new(of(|c| c.re), of(|c| c.im));
    let distance = |c: &Complex<f64>| (c - middle).norm();
    let mut parts: Vec<_> = amplitudes.iter().copied().enumerate().collect();
    parts.sort_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
    let (_, farthest) = parts.get(STEADY_PARTS - 1)?;
    let is_steady = distance(farthest) < STEADY_RATIO * middle.norm();
    parts.truncate(BEST_PARTS);
    is_steady.then_some(parts)
}

/// The phase advance from part to part by the least-squares line.
fn mean_advance(parts: &[(usize, Complex<f64>)]) -> f64 {
    let count = parts.len() as f64;
    let mean: Complex<f64> = parts.iter().map(|(_, c)| c).sum();
    let middle = parts.iter().map(|(part, _)| *part as f64).sum::<f64>() / count;
    let (mut product, mut square) = (0.0, 0.0);
    for (part, c) in parts {
        let distance = *part as f64 - middle;
        product += distance * (c * mean.conj()).arg();
        square += distance * distance;
    }
    product / square
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    *median
}
