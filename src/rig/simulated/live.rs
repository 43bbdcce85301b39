//! The stage in real time: set-points act when they come, and the position is told for any moment up to now.

use std::collections::VecDeque;

use super::course::{Course, Passed};
use crate::config::Config;
use crate::model::plant::PlantError;

/// Length of a step: the fastest mode, at 284 Hz, turns by a third of a radian, and a cubic between two steps misses its
/// amplitude by 4e-5. Where the stop may be touched, the stage takes finer steps by itself.
const STEP_S: f64 = 200e-6;
/// Steps of the past that are kept, for who asks a little late: 0.1 s.
const KEPT: usize = 500;

/// A stage that is carried on to whatever moment is asked for. Times are in seconds since it was made.
#[derive(Clone, Debug)]
pub struct LiveStage {
    course: Course,
    /// Steps done.
    done: u64,
    /// The latest of them.
    past: VecDeque<Passed>,
}

impl LiveStage {
    /// The stage of a configuration, at rest, with its floor and its stop.
    pub fn new(config: &Config) -> Result<Self, PlantError> {
        Ok(LiveStage {
            course: Course::new(config, STEP_S, 0.0)?,
            done: 0,
            past: VecDeque::with_capacity(KEPT + 1),
        })
    }

    /// Takes a set-point that acts from `time_s` on; in what has passed already nothing changes.
    pub fn command(&mut self, time_s: f64, current_a: f64) {
        self.course.push(time_s / STEP_S, current_a);
    }

    /// Where the stage is at `time_s`, in metres. What is older than is kept is where it was when the record begins.
    pub fn position_m(&mut self, time_s: f64) -> f64 {
        let time = self.advance(time_s);
        self.step_at(time)
            .map_or(0.0, |step| step.position_m(time.max(step.from)))
    }

    /// The current at the end of the step in which `time_s` lies, in amperes.
    pub fn current_a(&mut self, time_s: f64) -> f64 {
        let time = self.advance(time_s);
        self.step_at(time).map_or(0.0, |step| step.current_a)
    }

    /// Carries the stage on until `time_s`; returns that time in steps.
    fn advance(&mut self, time_s: f64) -> f64 {
        let time = time_s / STEP_S;
        while self.past.back().is_none_or(|step| step.to < time) {
            self.past.push_back(self.course.pass(self.done));
            self.done += 1;
            if self.past.len() > KEPT {
                self.past.pop_front();
            }
        }
        time
    }

    /// The step in which `time` lies, or the oldest that is kept.
    fn step_at(&self, time: f64) -> Option<&Passed> {
        let after = self.past.partition_point(|step| step.to < time);
        self.past.get(after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Source, load};

    fn quiet() -> LiveStage {
        let mut config = load(&Source::default()).expect("the profile is valid");
        config.sim.floor.clear();
        LiveStage::new(&config).expect("a stage")
    }

    #[test]
    fn a_constant_current_ends_at_the_static_deflection() {
        let mut stage = quiet();
        stage.command(0.0, 0.1);
        // Slowest mode: damping 0.009 at 184 rad/s, 20 s are 33 time constants.
        let ends_m: Vec<f64> = (1..=1000)
            .map(|k| stage.position_m(20.0 + 1e-3 * f64::from(k)))
            .collect();
        let mean_m = ends_m.iter().sum::<f64>() / ends_m.len() as f64;
        assert!(ends_m.iter().all(|x| (x - mean_m).abs() < 1e-9), "at rest");
        assert!(
            (mean_m - 15e-6).abs() < 2e-6,
            "0.1 A, 1.1 N, 74 kN/m: {mean_m}"
        );
        assert!((stage.current_a(21.0) - 0.1).abs() < 1e-9);
    }

    #[test]
    fn the_past_is_told_as_it_was_whoever_asked_for_the_present_first() {
        let (mut in_order, mut out_of_order) = (quiet(), quiet());
        for stage in [&mut in_order, &mut out_of_order] {
            stage.command(0.01, 1.0);
        }
        let moments = [0.0101, 0.01234, 0.0219, 0.05];
        let straight = moments.map(|time_s| in_order.position_m(time_s));
        out_of_order.position_m(0.06);
        assert_eq!(
            straight,
            moments.map(|time_s| out_of_order.position_m(time_s))
        );
        assert!(straight[3].abs() > 1e-6, "it moves");
    }

    #[test]
    fn between_two_steps_the_position_has_no_jump() {
        let mut stage = quiet();
        stage.command(0.0, 1.0);
        let x: Vec<f64> = (0..10_000)
            .map(|k| stage.position_m(1e-6 * f64::from(k)))
            .collect();
        let speed = |i: usize| x[i + 1] - x[i];
        // At most 11 N on 0.4 kg: 28 m/s^2, 28e-12 m a us^2; the cubics stay within a few of it.
        assert!((1..9_998).all(|i| (speed(i + 1) - speed(i)).abs() < 2e-10));
    }

    #[test]
    fn what_is_too_long_ago_is_told_by_the_oldest_that_is_kept() {
        let mut stage = quiet();
        stage.command(0.0, 1.0);
        stage.position_m(1.0);
        let oldest_m = stage.position_m(0.0);
        assert_eq!(oldest_m, stage.position_m(0.5));
    }
}
