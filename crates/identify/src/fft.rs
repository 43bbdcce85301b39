//! The FFT of real signals.

use nalgebra::Complex;
use realfft::{RealFftPlanner, RealToComplex};
use std::sync::Arc;

use super::band;

/// A planned FFT of real samples, X_k = sum_n x_n exp(-2 pi i k n / N) for k = 0 ..= N/2, of any length N.
pub(super) struct RealFft(Arc<dyn RealToComplex<f64>>);

impl RealFft {
    pub(super) fn new(samples: usize) -> Self {
        Self(RealFftPlanner::new().plan_fft_forward(samples))
    }

    /// The spectrum. The samples serve as scratch space; their number must be the planned one.
    pub(super) fn transform(&self, samples: &mut [f64]) -> Vec<Complex<f64>> {
        let mut spectrum = self.0.make_output_vec();
        // The only error is a buffer of the wrong length: the plan makes one, the caller guarantees the other.
        self.0
            .process(samples, &mut spectrum)
            .expect("as many samples as planned");
        spectrum
    }

    /// The spectrum up to the last bin below the Nyquist frequency, bin 0 included.
    pub(super) fn below_nyquist(&self, mut samples: Vec<f64>) -> Vec<Complex<f64>> {
        let mut spectrum = self.transform(&mut samples);
        spectrum.truncate(band::last_bin(samples.len()) + 1);
        spectrum
    }
}
