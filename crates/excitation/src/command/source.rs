//! The interface between the program of a closed loop and its command.

use crate::waveform::Reference;

/// The command of a closed loop in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoopCommand {
    /// Reference in metres, relative to the rest position.
    pub reference_m: f64,
    /// Feedforward current in amperes, positive in the positive direction of the stage.
    pub feedforward_a: f64,
}

impl LoopCommand {
    /// The command times a factor.
    pub fn scaled(self, factor: f64) -> LoopCommand {
        LoopCommand {
            reference_m: factor * self.reference_m,
            feedforward_a: factor * self.feedforward_a,
        }
    }

    /// The request of the control law plus the feedforward current, in amperes.
    pub fn added_to(self, law_a: f64) -> f64 {
        match self.feedforward_a {
            // Not even the sign of a zero changes.
            0.0 => law_a,
            feedforward_a => law_a + feedforward_a,
        }
    }
}

/// The command of a closed loop over time, from the tick at which the loop closes.
pub trait CommandSource: Send {
    /// The command of a tick, counted from 0. It depends on the tick alone. Called in the tick: must not allocate or block.
    fn at(&mut self, tick: u64) -> LoopCommand;
}

/// A reference without filter and without feedforward.
pub struct Unfiltered(
    /// The reference.
    pub Box<dyn Reference>,
);

impl CommandSource for Unfiltered {
    fn at(&mut self, tick: u64) -> LoopCommand {
        LoopCommand {
            reference_m: self.0.at_m(tick),
            feedforward_a: 0.0,
        }
    }
}
