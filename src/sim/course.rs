//! Set-points and the stage that they move: by whole periods, or in fine steps with every moment between them.

use super::setpoints::Setpoints;
use super::stage::{Place, Stage};
use crate::config::Config;
use crate::plant::PlantError;

/// The stage under its set-points. Times are in ticks since the start.
#[derive(Clone, Debug)]
pub(super) struct Course {
    stage: Stage,
    setpoints: Setpoints,
}

/// A fine step, and where the stage was during it.
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
        self.before.towards(&self.after, self.length_s, (time - self.from) / (self.to - self.from))
    }
}

impl Course {
    /// At rest, without set-points; room for what `delay_ticks` hold back.
    pub(super) fn new(config: &Config, delay_ticks: f64) -> Result<Self, PlantError> {
        let stage = Stage::new(config, &super::modes(config)?);
        Ok(Course { stage, setpoints: Setpoints::new(delay_ticks) })
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

    /// The period after `tick`, its set-point held.
    pub(super) fn advance(&mut self, tick: u64) {
        self.stage.advance(self.setpoints.at(tick as f64));
    }

    /// The fine step `step` of the period after `tick`; steps come in their order.
    pub(super) fn advance_finely(&mut self, tick: u64, step: usize) -> Passed {
        if step == 0 {
            self.stage.shake();
        }
        let at = |step: usize| tick as f64 + step as f64 / self.stage.fine_steps() as f64;
        let (from, to, before) = (at(step), at(step + 1), self.stage.place());
        self.stage.advance_finely(self.setpoints.mean(from, to));
        let (after, current_a, length_s) = (self.stage.place(), self.stage.current_a(), self.stage.fine_step_s());
        Passed { from, to, current_a, before, after, length_s }
    }
}
