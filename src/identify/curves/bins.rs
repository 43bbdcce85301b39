//! What an estimate is made of, whichever signals it is about.

use nalgebra::Complex;

use super::curve::Fitted;
use super::settings::EstimatorSettings;

/// What curves are drawn through, bin by bin: input U, output Y, and an instrument R, which knows nothing of the noise; in open
/// loop that is U itself.
pub(super) trait Bins {
    /// Width of a bin in hertz.
    fn bin_hz(&self) -> f64;
    /// The highest bin below the Nyquist frequency.
    fn last_bin(&self) -> usize;
    /// The response in the middle of a neighbourhood, both in bins; none where the instrument is dead.
    fn fit(&self, place: f64, half_width: f64, settings: &EstimatorSettings) -> Option<Fitted>;
    /// U conj(R) of a bin.
    fn drive(&self, bin: usize) -> Complex<f64>;
    /// Y conj(R) of a bin.
    fn cross(&self, bin: usize) -> Complex<f64>;
    /// |R|^2 of a bin.
    fn power(&self, bin: usize) -> f64;
}
