//! What a probe measures of a displacement.

use nalgebra::Complex;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The displacement, or its derivative by time.
///
/// ```text
/// Y(s) = s^k G(s) F(s)             G the response in displacement, k = 0, 1, 2
/// ```
///
/// Modes, residues and zeros are those of G. The response Y/F has k further zeros at s = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum OutputKind {
    /// The displacement, as of an encoder or an interferometer.
    #[default]
    Position,
    /// Its first derivative, as of a laser vibrometer.
    Velocity,
    /// Its second derivative, as of an accelerometer.
    Acceleration,
}

impl OutputKind {
    /// All kinds.
    pub const ALL: [OutputKind; 3] = [
        OutputKind::Position,
        OutputKind::Velocity,
        OutputKind::Acceleration,
    ];

    /// k: the number of derivatives by time.
    pub fn derivatives(self) -> i32 {
        match self {
            OutputKind::Position => 0,
            OutputKind::Velocity => 1,
            OutputKind::Acceleration => 2,
        }
    }

    /// The kind of its derivative by time; `None` of an acceleration, whose derivative no probe measures.
    pub fn derivative(self) -> Option<OutputKind> {
        match self {
            OutputKind::Position => Some(OutputKind::Velocity),
            OutputKind::Velocity => Some(OutputKind::Acceleration),
            OutputKind::Acceleration => None,
        }
    }

    /// s^k.
    pub fn factor(self, s: Complex<f64>) -> Complex<f64> {
        s.powi(self.derivatives())
    }

    /// `position`, `velocity` or `acceleration`.
    pub fn name(self) -> &'static str {
        match self {
            OutputKind::Position => "position",
            OutputKind::Velocity => "velocity",
            OutputKind::Acceleration => "acceleration",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_one_more_derivative() {
        let s = Complex::new(0.0, 3.0);
        let factors = OutputKind::ALL.map(|kind| kind.factor(s));
        assert_eq!(factors, [Complex::new(1.0, 0.0), s, s * s]);
    }

    #[test]
    fn derivative_has_one_more_factor_s() {
        for kind in OutputKind::ALL {
            let derivatives = kind.derivative().map(OutputKind::derivatives);
            let expected = (kind != OutputKind::Acceleration).then(|| kind.derivatives() + 1);
            assert_eq!(derivatives, expected);
        }
    }
}
