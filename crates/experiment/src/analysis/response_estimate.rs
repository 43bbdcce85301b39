//! The responses in a recording, before modes are fitted.

use nalgebra::Complex;

use bench_control::Margins;
use bench_control::measured::MeasuredMargins;
use bench_identify::Frf;
use bench_identify::linearity::Linearity;

/// The measured responses of a closed loop, and those of the model at the same frequencies.
#[derive(Clone, Debug)]
pub struct ClosedResponses {
    /// T, from reference to reading.
    pub complementary: Frf,
    /// S, from reference to error.
    pub sensitivity: Frf,
    /// L = P C, from error to reading.
    pub loop_gain: Frf,
    /// L of the model, at the frequencies of `loop_gain`.
    pub model_loop: Vec<Complex<f64>>,
    /// Margins by the model.
    pub predicted: Margins,
    /// Measured margins, within the swept band.
    pub margins: MeasuredMargins,
}

/// A response with its data for the fit.
pub(crate) struct ResponseEstimate {
    pub(crate) frf: Frf,
    pub(crate) closed: Option<ClosedResponses>,
    pub(crate) linearity: Option<Linearity>,
}
