//! Conversions between SI units and those in which controllers and frequencies are written.

use std::f64::consts::TAU;

/// Micrometres in a metre. Controllers are written in amperes per micrometre.
pub const UM_PER_M: f64 = 1e6;

/// Angular frequency in rad/s of a frequency in hertz, w = 2 pi f.
///
/// ```
/// assert_eq!(bench_base::units::rad_s(0.5), std::f64::consts::PI);
/// ```
pub fn rad_s(frequency_hz: f64) -> f64 {
    TAU * frequency_hz
}

/// Frequency in hertz of an angular frequency in rad/s, f = w/(2 pi).
pub fn hz(omega_rad_s: f64) -> f64 {
    omega_rad_s / TAU
}

/// A frequency with a number of decimals, and with more if it would have fewer than two significant digits: none is shown as 0.
///
/// ```
/// use bench_base::units::hz_text;
///
/// assert_eq!([hz_text(64.664, 2), hz_text(0.012345, 2)], ["64.66", "0.012"]);
/// ```
pub fn hz_text(frequency_hz: f64, decimals: usize) -> String {
    let magnitude = libm::log10(frequency_hz.abs()).floor();
    let needed = if magnitude.is_finite() {
        (1.0 - magnitude).clamp(0.0, 12.0) as usize
    } else {
        0
    };
    format!("{frequency_hz:.*}", decimals.max(needed))
}
