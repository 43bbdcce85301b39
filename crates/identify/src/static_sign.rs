//! The sign of the static response: that of a sensor or a drive that is inverted is a finding, and not a mode.

use serde::Serialize;

use crate::modal::ModalFit;
use crate::observation::describes;

/// A static response of fewer standard deviations has no sign.
const CERTAIN_SIGMAS: f64 = 5.0;

/// The sign of the static response of the position, by the modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum StaticSign {
    /// The stage moves in the direction of the force.
    #[serde(rename = "+")]
    Positive,
    /// The stage seems to move against the force.
    #[serde(rename = "-")]
    Negative,
}

impl StaticSign {
    /// The sign of the sum of r/w^2 and the constant, if the modes describe the response from below the first of them on, and the sum
    /// exceeds its error.
    pub fn of(fit: &ModalFit) -> Option<StaticSign> {
        let first = fit.modes().into_iter().next()?;
        let is_seen = describes(fit) && fit.band_hz.0 < first.frequency_hz().value;
        let compliance = fit.static_compliance_m_per_n().filter(|_| is_seen)?;
        if compliance.value.abs() <= CERTAIN_SIGMAS * compliance.sigma {
            return None;
        }
        Some(if compliance.value > 0.0 {
            StaticSign::Positive
        } else {
            StaticSign::Negative
        })
    }

    /// What a negative sign means, for a reader.
    pub fn description(self) -> Option<&'static str> {
        match self {
            StaticSign::Positive => None,
            StaticSign::Negative => Some(
                "the static response is negative: sensor or drive inverted? All residues then have the other sign; zeros and verdict depend on the relative signs only",
            ),
        }
    }
}
