//! Step responses of a plant in closed loop, and what a reference of blocks makes of them.

use crate::ClosedLoop;

/// Responses of a closed loop to a unit step of its reference at tick 0.
#[derive(Clone, Debug, PartialEq)]
pub struct StepPlant {
    /// Reading at each tick, over the height of the step.
    pub position: Vec<f64>,
    /// Current at each tick in amperes per metre of the step.
    pub current_a_per_m: Vec<f64>,
    /// Its change from the tick before, in amperes per metre of the step.
    pub change_a_per_m: Vec<f64>,
}

impl StepPlant {
    /// The responses of a closed loop over `ticks`.
    pub fn of(closed_loop: &ClosedLoop, ticks: usize) -> StepPlant {
        let signals = closed_loop.signals(ticks, |_| 1.0);
        let (current_a_per_m, position): (Vec<f64>, Vec<f64>) = signals.unzip();
        let before = std::iter::once(&0.0).chain(&current_a_per_m);
        let change_a_per_m = current_a_per_m.iter().zip(before);
        StepPlant {
            change_a_per_m: change_a_per_m.map(|(now, before)| now - before).collect(),
            position,
            current_a_per_m,
        }
    }

    pub(super) fn is_finite(&self) -> bool {
        let position = self.position.iter();
        let mut values = position.chain(&self.current_a_per_m);
        !self.position.is_empty() && values.all(|value| value.is_finite())
    }
}

/// A signal's response to the blocks of a reference.
#[derive(Clone, Copy)]
pub(super) struct BlockResponse<'a> {
    pub step: &'a [f64],
    pub block_ticks: usize,
    pub blocks: usize,
}

impl BlockResponse<'_> {
    /// The step response `ticks` after the start of block `block`.
    fn after(&self, tick: usize, block: usize) -> f64 {
        let start = block * self.block_ticks;
        tick.checked_sub(start)
            .map_or(0.0, |after| self.step[after])
    }

    /// The part of the signal at a tick that is proportional to the value of block `block`.
    pub fn coefficient(&self, tick: usize, block: usize) -> f64 {
        self.after(tick, block) - self.after(tick, block + 1)
    }

    /// The part of the signal at a tick that the reference after the last block gives.
    pub fn rest(&self, tick: usize) -> f64 {
        self.after(tick, self.blocks)
    }

    /// The signal at a tick.
    pub fn at(&self, tick: usize, values: &[f64]) -> f64 {
        let begun = (tick / self.block_ticks + 1).min(values.len());
        let parts = values[..begun].iter().enumerate();
        parts.fold(self.rest(tick), |sum, (block, value)| {
            sum + value * self.coefficient(tick, block)
        })
    }
}
