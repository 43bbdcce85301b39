//! Amplitude over frequency of a swept reference, planned with the model: for an identification in closed loop.
//!
//! ```text
//! command = C S r,  position = T r       A_r(f) = min(A_u(f)/|C S|, travel/|T|)
//! ```
//!
//! A_u is the amplitude of the chirp in open loop: motor and amplifier are driven as there. At a resonance of the plant
//! |C S| is small, and the travel is the limit. Each point has the smallest value between its two neighbours. Far above its
//! bandwidth a slow loop hardly follows, and both limits would allow metres: the amplitude of the reference is limited too.

use super::ClosedLoop;
use bench_base::units::rad_s;
use bench_excitation::{AmplitudeCurve, ChirpSettings, TravelPoint};

/// Number of points over the band; a configuration allows up to 64.
const POINTS: usize = 48;
/// Frequencies at which the loop is evaluated between two points.
const FREQUENCIES_BETWEEN_POINTS: usize = 32;

/// Limits of a swept reference.
#[derive(Clone, Debug)]
pub struct SweptLimits<'a> {
    /// Band and open-loop amplitude of the command.
    pub chirp: &'a ChirpSettings,
    /// Largest amplitude of the position in metres.
    pub travel_m: f64,
    /// Largest amplitude of the reference in metres.
    pub reference_m: f64,
}

/// The amplitudes in metres over the band of the chirp.
pub fn swept_reference_amplitudes(
    closed_loop: &ClosedLoop,
    limits: &SweptLimits<'_>,
) -> Vec<TravelPoint> {
    let command = AmplitudeCurve::of_current(&limits.chirp.amplitude);
    let (low_hz, high_hz) = limits.chirp.band_hz();
    let frequency_hz = |x: f64| low_hz * libm::pow(high_hz / low_hz, x);
    (0..POINTS)
        .map(|point| TravelPoint {
            frequency_hz: frequency_hz(point as f64 * STEP),
            amplitude_m: neighbourhood(point)
                .map(|x| allowed_m(closed_loop, &command, limits.travel_m, frequency_hz(x)))
                .fold(limits.reference_m, f64::min),
        })
        .collect()
}

/// Distance of two points as a ratio of the band.
const STEP: f64 = 1.0 / (POINTS - 1) as f64;

/// Places in the band from the point before to the point after, as ratios of the band.
fn neighbourhood(point: usize) -> impl Iterator<Item = f64> {
    (0..=2 * FREQUENCIES_BETWEEN_POINTS)
        .map(move |j| (point as f64 - 1.0 + j as f64 / FREQUENCIES_BETWEEN_POINTS as f64) * STEP)
        .map(|x| x.clamp(0.0, 1.0))
}

/// The largest amplitude of the reference for which neither command nor position exceeds its limit.
fn allowed_m(
    closed_loop: &ClosedLoop,
    command: &AmplitudeCurve,
    travel_m: f64,
    frequency_hz: f64,
) -> f64 {
    let omega_rad_s = rad_s(frequency_hz);
    let plant = closed_loop.sampled_plant(omega_rad_s);
    let loop_gain = closed_loop.sampled_loop(omega_rad_s);
    let complementary = loop_gain / (loop_gain + 1.0);
    let by_command_m = command.at(libm::log(frequency_hz)) * (plant / complementary).norm();
    by_command_m.min(travel_m / complementary.norm())
}
