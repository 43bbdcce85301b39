//! Set-points and the stage that they move, with every moment between two steps.

use super::setpoints::Setpoints;
use super::stage::{Place, Stage};
use crate::config::Config;
use crate::model::plant::PlantError;

/// The stage under its set-points. Times are in periods since the start.
#[derive(Clone, Debug)]
pub(super) struct Course {
    stage: Stage,
    setpoints: Setpoints,
}

/// A step, and where the stage was during it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passed {
    pub(super) from: f64,
    pub(super) to: f64,
    /// Current at its end, in amperes.
    pub(super) current_a: f64,
    before: Place,
    after: Place,
    length_s: f64,
}

impl Passed {
    /// Where the stage was at a time of the step, in metres.
    pub(super) fn position_m(&self, time: f64) -> f64 {
        self.before.towards(
            &self.after,
            self.length_s,
            (time - self.from) / (self.to - self.from),
        )
    }
}

impl Course {
    /// At rest, to be carried by periods of `period_s`; room for the set-points that `delay` periods hold back.
    pub(super) fn new(config: &Config, period_s: f64, delay: f64) -> Result<Self, PlantError> {
        let stage = super::stage(config, period_s)?;
        Ok(Course {
            stage,
            setpoints: Setpoints::new(delay),
        })
    }

    /// Takes a set-point that acts from `due`.
    pub(super) fn push(&mut self, due: f64, current_a: f64) {
        self.setpoints.push(due, current_a);
    }

    /// No set-point, and none to come.
    pub(super) fn clear(&mut self) {
        self.setpoints.clear();
    }

    /// Where the stage is, in metres.
    pub(super) fn position_m(&self) -> f64 {
        self.stage.position_m()
    }

    /// Fine steps in a period.
    pub(super) fn fine_steps(&self) -> usize {
        self.stage.fine_steps()
    }

    /// The period `number`, the set-point at its start held.
    pub(super) fn advance(&mut self, number: u64) {
        self.stage.advance(self.setpoints.at(number as f64));
    }

    /// The period `number`, with the mean of the set-points during it.
    pub(super) fn pass(&mut self, number: u64) -> Passed {
        let length_s = self.stage.period_s();
        self.step(number as f64, number as f64 + 1.0, length_s, Stage::advance)
    }

    /// The fine step `step` of the period `number`; steps come in their order.
    pub(super) fn pass_finely(&mut self, number: u64, step: usize) -> Passed {
        if step == 0 {
            self.stage.shake();
        }
        let at = |step: usize| number as f64 + step as f64 / self.stage.fine_steps() as f64;
        let (from, to, length_s) = (at(step), at(step + 1), self.stage.fine_step_s());
        self.step(from, to, length_s, Stage::advance_finely)
    }

    fn step(&mut self, from: f64, to: f64, length_s: f64, advance: fn(&mut Stage, f64)) -> Passed {
        let before = self.stage.place();
        advance(&mut self.stage, self.setpoints.mean(from, to));
        Passed {
            from,
            to,
            current_a: self.stage.current_a(),
            before,
            after: self.stage.place(),
            length_s,
        }
    }
}
