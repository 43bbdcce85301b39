//! What a parametric fit takes: independent data.

use nalgebra::Complex;

/// The mean response over a few neighbouring bins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrfDatum {
    /// Its centre, weighted with the power of the input, in hertz.
    pub frequency_hz: f64,
    /// Standard deviation of its frequencies about the centre, weighted alike, in hertz.
    pub spread_hz: f64,
    /// Mean of H in metres per ampere.
    pub response: Complex<f64>,
    /// E|error|^2 in (m/A)^2.
    pub variance: f64,
}
