//! The motion of the stage under its set-points, at the steps and between them.

use super::setpoints::Setpoints;
use super::stage::{MotionState, Stage};

/// The stage and its set-points. Times are in periods since the start.
#[derive(Clone, Debug)]
pub(super) struct Trajectory {
    stage: Stage,
    setpoints: Setpoints,
}

/// The motion during one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub(super) from: f64,
    pub(super) to: f64,
    /// Current at the end, in amperes.
    pub(super) current_a: f64,
    before: MotionState,
    after: MotionState,
    length_s: f64,
}

impl Interval {
    /// Displacement at a time of the interval, in metres.
    pub(super) fn position_m(&self, time: f64) -> f64 {
        self.before.interpolate(
            &self.after,
            self.length_s,
            (time - self.from) / (self.to - self.from),
        )
    }
}

impl Trajectory {
    /// The motion of a stage, with capacity for the set-points of `delay` periods.
    pub(super) fn new(stage: Stage, delay: f64) -> Self {
        Trajectory {
            stage,
            setpoints: Setpoints::new(delay),
        }
    }

    /// Adds a set-point that takes effect at `due`.
    pub(super) fn push(&mut self, due: f64, current_a: f64) {
        self.setpoints.push(due, current_a);
    }

    /// Removes all set-points; the current set-point is zero.
    pub(super) fn clear(&mut self) {
        self.setpoints.clear();
    }

    /// Displacement in metres.
    pub(super) fn position_m(&self) -> f64 {
        self.stage.position_m()
    }

    /// Fine steps per period.
    pub(super) fn fine_steps(&self) -> usize {
        self.stage.fine_steps()
    }

    /// Advances by the period `number`, with the set-point at its start.
    pub(super) fn advance(&mut self, number: u64) {
        self.stage.advance(self.setpoints.at(number as f64));
    }

    /// Advances by the period `number`, with the mean of its set-points.
    pub(super) fn advance_interval(&mut self, number: u64) -> Interval {
        let length_s = self.stage.period_s();
        self.step(number as f64, number as f64 + 1.0, length_s, Stage::advance)
    }

    /// Advances by the fine step `step` of the period `number`; the steps must be in order.
    pub(super) fn advance_interval_finely(&mut self, number: u64, step: usize) -> Interval {
        if step == 0 {
            self.stage.update_floor();
        }
        let at = |step: usize| number as f64 + step as f64 / self.stage.fine_steps() as f64;
        let (from, to, length_s) = (at(step), at(step + 1), self.stage.fine_step_s());
        self.step(from, to, length_s, Stage::advance_finely)
    }

    fn step(
        &mut self,
        from: f64,
        to: f64,
        length_s: f64,
        advance: fn(&mut Stage, f64),
    ) -> Interval {
        let before = self.stage.motion_state();
        advance(&mut self.stage, self.setpoints.mean(from, to));
        Interval {
            from,
            to,
            current_a: self.stage.current_a(),
            before,
            after: self.stage.motion_state(),
            length_s,
        }
    }
}
