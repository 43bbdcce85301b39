//! The poles of a closed loop in the s plane.

use std::f64::consts::PI;

use nalgebra::Complex;
use serde::Serialize;

/// A pole of the closed loop in the s plane; one of each conjugate pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Pole {
    /// Real part in rad/s.
    pub re_rad_s: f64,
    /// Imaginary part in rad/s.
    pub im_rad_s: f64,
    /// |s|/(2 pi) in hertz.
    pub frequency_hz: f64,
    /// -Re(s)/|s|.
    pub damping_ratio: f64,
    /// Whether the pole is in the left half plane.
    pub stable: bool,
}

impl Pole {
    fn of(s: &Complex<f64>) -> Pole {
        let omega_rad_s = s.norm();
        Pole {
            re_rad_s: s.re,
            im_rad_s: s.im,
            frequency_hz: omega_rad_s / (2.0 * PI),
            // A pole at the origin is not damped.
            damping_ratio: -s.re / omega_rad_s.max(f64::MIN_POSITIVE),
            stable: s.re < 0.0,
        }
    }
}

/// The poles of a loop below half the sampling rate, and all unstable ones; unstable ones first.
pub fn listed_poles(poles: &[Complex<f64>], rate_hz: f64) -> Vec<Pole> {
    let nyquist_rad_s = PI * rate_hz;
    let is_listed = |s: &&Complex<f64>| s.im >= 0.0 && (s.re >= 0.0 || s.norm() < nyquist_rad_s);
    let mut listed: Vec<Pole> = poles.iter().filter(is_listed).map(Pole::of).collect();
    listed.sort_by(|a, b| b.re_rad_s.total_cmp(&a.re_rad_s));
    listed
}
