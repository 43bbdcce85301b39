//! Repetitions of one excitation, each of which begins and ends at rest: their mean through the local estimator, and the noise
//! by how they differ.
//!
//! ```text
//! U = mean U_r,  Y = mean Y_r                      bin by bin over the R repetitions
//! S = sum over r of |(Y_r - Y) - (Y/U)(U_r - U)|^2/(R (R - 1))      the power of the noise of the mean
//! ```
//!
//! S needs no curve: what a curve misses is not in it, nor what the plant does alike in every repetition, distortion
//! included. It is averaged over the neighbourhood of the response alone. Noise on a measured input counts as well
//! (Pintelon, Schoukens, System Identification, 2nd ed., section 2.5).
//!
//! A periodic excitation without rest between is for [`super::periodic`].

use nalgebra::Complex;

use super::record::{Record, Scatter};
use super::spectrum::Spectra;
use super::{EstimatorSettings, Frf, IdentifyError, Signals, local};

/// Repetitions that can differ.
const LEAST: usize = 2;

/// What repetitions show.
#[derive(Clone, Debug, PartialEq)]
pub struct Repeated {
    /// The response by their mean.
    pub frf: Frf,
    /// How many there were.
    pub count: usize,
}

/// The response of `signals`, in which the same excitation is repeated every `length` samples from the first on. Samples after the
/// last whole repetition are left out.
///
/// # Errors
/// Those of [`local::estimate`], and when there are fewer than two repetitions.
pub fn estimate(
    signals: &Signals,
    band_hz: (f64, f64),
    length: usize,
    settings: &EstimatorSettings,
) -> Result<Repeated, IdentifyError> {
    signals.check()?;
    let count = signals.len().checked_div(length).unwrap_or(0);
    if count < LEAST {
        let (value, most) = (length as f64, (signals.len() / LEAST) as f64);
        return Err(IdentifyError::Setting { name: "length of a repetition in samples", value, least: 1.0, most });
    }
    let parts: Vec<Signals> = (0..count).map(|r| part(signals, r * length, length)).collect();
    parts.iter().try_for_each(Signals::check)?;
    let spectra: Vec<Spectra> = parts.iter().map(Spectra::new).collect();
    let bins = spectra[0].input.len();
    let input = mean(bins, |k| spectra.iter().map(move |s| s.input[k]));
    let output = mean(bins, |k| spectra.iter().map(move |s| s.output[k]));
    let power = (0..bins).map(|k| power(&spectra, k, input[k], output[k])).collect();
    let mut record = Record::of(Spectra { input, output }, signals.rate_hz / length as f64);
    record.scatter = Some(Scatter { power, freedom: (count - 1) as f64 });
    Ok(Repeated { frf: local::of_record(&record, (signals.rate_hz, length), band_hz, settings)?, count })
}

fn part(signals: &Signals, from: usize, length: usize) -> Signals {
    let cut = |samples: &[f64]| samples[from..from + length].to_vec();
    Signals { rate_hz: signals.rate_hz, input_a: cut(&signals.input_a), output_m: cut(&signals.output_m) }
}

fn mean<I: Iterator<Item = Complex<f64>>>(bins: usize, of: impl Fn(usize) -> I) -> Vec<Complex<f64>> {
    let mean = |k: usize| {
        let (sum, count) = of(k).fold((Complex::default(), 0.0), |(sum, count), x| (sum + x, count + 1.0));
        sum / count
    };
    (0..bins).map(mean).collect()
}

/// The power of the noise of the mean in a bin.
fn power(spectra: &[Spectra], bin: usize, input: Complex<f64>, output: Complex<f64>) -> f64 {
    let count = spectra.len() as f64;
    let response = if input.norm_sqr() > 0.0 { output / input } else { Complex::default() };
    let off = |s: &Spectra| (s.output[bin] - output - response * (s.input[bin] - input)).norm_sqr();
    spectra.iter().map(off).sum::<f64>() / (count * (count - 1.0))
}
