//! The compared figures of a stage check. The names in JSON must not change.

use serde::{Deserialize, Serialize};

/// Static compliance by shot and certificate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StaticComparison {
    /// By the shot, in metres per ampere.
    pub measured_m_per_a: f64,
    /// By the certificate.
    pub certified_m_per_a: f64,
    /// Largest allowed difference, relative to the certificate.
    pub limit_ratio: f64,
}

/// Phase of the response at a tone by shot and certificate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhaseComparison {
    /// Frequency of the tone in hertz.
    pub frequency_hz: f64,
    /// By the shot, in degrees.
    pub measured_deg: f64,
    /// By the certificate.
    pub certified_deg: f64,
    /// Difference within +-180 degrees.
    pub difference_deg: f64,
    /// Largest allowed difference in degrees.
    pub limit_deg: f64,
}
