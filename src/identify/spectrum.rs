//! The FFT of whole stretches of signal.

use nalgebra::Complex;
use realfft::{RealFftPlanner, RealToComplex};
use std::sync::Arc;

use super::{Signals, band};

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
        self.0
            .process(samples, &mut spectrum)
            .expect("as many samples as planned");
        spectrum
    }
}

/// Input and output of a whole record, bin by bin below the Nyquist frequency; entry 0, the offset, is there to count from.
pub(super) struct Spectra {
    pub(super) input: Vec<Complex<f64>>,
    pub(super) output: Vec<Complex<f64>>,
}

impl Spectra {
    /// The spectra, the output without its drift.
    pub(super) fn new(signals: &Signals) -> Self {
        let fft = RealFft::new(signals.len());
        let mut input = fft.transform(&mut signals.input_a.clone());
        let mut output = fft.transform(&mut signals.output_without_drift_m());
        let bins = band::last_bin(signals.len()) + 1;
        input.truncate(bins);
        output.truncate(bins);
        Self { input, output }
    }
}
