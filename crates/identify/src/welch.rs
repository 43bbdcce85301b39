//! H1, H2 and Hv by Welch's method: averaged segments under Hann windows that overlap by half.
//!
//! For records that do not begin and end at rest, and for comparison: the spectra equal those of `scipy.signal.welch` and
//! `scipy.signal.csd` with their defaults and `nperseg = segment`. Leakage smears narrow modes over some 1.5 rate/segment;
//! use [`super::local`] for a record that begins and ends at rest.
//!
//! P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70; J. S. Bendat, A. G. Piersol, Random Data, 4th ed., table
//! 9.6.

use core::f64::consts::PI;

use nalgebra::Complex;

use super::error::check_setting;
use super::estimator::from_h1;
use super::fft::RealFft;
use super::mean::mean;
use super::signals::check_min_samples;
use super::{Estimator, Frf, FrfPoint, IdentifyError, Signals, band};

/// Shorter segments have too few bins.
const MIN_SEGMENT: usize = 8;
/// Correlation of two Hann windows that overlap by half, 1/6.
const OVERLAP_CORRELATION: f64 = 1.0 / 6.0;
/// Equivalent noise bandwidth of a Hann window in bins.
const HANN_BANDWIDTH_BINS: f64 = 1.5;

/// One-sided power spectral densities at the frequencies k rate/segment, k = 0 ..= segment/2.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PowerSpectra {
    /// Frequencies in hertz.
    pub frequency_hz: Vec<f64>,
    /// Power spectral density of the input in A^2/Hz.
    pub input: Vec<f64>,
    /// Power spectral density of the output in m^2/Hz.
    pub output: Vec<f64>,
    /// Cross spectral density conj(U) Y in A m/Hz.
    pub cross: Vec<Complex<f64>>,
    /// Number of averaged segments.
    pub segments: usize,
}

/// H1 = S_uy / S_uu, H2 = S_yy / S_yu or Hv at the frequencies of `band_hz`, from segments of `segment` samples.
///
/// With n independent averages and the coherence C, E|error of H|^2 = |H|^2 (1 - C) / (C (n - 1)); K segments that overlap
/// by half are worth n = K / (1 + 2 (K - 1)/K / 36) averages.
///
/// # Errors
/// When the signals, the band or the segment allow no estimate: see [`IdentifyError`].
pub fn estimate(
    signals: &Signals,
    band_hz: (f64, f64),
    segment: usize,
    estimator: Estimator,
) -> Result<Frf, IdentifyError> {
    let spectra = spectra(signals, segment)?;
    let bins = band::bins(band_hz, signals.rate_hz, segment)?;
    check_min_samples(signals.len(), segment + segment.div_ceil(2))?;
    let resolution_hz = HANN_BANDWIDTH_BINS * signals.rate_hz / segment as f64;
    let mut frf = Frf::default();
    frf.extend(bins.map(|k| from_h1(spectra.h1(k, resolution_hz), estimator)));
    frf.excited(band_hz)
}

/// The spectra of both signals. The mean of each segment is subtracted before it is windowed.
///
/// # Errors
/// When the signals are unusable, or the segment is shorter than 8 samples or longer than the record.
pub fn spectra(signals: &Signals, segment: usize) -> Result<PowerSpectra, IdentifyError> {
    signals.check()?;
    let (min, max) = (MIN_SEGMENT as f64, signals.len() as f64);
    check_setting("segment", segment as f64, min, max)?;
    let mut sums = Sums::new(segment);
    let step = segment - segment / 2;
    for start in (0..=signals.len() - segment).step_by(step) {
        let range = start..start + segment;
        sums.add(&signals.input[range.clone()], &signals.output[range]);
    }
    Ok(sums.mean(signals.rate_hz))
}

impl PowerSpectra {
    /// Degrees of freedom of a power spectral density at one frequency: twice the number of independent averages. Its ratio to the
    /// expected value is distributed as chi-square over this number.
    pub fn degrees_of_freedom(&self) -> f64 {
        2.0 * independent_averages(self.segments)
    }

    /// H1 at bin `k`; not finite where the input is zero.
    fn h1(&self, k: usize, resolution_hz: f64) -> FrfPoint {
        let (input, output, cross) = (self.input[k], self.output[k], self.cross[k]);
        let response = cross / input;
        let coherence = if output > 0.0 {
            response.norm() * (cross.norm() / output)
        } else {
            0.0
        };
        let unexplained = (output / input * (1.0 - coherence)).max(0.0);
        let variance = unexplained / (independent_averages(self.segments) - 1.0);
        FrfPoint {
            frequency_hz: self.frequency_hz[k],
            response,
            coherence,
            variance,
            resolution_hz,
        }
    }
}

/// sin^2(pi n / N): the periodic Hann window.
fn hann(samples: usize) -> Vec<f64> {
    (0..samples)
        .map(|n| libm::sin(PI * n as f64 / samples as f64).powi(2))
        .collect()
}

/// The spectrum of samples without their mean, under a window.
fn windowed(fft: &RealFft, window: &[f64], samples: &[f64]) -> Vec<Complex<f64>> {
    let mean = mean(samples);
    let windowed = samples.iter().zip(window).map(|(s, w)| (s - mean) * w);
    fft.transform(&mut windowed.collect::<Vec<f64>>())
}

/// The spectrum of samples without their mean, under a Hann window of their length, which must be that of the FFT.
pub(super) fn windowed_spectrum(fft: &RealFft, samples: &[f64]) -> Vec<Complex<f64>> {
    windowed(fft, &hann(samples.len()), samples)
}

/// Running sums over segments.
struct Sums {
    fft: RealFft,
    window: Vec<f64>,
    spectra: PowerSpectra,
}

impl Sums {
    fn new(segment: usize) -> Self {
        let bins = segment / 2 + 1;
        let spectra = PowerSpectra {
            input: vec![0.0; bins],
            output: vec![0.0; bins],
            cross: vec![Complex::default(); bins],
            ..PowerSpectra::default()
        };
        Self {
            fft: RealFft::new(segment),
            window: hann(segment),
            spectra,
        }
    }

    fn add(&mut self, input: &[f64], output: &[f64]) {
        let input = windowed(&self.fft, &self.window, input);
        let output = windowed(&self.fft, &self.window, output);
        for (k, (u, y)) in input.iter().zip(&output).enumerate() {
            self.spectra.input[k] += u.norm_sqr();
            self.spectra.output[k] += y.norm_sqr();
            self.spectra.cross[k] += u.conj() * y;
        }
        self.spectra.segments += 1;
    }

    /// The mean over the segments as density: 2/(rate sum w^2), without the 2 at zero and at the Nyquist frequency.
    fn mean(mut self, rate_hz: f64) -> PowerSpectra {
        let segment = self.window.len();
        let energy: f64 = self.window.iter().map(|w| w * w).sum();
        let density = 1.0 / (rate_hz * energy * self.spectra.segments as f64);
        for k in 0..=segment / 2 {
            let sides = if k == 0 || 2 * k == segment { 1.0 } else { 2.0 };
            self.spectra
                .frequency_hz
                .push(k as f64 * rate_hz / segment as f64);
            self.spectra.input[k] *= sides * density;
            self.spectra.output[k] *= sides * density;
            self.spectra.cross[k] *= sides * density;
        }
        self.spectra
    }
}

/// Number of independent averages that K segments with half overlap are worth.
fn independent_averages(segments: usize) -> f64 {
    let count = segments as f64;
    count / (1.0 + 2.0 * OVERLAP_CORRELATION * OVERLAP_CORRELATION * (count - 1.0) / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One bin with H = 3 - 4 j and coherence 0.8.
    fn spectra(segments: usize) -> PowerSpectra {
        PowerSpectra {
            frequency_hz: vec![10.0],
            input: vec![2.0],
            output: vec![62.5],
            cross: vec![Complex::new(6.0, -8.0)],
            segments,
        }
    }

    #[test]
    fn segments_that_overlap_by_half_are_worth_fewer_averages() {
        // 3/(1 + 2 (2/3)/36) = 81/28; many segments are worth 18/19 of their number each.
        for (segments, averages) in [(1, 1.0), (3, 81.0 / 28.0)] {
            let degrees = spectra(segments).degrees_of_freedom();
            assert!((degrees - 2.0 * averages).abs() < 1e-14, "{degrees}");
        }
        let many = 1_000_000;
        let ratio = spectra(many).degrees_of_freedom() / (2.0 * many as f64);
        assert!((ratio - 18.0 / 19.0).abs() < 1e-6, "{ratio}");
    }

    #[test]
    fn variance_of_h1_is_that_of_a_regression_with_one_parameter() {
        // H = sum of u* y / sum of |u|^2 over n averages has the variance s/sum of |u|^2, and s, the variance of one residual, is
        // estimated from n residuals less one parameter: sum of |y - H u|^2/(n - 1). In means that is
        // (S_yy/S_uu) (1 - C)/(n - 1), here 62.5/2 x 0.2/(81/28 - 1) = 6.25 x 28/53.
        let point = spectra(3).h1(0, 1.5);
        // Rounding.
        assert!((point.response - Complex::new(3.0, -4.0)).norm() < 1e-14);
        assert!((point.coherence - 0.8).abs() < 1e-14);
        let expected = 6.25 * 28.0 / 53.0;
        assert!((point.variance - expected).abs() < 1e-13, "{point:?}");
    }

    #[test]
    fn one_segment_has_no_finite_variance() {
        assert!(!spectra(1).h1(0, 1.5).variance.is_finite());
    }
}
