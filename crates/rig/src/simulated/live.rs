//! The stage in real time: set-points take effect at any time, and the displacement is available for any time up to now.

use std::collections::VecDeque;

use super::stage::Stage;
use super::trajectory::{Interval, Trajectory};
use bench_config::Config;
use bench_plant::PlantError;

/// Length of a step. It is a third of a radian of the fastest mode at 284 Hz; the cubic between two steps then has a relative
/// error of 4e-5. Near the stop the stage uses finer steps.
const STEP_S: f64 = 200e-6;
/// Number of past steps that are stored: 0.1 s.
const STORED: usize = 500;

/// A stage that is advanced to the requested time. Times are in seconds since its creation.
#[derive(Clone, Debug)]
pub struct LiveStage {
    trajectory: Trajectory,
    /// Number of steps so far.
    done: u64,
    /// The latest steps.
    past: VecDeque<Interval>,
}

impl LiveStage {
    /// The configured stage, at rest.
    pub fn new(config: &Config) -> Result<Self, PlantError> {
        Ok(LiveStage {
            trajectory: Trajectory::new(Stage::new(config, STEP_S)?, 0.0),
            done: 0,
            past: VecDeque::with_capacity(STORED + 1),
        })
    }

    /// Adds a set-point that takes effect at `time_s`. The past does not change.
    pub fn command(&mut self, time_s: f64, current_a: f64) {
        self.trajectory.push(time_s / STEP_S, current_a);
    }

    /// Displacement at `time_s`, in metres; before the oldest stored step that of its beginning.
    pub fn position_m(&mut self, time_s: f64) -> f64 {
        let time = self.advance(time_s);
        self.step_at(time)
            .map_or(0.0, |step| step.position_m(time.max(step.from)))
    }

    /// Current at the end of the step that contains `time_s`, in amperes.
    pub fn current_a(&mut self, time_s: f64) -> f64 {
        let time = self.advance(time_s);
        self.step_at(time).map_or(0.0, |step| step.current_a)
    }

    /// Advances the stage to `time_s`; returns that time in steps.
    fn advance(&mut self, time_s: f64) -> f64 {
        let time = time_s / STEP_S;
        while self.past.back().is_none_or(|step| step.to < time) {
            self.past
                .push_back(self.trajectory.advance_interval(self.done));
            self.done += 1;
            if self.past.len() > STORED {
                self.past.pop_front();
            }
        }
        time
    }

    /// The step that contains `time`, or the oldest stored one.
    fn step_at(&self, time: f64) -> Option<&Interval> {
        let after = self.past.partition_point(|step| step.to < time);
        self.past.get(after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_config::{Source, load};

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
    fn the_past_does_not_depend_on_earlier_requests() {
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
    fn the_displacement_is_smooth_between_steps() {
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
    fn times_before_the_stored_steps_give_the_oldest_position() {
        let mut stage = quiet();
        stage.command(0.0, 1.0);
        stage.position_m(1.0);
        let oldest_m = stage.position_m(0.0);
        assert_eq!(oldest_m, stage.position_m(0.5));
    }
}
