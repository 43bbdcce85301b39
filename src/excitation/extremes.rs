//! What an excitation would do to stage and motor, by the model.

use super::Excitation;
use crate::config::Config;
use crate::plant::Sampled;

/// The extremes of an excitation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremes {
    /// Largest change of the current in amperes per second.
    pub slew_a_per_s: f64,
    /// Largest thermal current in amperes.
    pub thermal_a: f64,
    /// Largest travel in metres.
    pub travel_m: f64,
    /// The tick of the largest travel.
    pub travel_tick: u64,
}

impl Extremes {
    /// Runs the whole excitation through the model of the plant.
    pub fn of(excitation: &impl Excitation, config: &Config, plant: &Sampled) -> Extremes {
        let mut extremes = Extremes { slew_a_per_s: 0.0, thermal_a: 0.0, travel_m: 0.0, travel_tick: 0 };
        let (mut before_a, mut heat_a2, mut hottest_a2) = (0.0, 0.0, 0.0f64);
        let cooling = plant.period_s / config.motor.thermal_time_constant_s;
        let mut motion = plant.at_rest();
        for tick in 0..excitation.ticks() {
            let command_a = excitation.current_a(tick);
            extremes.slew_a_per_s = extremes.slew_a_per_s.max((command_a - before_a).abs() / plant.period_s);
            before_a = command_a;
            heat_a2 += cooling * (command_a * command_a - heat_a2);
            hottest_a2 = hottest_a2.max(heat_a2);
            plant.step(&mut motion, command_a, |_| 0.0);
            let position_m = plant.position_m(&motion).abs();
            if position_m > extremes.travel_m {
                (extremes.travel_m, extremes.travel_tick) = (position_m, tick);
            }
        }
        Extremes { thermal_a: hottest_a2.sqrt(), ..extremes }
    }
}
