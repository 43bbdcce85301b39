//! H1, H2 and Hv by Welch's method: Hann windows, half overlapping, as every analyser does it.
//!
//! For records that do not begin and end at rest, and for comparison: the spectra are those of `scipy.signal.welch` and
//! `scipy.signal.csd` with their defaults and `nperseg = segment`. Leakage smears narrow modes over some 1.5
//! rate/segment; a record at rest at both ends is better served by [`super::local`].
//!
//! P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70; J. S. Bendat, A. G. Piersol, Random Data, 4th ed., table
//! 9.6.

use core::f64::consts::PI;
use core::ops::RangeInclusive;

use nalgebra::Complex;

use super::estimator::by_coherence;
use super::spectrum::RealFft;
use super::{Estimator, Frf, FrfPoint, IdentifyError, Signals, band};

/// Shorter segments have no bins to speak of.
const LEAST_SEGMENT: usize = 8;
/// Correlation of two half-overlapping Hann windows, 1/6: what neighbouring segments share.
const OVERLAP_CORRELATION: f64 = 1.0 / 6.0;
/// Equivalent noise bandwidth of a Hann window in bins.
const HANN_BANDWIDTH_BINS: f64 = 1.5;

/// One-sided power spectral densities at the frequencies k rate/segment, k = 0 ..= segment/2.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spectra {
    /// Frequencies in hertz.
    pub frequency_hz: Vec<f64>,
    /// Of the input in A^2/Hz.
    pub input: Vec<f64>,
    /// Of the output in m^2/Hz.
    pub output: Vec<f64>,
    /// Cross density conj(U) Y in A m/Hz.
    pub cross: Vec<Complex<f64>>,
    /// How many segments went into the mean.
    pub segments: usize,
}

/// H1 = S_uy / S_uu, H2 = S_yy / S_yu or Hv between them at the frequencies of `band_hz`, from segments of `segment` samples.
///
/// With n segments' worth of independent averages and the coherence C, E|error of H|^2 = |H|^2 (1 - C) / (C (n - 1));
/// half overlapping Hann windows give n = K / (1 + 2 (K - 1)/K / 36) of K segments.
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
    let least = segment + segment.div_ceil(2);
    if spectra.segments < 2 {
        return Err(IdentifyError::TooShort {
            samples: signals.len(),
            least,
        });
    }
    let frf = frf(
        &spectra,
        estimator,
        bins,
        HANN_BANDWIDTH_BINS * signals.rate_hz / segment as f64,
    );
    if frf.is_empty() {
        Err(IdentifyError::NotExcited {
            low_hz: band_hz.0,
            high_hz: band_hz.1,
        })
    } else {
        Ok(frf)
    }
}

/// The spectra of both signals. Every segment loses its mean before it is windowed.
///
/// # Errors
/// When the signals are not fit, or the segment is shorter than 8 samples or longer than the record.
pub fn spectra(signals: &Signals, segment: usize) -> Result<Spectra, IdentifyError> {
    signals.check()?;
    let (least, most) = (LEAST_SEGMENT, signals.len());
    if segment < least || segment > most {
        let (value, least, most) = (segment as f64, least as f64, most as f64);
        return Err(IdentifyError::Setting {
            name: "segment",
            value,
            least,
            most,
        });
    }
    let mut sums = Sums::new(segment);
    let step = segment - segment / 2;
    for start in (0..=signals.len() - segment).step_by(step) {
        let range = start..start + segment;
        sums.add(&signals.input_a[range.clone()], &signals.output_m[range]);
    }
    Ok(sums.mean(signals.rate_hz))
}

/// sin^2(pi n / N): Hann's window, periodic.
fn hann(samples: usize) -> Vec<f64> {
    (0..samples)
        .map(|n| libm::sin(PI * n as f64 / samples as f64).powi(2))
        .collect()
}

/// Running sums over segments.
struct Sums {
    fft: RealFft,
    window: Vec<f64>,
    spectra: Spectra,
}

impl Sums {
    fn new(segment: usize) -> Self {
        let bins = segment / 2 + 1;
        let zero = vec![0.0; bins];
        let cross = vec![Complex::default(); bins];
        let spectra = Spectra {
            input: zero.clone(),
            output: zero,
            cross,
            ..Spectra::default()
        };
        Self {
            fft: RealFft::new(segment),
            window: hann(segment),
            spectra,
        }
    }

    fn add(&mut self, input: &[f64], output: &[f64]) {
        let (input, output) = (self.windowed(input), self.windowed(output));
        for (k, (u, y)) in input.iter().zip(&output).enumerate() {
            self.spectra.input[k] += u.norm_sqr();
            self.spectra.output[k] += y.norm_sqr();
            self.spectra.cross[k] += u.conj() * y;
        }
        self.spectra.segments += 1;
    }

    fn windowed(&self, samples: &[f64]) -> Vec<Complex<f64>> {
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        let mut windowed: Vec<f64> = samples
            .iter()
            .zip(&self.window)
            .map(|(s, w)| (s - mean) * w)
            .collect();
        self.fft.transform(&mut windowed)
    }

    /// Mean over the segments as density: 2/(rate sum w^2), without the 2 at zero and at the Nyquist frequency.
    fn mean(mut self, rate_hz: f64) -> Spectra {
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

fn frf(
    spectra: &Spectra,
    estimator: Estimator,
    bins: RangeInclusive<usize>,
    resolution_hz: f64,
) -> Frf {
    let mut frf = Frf::default();
    for k in bins {
        let (input, output, cross) = (spectra.input[k], spectra.output[k], spectra.cross[k]);
        // A dead input makes 0/0 here, and push() leaves the frequency out.
        let response = cross / input;
        let coherence = if output > 0.0 {
            response.norm() * (cross.norm() / output)
        } else {
            0.0
        };
        let unexplained = (output / input * (1.0 - coherence)).max(0.0);
        let variance = unexplained / (averages(spectra.segments) - 1.0);
        let h1 = FrfPoint {
            frequency_hz: spectra.frequency_hz[k],
            response,
            coherence,
            variance,
            resolution_hz,
        };
        frf.push(by_coherence(h1, estimator));
    }
    frf
}

/// Independent averages that K half-overlapping segments are worth.
fn averages(segments: usize) -> f64 {
    let count = segments as f64;
    count / (1.0 + 2.0 * OVERLAP_CORRELATION * OVERLAP_CORRELATION * (count - 1.0) / count)
}
