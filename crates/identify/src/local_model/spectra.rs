//! The spectra that a response is estimated from.

use nalgebra::Complex;

use super::window::LocalFit;
use crate::EstimatorSettings;

/// Spectra of an input U, an output Y and an instrument R, which is independent of the noise; in open loop R is U.
pub(super) trait Spectra {
    /// Width of a bin in hertz.
    fn bin_hz(&self) -> f64;
    /// The highest bin below the Nyquist frequency.
    fn last_bin(&self) -> usize;
    /// The response in the middle of a neighbourhood, position and half-width in bins; `None` where the instrument has no
    /// energy.
    fn fit(&self, position: f64, half_width: f64, settings: &EstimatorSettings)
    -> Option<LocalFit>;
    /// U conj(R) of a bin.
    fn input_cross(&self, bin: usize) -> Complex<f64>;
    /// Y conj(R) of a bin.
    fn output_cross(&self, bin: usize) -> Complex<f64>;
    /// |R|^2 of a bin.
    fn instrument_power(&self, bin: usize) -> f64;
}
