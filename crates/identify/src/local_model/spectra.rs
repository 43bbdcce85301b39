//! The spectra that a response is estimated from.

use core::ops::RangeInclusive;

use nalgebra::Complex;

use super::window::LocalFit;
use crate::EstimatorSettings;

/// A neighbourhood, in bins.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) position: f64,
    pub(super) half_width: f64,
}

/// Spectra of an input U, an output Y and an instrument R, which is independent of the noise; in open loop R is U.
pub(super) trait Spectra {
    /// Width of a bin in hertz.
    fn bin_hz(&self) -> f64;
    /// The highest bin below the Nyquist frequency.
    fn last_bin(&self) -> usize;
    /// The response in the middle of a neighbourhood, by a local model with at most `max_poles` poles; `None` where the instrument has
    /// no energy.
    fn fit(&self, place: Place, settings: &EstimatorSettings, max_poles: usize)
    -> Option<LocalFit>;
    /// U conj(R) of a bin.
    fn input_cross(&self, bin: usize) -> Complex<f64>;
    /// Y conj(R) of a bin.
    fn output_cross(&self, bin: usize) -> Complex<f64>;
    /// |R|^2 of a bin.
    fn instrument_power(&self, bin: usize) -> f64;
    /// U of each bin without its noise, as far as it is known: for the variance of the response.
    fn expected_inputs(
        &self,
        bins: &RangeInclusive<usize>,
        settings: &EstimatorSettings,
    ) -> Vec<ExpectedInput>;
}

/// An input in a bin without its noise.
#[derive(Clone, Copy, Default)]
pub(super) struct ExpectedInput {
    /// U conj(R) without the noise of U.
    pub(super) cross: Complex<f64>,
    /// E|noise of U|^2
    pub(super) noise_power: f64,
}

impl ExpectedInput {
    /// Of an input without noise.
    pub(super) fn exact(cross: Complex<f64>) -> ExpectedInput {
        ExpectedInput {
            cross,
            noise_power: 0.0,
        }
    }
}
