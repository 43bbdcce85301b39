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
use crate::ClosedLoop;
use crate::landmarks::{Peak, lowest};
use bench_base::estimate::SIGMAS_95;
use bench_base::units::hz;

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
        let bounds = [in_band(measured)].into_iter();
        let bounds = bounds.chain(outside_band(measured, model));
        let least = bounds.min_by(|a, b| a.value.total_cmp(&b.value))?;
        Some(LowerMargin {
            margin: least.value,
            at_hz: hz(least.rad_s),
            stability: count.stability,
            distance_sigmas: count.distance_sigmas,
        })
    }
}

/// The smallest bound in the band and its frequency.
fn in_band(measured: &MeasuredLoop<'_>) -> Peak {
    let bound = |w: f64| {
        let loop_gain = measured.loop_gain(w);
        let sigma = loop_gain.norm() * measured.relative_sigma(w);
        (loop_gain + 1.0).norm() - SIGMAS_95 * sigma
    };
    lowest(&bound, measured.grid_rad_s())
}

/// The smallest |1 + L| below and above the band, by the model, each with its frequency.
fn outside_band(measured: &MeasuredLoop<'_>, model: &ClosedLoop) -> impl Iterator<Item = Peak> {
    let (low, high) = measured.band_rad_s();
    let distance = |w: f64| (model.sampled_loop(w) + 1.0).norm();
    let last = HIGHEST * model.nyquist_rad_s();
    let below = lowest(&distance, &model.frequencies(LOWEST * low, low));
    let above = (high < last).then(|| lowest(&distance, &model.frequencies(high, last)));
    [Some(below), above].into_iter().flatten()
}
