//! What an excitation would do to stage and motor, by the model.

use super::Excitation;
use crate::config::Config;
use crate::model::plant::DiscretePlant;

/// The extremes of an excitation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    pub fn of(
        excitation: &(impl Excitation + ?Sized),
        config: &Config,
        plant: &DiscretePlant,
    ) -> Extremes {
        let mut motion = plant.at_rest();
        let course = (0..excitation.ticks()).map(|tick| {
            let command_a = excitation.current_a(tick);
            plant.step(&mut motion, command_a, |_| 0.0);
            (command_a, plant.position_m(&motion))
        });
        Extremes::over(course, config)
    }

    /// Of a course of command (A) and position (m), one pair a tick.
    pub fn over(course: impl Iterator<Item = (f64, f64)>, config: &Config) -> Extremes {
        let period_s = config.servo.period_s();
        let cooling = period_s / config.motor.thermal_time_constant_s;
        let (mut before_a, mut square_a2, mut heat_a2, mut ticks) = (0.0, 0.0, 0.0, 0);
        let mut extremes = Extremes::default();
        for (tick, (command_a, position_m)) in (0..).zip(course) {
            extremes.current_a = extremes.current_a.max(command_a.abs());
            extremes.slew_a_per_s = extremes
                .slew_a_per_s
                .max((command_a - before_a).abs() / period_s);
            before_a = command_a;
            square_a2 += command_a * command_a;
            heat_a2 += cooling * (command_a * command_a - heat_a2);
            extremes.thermal_a = extremes.thermal_a.max(heat_a2.sqrt());
            if position_m.abs() > extremes.travel_m {
                (extremes.travel_m, extremes.travel_tick) = (position_m.abs(), tick);
            }
            ticks = tick + 1;
        }
        let rms_current_a = (square_a2 / ticks.max(1) as f64).sqrt();
        Extremes {
            rms_current_a,
            duration_s: ticks as f64 * period_s,
            ..extremes
        }
    }
}
