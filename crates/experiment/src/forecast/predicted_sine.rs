//! The response of a closed loop to a sine of its reference, by the model.

use serde::Serialize;

use bench_base::units::rad_s;
use bench_config::Config;
use bench_control::{ClosedLoop, Margins};

/// Gain and phase of T = L/(1 + L) by the model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PredictedSine {
    /// |T|.
    pub gain: f64,
    /// Phase of T in degrees.
    pub phase_deg: f64,
}

impl PredictedSine {
    /// The response at the frequency of a sine reference; `None` for another reference, for an unstable loop, and with a feedforward
    /// current, whose gain is 1 by the model.
    pub fn of(
        config: &Config,
        closed_loop: &ClosedLoop,
        margins: &Margins,
    ) -> Option<PredictedSine> {
        let frequency_hz = config.control.reference.design().sine_hz()?;
        if !margins.stable || !config.control.feedforward.is_none() {
            return None;
        }
        let response = closed_loop.complementary_sensitivity(rad_s(frequency_hz));
        Some(PredictedSine {
            gain: response.norm(),
            phase_deg: libm::atan2(response.im, response.re).to_degrees(),
        })
    }
}
