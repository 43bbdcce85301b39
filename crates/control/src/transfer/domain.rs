//! The s plane and the z plane.

use nalgebra::Complex;

/// The variable of a transfer function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Domain {
    /// s in rad/s.
    Continuous,
    /// z = exp(s T) at a servo rate 1/T.
    Discrete {
        /// The rate in hertz.
        rate_hz: f64,
    },
}

impl Domain {
    /// The domain of a controller with this servo rate.
    pub fn of_rate(rate_hz: Option<f64>) -> Domain {
        rate_hz.map_or(Domain::Continuous, |rate_hz| Domain::Discrete { rate_hz })
    }

    /// The pole of an integrator: s = 0 or z = 1.
    pub fn integrator(self) -> f64 {
        match self {
            Domain::Continuous => 0.0,
            Domain::Discrete { .. } => 1.0,
        }
    }

    /// The point of a frequency in rad/s: s = j w or z = exp(j w T).
    pub fn point(self, omega_rad_s: f64) -> Complex<f64> {
        match self {
            Domain::Continuous => Complex::new(0.0, omega_rad_s),
            Domain::Discrete { rate_hz } => {
                let (sine, cosine) = libm::sincos(omega_rad_s / rate_hz);
                Complex::new(cosine, sine)
            }
        }
    }

    /// Whether a pole is stable: left of the imaginary axis, or inside the unit circle.
    pub fn is_stable(self, pole: Complex<f64>) -> bool {
        match self {
            Domain::Continuous => pole.re < 0.0,
            Domain::Discrete { .. } => pole.norm() < 1.0,
        }
    }

    /// The root in rad/s, s = ln(z)/T; `None` at s = 0 and z = 0.
    pub fn rad_s(self, root: Complex<f64>) -> Option<Complex<f64>> {
        let s = match self {
            Domain::Continuous => root,
            Domain::Discrete { rate_hz } => root.ln() * rate_hz,
        };
        (s.norm() > 0.0 && s.norm().is_finite()).then_some(s)
    }
}
