//! The FFT of whole stretches of signal.

use nalgebra::Complex;
use realfft::{RealFftPlanner, RealToComplex};
use std::sync::Arc;

/// A planned FFT of real samples, X_k = sum_n x_n exp(-2 pi i k n / N) for k = 0 ..= N/2. Any length will do.
pub(super) struct RealFft(Arc<dyn RealToComplex<f64>>);

impl RealFft {
    pub(super) fn new(samples: usize) -> Self {
        Self(RealFftPlanner::new().plan_fft_forward(samples))
    }

    /// The spectrum; the samples are used as scratch space. Their number must be the planned one.
    pub(super) fn transform(&self, samples: &mut [f64]) -> Vec<Complex<f64>> {
        let mut spectrum = self.0.make_output_vec();
        // The only error is a buffer of the wrong length: one is made by the plan, the other promised by the caller.
        self.0.process(samples, &mut spectrum).expect("as many samples as planned");
        spectrum
    }
}
