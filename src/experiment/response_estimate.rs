//! The responses that a recording contains, before modes are fitted.

use nalgebra::Complex;

use crate::control::Margins;
use crate::identify::modal::Estimate;
use crate::identify::{Frf, FrfDatum};

/// The loop as measured, and by the model at the same frequencies.
#[derive(Clone, Debug)]
pub struct ClosedResponses {
    /// T, from reference to reading.
    pub complementary: Frf,
    /// S, from reference to error.
    pub sensitivity: Frf,
    /// L = P C, from error to reading.
    pub loop_gain: Frf,
    /// L by the model, at the frequencies of `loop_gain`.
    pub model_loop: Vec<Complex<f64>>,
    /// Margins of the model's loop.
    pub predicted: Margins,
    /// Those of the measured one.
    pub margins: MeasuredMargins,
}

/// Margins of the measured loop, within the band that was swept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredMargins {
    /// Lowest frequency in rad/s at which |L| falls through 1.
    pub crossover_rad_s: Option<f64>,
    /// 180 degrees + arg L there.
    pub phase_margin_deg: Option<Estimate>,
    /// 1/max|S|.
    pub modulus_margin: Estimate,
    /// Where |S| is largest, in rad/s.
    pub sensitivity_peak_rad_s: f64,
}

/// A response in both its forms.
pub(super) struct ResponseEstimate {
    pub(super) frf: Frf,
    pub(super) frf_data: Vec<FrfDatum>,
    pub(super) closed: Option<ClosedResponses>,
}
