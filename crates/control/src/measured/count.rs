//! Stability by Nyquist's criterion, from a measured curve; `encirclements.rs` has the formula. Below and above the measured band the
//! curve is that of the model.

use nalgebra::Complex;
use serde::Serialize;

use super::measured_loop::MeasuredLoop;
use crate::ClosedLoop;
use crate::encirclements::{turn_rad, unstable_poles};

/// The curve must pass -1 at this distance in standard deviations for a decision: 1 in 3000 by chance, at one frequency.
const DECIDED_SIGMAS: f64 = 4.0;

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
        let unstable_poles = unstable_poles(open, turn_rad(curve(measured, model)));
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
fn curve(measured: &MeasuredLoop<'_>, model: &ClosedLoop) -> Vec<Complex<f64>> {
    let (low, high) = measured.band_rad_s();
    let lowest = model.lowest_rad_s().min(0.1 * low);
    let first = model.asymptote_rad_s(lowest).unwrap_or(lowest);
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

/// The smallest |1 + L| in standard deviations.
fn distance_sigmas(measured: &MeasuredLoop<'_>) -> f64 {
    let distance = |w: &f64| {
        let loop_gain = measured.loop_gain(*w);
        (loop_gain + 1.0).norm() / (loop_gain.norm() * measured.relative_sigma(*w))
    };
    let distances = measured.grid_rad_s().iter().map(distance);
    distances.fold(f64::INFINITY, f64::min)
}
