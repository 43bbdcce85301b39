//! The responses in a recording, before modes are fitted.

use nalgebra::Complex;

use super::missing_ticks::with_variance_factor;
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

impl ResponseEstimate {
    /// With the variances of all responses multiplied by a factor of 1 or more.
    pub(super) fn with_variance_factor(self, factor: f64) -> ResponseEstimate {
        let closed = self.closed.map(|closed| ClosedResponses {
            complementary: with_variance_factor(closed.complementary, factor),
            sensitivity: with_variance_factor(closed.sensitivity, factor),
            loop_gain: with_variance_factor(closed.loop_gain, factor),
            ..closed
        });
        ResponseEstimate {
            frf: with_variance_factor(self.frf, factor),
            closed,
            linearity: self.linearity,
        }
    }
}
