//! How large a swept reference may be, by the model: the amplitudes of an identification in closed loop.
//!
//! ```text
//! command = C S r,  position = T r       A_r(f) = min(A_u(f)/|C S|, travel/|T|)
//! ```
//!
//! A_u is the amplitude that the chirp has in open loop, so that motor and amplifier are driven as there; where the plant
//! resonates, |C S| is small and the travel limits. Between two points the least around them counts. Where a slow loop hardly
//! answers its reference, both would ask for metres of it: it stays below a largest amplitude of its own.

use std::f64::consts::PI;

use super::ClosedLoop;
use crate::config::{ChirpSettings, TravelPoint};
use crate::excitation::Amplitude;

/// Points over the band; a configuration holds 64.
const POINTS: usize = 48;
/// Frequencies at which the loop is looked at between two points.
const BETWEEN: usize = 32;

/// The amplitudes in metres over the band of `chirp`, whose own are those of the command in amperes; the stage moves by
/// `travel_m` at most, and no amplitude is above `most_m`.
pub fn swept_reference_amplitudes(
    closed_loop: &ClosedLoop,
    chirp: &ChirpSettings,
    travel_m: f64,
    most_m: f64,
) -> Vec<TravelPoint> {
    let (low_hz, high_hz) = chirp.band_hz();
    let amplitude = Amplitude::new(&chirp.amplitude);
    let at = |x: f64| low_hz * libm::pow(high_hz / low_hz, x);
    let step = 1.0 / (POINTS - 1) as f64;
    let near = |i: usize| {
        (0..=2 * BETWEEN)
            .map(move |j| (i as f64 - 1.0 + j as f64 / BETWEEN as f64) * step)
            .map(|x| x.clamp(0.0, 1.0))
    };
    let least = |i: usize| {
        near(i)
            .map(|x| allowed(closed_loop, &amplitude, travel_m, at(x)))
            .fold(most_m, f64::min)
    };
    (0..POINTS)
        .map(|i| TravelPoint {
            frequency_hz: at(i as f64 * step),
            amplitude_m: least(i),
        })
        .collect()
}

/// The reference's amplitude that moves command and position as far as they may, but never further than they.
fn allowed(closed_loop: &ClosedLoop, command: &Amplitude, travel_m: f64, frequency_hz: f64) -> f64 {
    let omega_rad_s = 2.0 * PI * frequency_hz;
    let (plant, loop_gain) = (
        closed_loop.sampled_plant(omega_rad_s),
        closed_loop.sampled_loop(omega_rad_s),
    );
    let complementary = loop_gain / (loop_gain + 1.0);
    let by_command_m = command.at(libm::log(frequency_hz)) * (plant / complementary).norm();
    by_command_m.min(travel_m / complementary.norm())
}
