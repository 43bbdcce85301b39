//! The lower 95 % bound of the modulus margin of a measured loop.
//!
//! ```text
//! m(w) = |1 + L(w)| - 1.96 sigma(w) |L|      sigma: standard deviation of dL/L along any direction, within the measured band
//! m(w) = |1 + L(w)|                          by the model, outside of it
//! ```
//!
//! The bound is the smallest m. It holds at each frequency, not for all at once.

use super::count::{NyquistCount, Stability};
use super::measured_loop::MeasuredLoop;
use crate::control::ClosedLoop;
use crate::util::estimate::SIGMAS_95;
use crate::util::units::hz;

/// Lowest examined frequency as a ratio of the lowest measured one.
const LOWEST: f64 = 1e-3;
/// Highest examined frequency as a ratio of half the rate, where L is real.
const HIGHEST: f64 = 1.0 - 1e-9;

/// The lower bound of the modulus margin of a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowerMargin {
    /// The lower 95 % bound of min |1 + L|.
    pub margin: f64,
    /// Its frequency in hertz.
    pub at_hz: f64,
    /// Whether the measured curve shows a stable loop.
    pub stability: Stability,
    /// Smallest distance of the measured curve from -1 in standard deviations.
    pub distance_sigmas: f64,
}

impl LowerMargin {
    /// The bound for a measured loop, with the model outside of its band. `None` if the poles of the control law cannot be
    /// computed.
    pub fn of(measured: &MeasuredLoop<'_>, model: &ClosedLoop) -> Option<LowerMargin> {
        let count = NyquistCount::of(measured, model)?;
        let bounds = in_band(measured).chain(outside_band(measured, model));
        let (margin, omega_rad_s) = bounds.fold((f64::INFINITY, f64::NAN), smaller);
        Some(LowerMargin {
            margin,
            at_hz: hz(omega_rad_s),
            stability: count.stability,
            distance_sigmas: count.distance_sigmas,
        })
    }
}

/// The smaller bound; one that is not a number counts as the smallest.
fn smaller(least: (f64, f64), found: (f64, f64)) -> (f64, f64) {
    match found.0 < least.0 || found.0.is_nan() {
        true => found,
        false => least,
    }
}

/// The bound and its frequency in rad/s at each frequency of the band.
fn in_band(measured: &MeasuredLoop<'_>) -> impl Iterator<Item = (f64, f64)> {
    let frequencies = measured.grid_rad_s().iter();
    frequencies.map(|w| {
        let loop_gain = measured.loop_gain(*w);
        let sigma = loop_gain.norm() * measured.relative_sigma(*w);
        ((loop_gain + 1.0).norm() - SIGMAS_95 * sigma, *w)
    })
}

/// |1 + L| and its frequency in rad/s below and above the band, by the model.
fn outside_band(
    measured: &MeasuredLoop<'_>,
    model: &ClosedLoop,
) -> impl Iterator<Item = (f64, f64)> {
    let (low, high) = measured.band_rad_s();
    let last = HIGHEST * model.nyquist_rad_s();
    let below = model.frequencies(LOWEST * low, low);
    let above = match high < last {
        true => model.frequencies(high, last),
        false => Vec::new(),
    };
    let frequencies = below.into_iter().chain(above);
    frequencies.map(|w| ((model.sampled_loop(w) + 1.0).norm(), w))
}
