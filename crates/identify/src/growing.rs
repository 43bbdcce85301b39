//! The frequency response during a run: an estimate for watching, not for a result.
//!
//! Segments of some 6.5 s under Hann windows, a quarter apart, are averaged as in [`super::welch`]. A bin of a segment counts only
//! if the input excites it there: otherwise the noise of the time in which a sweep is elsewhere would lower the coherence.
//! The bins are joined in bands of equal ratio. Leakage smears a mode over some 0.6 Hz; the analysis after the run does not.

use std::collections::VecDeque;

use nalgebra::Complex;

use super::fft::RealFft;
use super::welch::windowed_spectrum;

/// Wanted length of a segment in seconds.
const SEGMENT_S: f64 = 6.5;
/// A segment begins this part of its length after the one before it.
const HOPS: usize = 4;
/// Bands of a decade.
const BANDS_PER_DECADE: f64 = 60.0;
/// A bin counts if the power of its input is at least this part of the largest one of the segment: a logarithmic sweep spends
/// less time at high frequencies, but not a thousandth.
const EXCITED: f64 = 1e-3;
/// First bin: below it the window removes what the mean leaves over.
const FIRST_BIN: usize = 3;

/// A band of the response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrowingPoint {
    /// Mean frequency of its bins, weighted with the power of the input, in hertz.
    pub frequency_hz: f64,
    /// H = S_uy / S_uu in the unit of the output over that of the input; a lag of the output is a negative phase.
    pub response: Complex<f64>,
    /// |S_uy|^2 / (S_uu S_yy); `None` with a single average, whose coherence is always 1.
    pub coherence: Option<f64>,
}

/// Sums over the bins of a band.
#[derive(Clone, Copy, Debug, Default)]
struct Band {
    input: f64,
    output: f64,
    cross: Complex<f64>,
    /// Sum of frequency times power of the input.
    weighted_hz: f64,
    averages: u32,
}

/// The estimate. It takes the samples one by one.
pub struct GrowingResponse {
    rate_hz: f64,
    segment: usize,
    fft: RealFft,
    input: VecDeque<f64>,
    output: VecDeque<f64>,
    bands: Vec<Band>,
}

impl GrowingResponse {
    /// An estimate without samples. A segment has the power of two of samples that is next to 6.5 s.
    pub fn new(rate_hz: f64) -> GrowingResponse {
        let segment =
            1_usize << libm::round(libm::log2(SEGMENT_S * rate_hz)).clamp(4.0, 20.0) as u32;
        let decades = libm::log10(segment as f64 / 2.0);
        let bands = libm::ceil(decades * BANDS_PER_DECADE) as usize + 1;
        GrowingResponse {
            rate_hz,
            segment,
            fft: RealFft::new(segment),
            input: VecDeque::with_capacity(segment),
            output: VecDeque::with_capacity(segment),
            bands: vec![Band::default(); bands],
        }
    }

    /// Adds a sample; returns whether the estimate has changed.
    pub fn push(&mut self, input: f64, output: f64) -> bool {
        self.input.push_back(input);
        self.output.push_back(output);
        if self.input.len() < self.segment {
            return false;
        }
        self.add_segment();
        let hop = self.segment / HOPS;
        self.input.drain(..hop);
        self.output.drain(..hop);
        true
    }

    fn add_segment(&mut self) {
        let input = windowed_spectrum(&self.fft, self.input.make_contiguous());
        let output = windowed_spectrum(&self.fft, self.output.make_contiguous());
        let bins = FIRST_BIN..self.segment / 2;
        let largest = input[bins.clone()].iter().map(|u| u.norm_sqr());
        let threshold = EXCITED * largest.fold(0.0, f64::max);
        for bin in bins {
            let (u, y) = (input[bin], output[bin]);
            if u.norm_sqr() > threshold {
                self.add_bin(bin, u, y);
            }
        }
    }

    fn add_bin(&mut self, bin: usize, u: Complex<f64>, y: Complex<f64>) {
        let frequency_hz = bin as f64 * self.rate_hz / self.segment as f64;
        let band = (libm::log10(bin as f64) * BANDS_PER_DECADE) as usize;
        let Some(band) = self.bands.get_mut(band) else {
            return; // no bin lies above the last band
        };
        band.input += u.norm_sqr();
        band.output += y.norm_sqr();
        band.cross += u.conj() * y;
        band.weighted_hz += frequency_hz * u.norm_sqr();
        band.averages += 1;
    }

    /// The bands that were excited so far, lowest frequency first.
    pub fn points(&self) -> Vec<GrowingPoint> {
        let excited = self.bands.iter().filter(|band| band.input > 0.0);
        excited.map(Band::point).collect()
    }
}

impl Band {
    fn point(&self) -> GrowingPoint {
        let coherence = (self.averages > 1 && self.output > 0.0)
            .then(|| self.cross.norm_sqr() / self.input / self.output);
        GrowingPoint {
            frequency_hz: self.weighted_hz / self.input,
            response: self.cross / self.input,
            coherence,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    const RATE_HZ: f64 = 1000.0;

    /// y(n) = a y(n-1) + (1 - a) u(n-1): H = (1 - a) z^-1 / (1 - a z^-1).
    const A: f64 = 0.9;

    fn closed_form(frequency_hz: f64) -> Complex<f64> {
        let delay = Complex::from_polar(1.0, -TAU * frequency_hz / RATE_HZ);
        delay * (1.0 - A) / (Complex::from(1.0) - delay * A)
    }

    /// Uniform noise of variance 1.
    fn noise(random: &mut Pcg64Mcg) -> f64 {
        (random.next_u64() as f64 / u64::MAX as f64 - 0.5) * 12_f64.sqrt()
    }

    /// The estimate after a logarithmic sweep from 1 Hz to `stop_hz` in 60 s through the filter, with noise on the output.
    fn swept(stop_hz: f64, noise_sigma: f64) -> Vec<GrowingPoint> {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let mut growing = GrowingResponse::new(RATE_HZ);
        let (mut y, mut last) = (0.0, 0.0);
        let growth = libm::log(stop_hz) / 60.0;
        for n in 0..60_000 {
            let t = n as f64 / RATE_HZ;
            let u = libm::sin(TAU * (libm::exp(growth * t) - 1.0) / growth);
            y = A * y + (1.0 - A) * last;
            last = u;
            growing.push(u, y + noise_sigma * noise(&mut random));
        }
        growing.points()
    }

    #[test]
    fn agrees_with_the_closed_form_of_a_filter() {
        let points = swept(200.0, 0.0);
        let inner: Vec<_> = points
            .iter()
            .filter(|p| (2.0..150.0).contains(&p.frequency_hz))
            .collect();
        assert!(inner.len() > 80, "{}", inner.len());
        for point in inner {
            let expected = closed_form(point.frequency_hz);
            // Leakage and the width of a band: 2 % of a band, along which the response falls by at most its slope.
            let error = (point.response / expected - Complex::from(1.0)).norm();
            assert!(error < 0.03, "{point:?} {expected}");
            assert!(
                point.coherence.is_none_or(|coherence| coherence > 0.99),
                "{point:?}"
            );
        }
    }

    #[test]
    fn shows_only_what_the_sweep_has_reached() {
        let points = swept(20.0, 0.001);
        let highest = points
            .iter()
            .map(|point| point.frequency_hz)
            .fold(0.0, f64::max);
        // The spectrum of a sweep falls steeply beyond its end.
        assert!((15.0..25.0).contains(&highest), "{highest}");
    }

    #[test]
    fn noise_lowers_the_coherence() {
        let mean = |points: &[GrowingPoint]| {
            let known: Vec<f64> = points
                .iter()
                .filter(|point| (20.0..150.0).contains(&point.frequency_hz))
                .filter_map(|point| point.coherence)
                .collect();
            known.iter().sum::<f64>() / known.len() as f64
        };
        let (clean, noisy) = (mean(&swept(200.0, 0.0)), mean(&swept(200.0, 0.3)));
        assert!(
            clean > 0.99 && (0.1..0.95).contains(&noisy),
            "{clean} {noisy}"
        );
    }

    #[test]
    fn a_resting_stage_has_no_response() {
        let mut growing = GrowingResponse::new(RATE_HZ);
        for _ in 0..20_000 {
            growing.push(0.0, 0.0);
        }
        assert_eq!(growing.points(), []);
    }
}
