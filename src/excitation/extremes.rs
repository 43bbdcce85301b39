//! What an excitation would do to stage and motor, by the model.

use super::Excitation;
use crate::config::Config;
use crate::plant::Sampled;

/// The extremes of an excitation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremes {
    /// Largest current in amperes.
    pub current_a: f64,
    /// RMS of the current in amperes over the whole run, quiet included.
    pub rms_current_a: f64,
    /// Largest change of the current in amperes per second.
    pub slew_a_per_s: f64,
    /// Largest thermal current in amperes.
    pub thermal_a: f64,
    /// Largest travel in metres.
    pub travel_m: f64,
    /// The tick of the largest travel.
    pub travel_tick: u64,
    /// Length of the run in seconds, quiet included.
    pub duration_s: f64,
}

impl Extremes {
    /// Runs the whole excitation through the model of the plant.
    pub fn of(excitation: &(impl Excitation + ?Sized), config: &Config, plant: &Sampled) -> Extremes {
        let ticks = excitation.ticks();
        let (mut current_a, mut slew_a_per_s, mut travel_m, mut travel_tick) = (0.0f64, 0.0f64, 0.0, 0);
        let (mut before_a, mut square_a2, mut heat_a2, mut hottest_a2) = (0.0, 0.0, 0.0, 0.0f64);
        let cooling = plant.period_s / config.motor.thermal_time_constant_s;
        let mut motion = plant.at_rest();
        for tick in 0..ticks {
            let command_a = excitation.current_a(tick);
            current_a = current_a.max(command_a.abs());
            slew_a_per_s = slew_a_per_s.max((command_a - before_a).abs() / plant.period_s);
            before_a = command_a;
            square_a2 += command_a * command_a;
            heat_a2 += cooling * (command_a * command_a - heat_a2);
            hottest_a2 = hottest_a2.max(heat_a2);
            plant.step(&mut motion, command_a, |_| 0.0);
            let position_m = plant.position_m(&motion).abs();
            if position_m > travel_m {
                (travel_m, travel_tick) = (position_m, tick);
            }
        }
        Extremes {
            current_a,
            rms_current_a: (square_a2 / ticks.max(1) as f64).sqrt(),
            slew_a_per_s,
            thermal_a: hottest_a2.sqrt(),
            travel_m,
            travel_tick,
            duration_s: ticks as f64 * plant.period_s,
        }
    }
}
