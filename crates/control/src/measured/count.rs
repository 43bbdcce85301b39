//! Stability by Nyquist's criterion, from a measured curve.
//!
//! F = 1 + L along z = exp(j w T) from w = 0+ to pi/T turns by D. F has as many zeros as poles, the zeros being the poles of the
//! closed loop. The contour passes outside of the q poles at z = 1 (a small half circle, on the upper half of which F turns by
//! -q pi/2). With U poles of the open loop outside the unit circle, the number of unstable poles of the closed loop is
//!
//! ```text
//! Z = U - (D - q pi/2)/pi
//! ```
//!
//! (H. Nyquist, Bell System Technical Journal 11, 1932.) Below and above the measured band the curve is that of the model.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Complex;
use serde::Serialize;

use super::measured_loop::MeasuredLoop;
use crate::ClosedLoop;

/// The curve must pass -1 at this distance in standard deviations for a decision: 1 in 3000 by chance, at one frequency.
const DECIDED_SIGMAS: f64 = 4.0;
/// The curve begins where |L| of a loop with integrators is at least this ...
const LARGE_LOOP_GAIN: f64 = 100.0;
/// ... and at most this many decades below the lowest frequency of interest.
const DECADES_BELOW: i32 = 12;

/// Whether the loop is stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stability {
    /// No pole of the closed loop is unstable.
    Stable,
    /// Some are.
    Unstable,
    /// The measured curve passes -1 so closely that noise may change the count.
    Undecided,
}

/// Unstable poles of the closed loop by the Nyquist curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NyquistCount {
    /// Whether the loop is stable.
    pub stability: Stability,
    /// Number of unstable poles of the closed loop.
    pub unstable_poles: i64,
    /// Smallest distance of the measured curve from -1, in standard deviations of its radius.
    pub distance_sigmas: f64,
}

impl NyquistCount {
    /// The count for a measured loop, with the model outside of its band. `None` if the poles of the control law cannot be
    /// computed.
    pub fn of(measured: &MeasuredLoop<'_>, model: &ClosedLoop) -> Option<NyquistCount> {
        let open = model.open_loop_poles()?;
        let curve = curve(measured, model, open.integrators > 0);
        let turned = turn(&curve) - open.integrators as f64 * FRAC_PI_2;
        let unstable_poles = open.unstable as i64 - libm::round(turned / PI) as i64;
        let distance_sigmas = distance_sigmas(measured);
        let stability = match unstable_poles {
            _ if distance_sigmas < DECIDED_SIGMAS => Stability::Undecided,
            0 => Stability::Stable,
            _ => Stability::Unstable,
        };
        Some(NyquistCount {
            stability,
            unstable_poles,
            distance_sigmas,
        })
    }
}

/// F from low frequencies to half the sampling rate.
fn curve(
    measured: &MeasuredLoop<'_>,
    model: &ClosedLoop,
    has_integrator: bool,
) -> Vec<Complex<f64>> {
    let (low, high) = measured.band_rad_s();
    let first = first_rad_s(model, low, has_integrator);
    let by_model = |from, to| {
        let frequencies = model.frequencies(from, to).into_iter();
        frequencies.map(|w| model.sampled_loop(w) + 1.0)
    };
    let inside = measured.grid_rad_s().iter();
    by_model(first, low)
        .chain(inside.map(|w| measured.loop_gain(*w) + 1.0))
        .chain(by_model(high, model.nyquist_rad_s() * (1.0 - 1e-9)))
        .collect()
}

/// A frequency below the band at which the model is at its asymptote.
fn first_rad_s(model: &ClosedLoop, low_rad_s: f64, has_integrator: bool) -> f64 {
    let lowest = model.lowest_rad_s().min(0.1 * low_rad_s);
    let decades = 0..=DECADES_BELOW;
    let candidates = decades.map(|decade| lowest * libm::pow(10.0, -f64::from(decade)));
    let is_asymptote =
        |w: &f64| !has_integrator || model.sampled_loop(*w).norm() >= LARGE_LOOP_GAIN;
    candidates.clone().find(is_asymptote).unwrap_or(lowest)
}

/// The angle by which a curve turns about the origin.
fn turn(curve: &[Complex<f64>]) -> f64 {
    let steps = curve.windows(2);
    steps.map(|pair| (pair[1] / pair[0]).arg()).sum()
}

/// The smallest |1 + L| in standard deviations.
fn distance_sigmas(measured: &MeasuredLoop<'_>) -> f64 {
    let distance = |w: &f64| {
        let loop_gain = measured.loop_gain(*w);
        (loop_gain + 1.0).norm() / (loop_gain.norm() * measured.relative_sigma(*w))
    };
    let distances = measured.grid_rad_s().iter().map(distance);
    distances.fold(f64::INFINITY, f64::min)
}
