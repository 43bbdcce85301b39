//! A point of a measured response.

use nalgebra::Complex;

/// A measured response at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResponsePoint {
    /// Frequency in rad/s.
    pub omega_rad_s: f64,
    /// The response, for example in metres per ampere.
    pub response: Complex<f64>,
    /// E|error of the response|^2.
    pub variance: f64,
    /// Noise bandwidth of the estimator in rad/s: errors of points that are closer are correlated.
    pub resolution_rad_s: f64,
}
