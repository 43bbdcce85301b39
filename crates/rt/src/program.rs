//! Programs of the loop: an excitation, or a control law with a reference.
//!
//! A program is made before the run and passed to the loop as a whole. Its decisions depend on the tick of its run and
//! the signals of [`ProgramInput`] alone, so that a recording can be replayed.

use super::tuning::Factors;
use bench_control::{ControlLaw, LawInput};
use bench_excitation::command::{CommandSource, LoopCommand, Unfiltered};
use bench_excitation::{Excitation, Reference};

/// Input of a program in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProgramInput {
    /// Tick of the run, counted from 0.
    pub tick: u64,
    /// Position in metres, measured in this tick.
    pub position_m: f64,
    /// Current in amperes that the amplifier gave for the previous tick.
    pub applied_a: f64,
    /// Factors of reference and loop gain.
    pub factors: Factors,
}

/// Output of a program in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Decision {
    /// Reference in metres, 0 where there is none.
    pub reference_m: f64,
    /// The requested current in amperes, feedforward included.
    pub requested_a: f64,
    /// The part of the request that is feedforward, in amperes: it does not depend on the position.
    pub feedforward_a: f64,
    /// Whether the excitation is on or the loop closed: false in the zero-current intervals before and after.
    pub active: bool,
}

/// Decides one command per tick.
pub trait Program: Send {
    /// The command of this tick. Called in the tick: must not allocate or block.
    fn decide(&mut self, input: &ProgramInput) -> Decision;

    /// The command of a tick in which the run ends (see [`settling`](super::settling)). `scale` falls from 1 to 0; at 0 the
    /// program must request what keeps the stage at rest. The tick of `input` stops at the last one of the program. Without
    /// an implementation of its own, a program's current is scaled. Called in the tick: must not allocate or block.
    fn settle(&mut self, input: &ProgramInput, scale: f64) -> Decision {
        let decision = self.decide(input);
        Decision {
            requested_a: scale * decision.requested_a,
            feedforward_a: scale * decision.feedforward_a,
            ..decision
        }
    }

    /// Length of the run in ticks. Called in the tick: must not allocate or block.
    fn ticks(&self) -> u64;

    /// Whether the program applies [`ProgramInput::factors`]. Called in the tick: must not allocate or block.
    fn is_tunable(&self) -> bool {
        false
    }
}

/// Drives the motor with an excitation, independently of the position.
pub struct Excite<E>(
    /// The excitation.
    pub E,
);

impl<E: Excitation> Program for Excite<E> {
    fn decide(&mut self, input: &ProgramInput) -> Decision {
        Decision {
            requested_a: self.0.current_a(input.tick),
            active: self.0.active(input.tick),
            ..Decision::default()
        }
    }

    fn ticks(&self) -> u64 {
        self.0.ticks()
    }
}

/// Applies zero current for the settling time, then closes the loop where the stage rests: r = rest position +
/// reference.
///
/// The start is bumpless: the rest position is the mean over the rest, the law starts from rest, and the reference is
/// relative to the rest position. No earlier set-point and no offset of the probe makes the stage jump.
///
/// The request is that of the law plus the feedforward current of the command. The factor of the reference applies to both.
pub struct Control {
    law: Box<dyn ControlLaw>,
    command: Box<dyn CommandSource>,
    settle_ticks: u64,
    closed_ticks: u64,
    rest_m: f64,
}

impl Control {
    /// A run of `settle_ticks` (at least one) at rest, followed by `closed_ticks` in closed loop, without feedforward.
    pub fn new(
        law: Box<dyn ControlLaw>,
        reference: Box<dyn Reference>,
        settle_ticks: u64,
        closed_ticks: u64,
    ) -> Self {
        let command = Box::new(Unfiltered(reference));
        Control::with_command(law, command, settle_ticks, closed_ticks)
    }

    /// As [`Control::new`], with a command that may contain a feedforward current.
    pub fn with_command(
        law: Box<dyn ControlLaw>,
        command: Box<dyn CommandSource>,
        settle_ticks: u64,
        closed_ticks: u64,
    ) -> Self {
        Control {
            law,
            command,
            settle_ticks: settle_ticks.max(1),
            closed_ticks,
            rest_m: 0.0,
        }
    }

    /// Takes the position into the mean over the rest.
    fn rest(&mut self, input: &ProgramInput) -> Decision {
        self.rest_m += (input.position_m - self.rest_m) / (input.tick + 1) as f64;
        Decision {
            reference_m: self.rest_m,
            ..Decision::default()
        }
    }

    /// A tick in closed loop. The reference of `command` is relative to the rest position.
    fn closed(&mut self, input: &ProgramInput, command: LoopCommand) -> Decision {
        let factors = input.factors;
        let command = command.scaled(factors.reference);
        let law_input = LawInput {
            reference_m: self.rest_m + command.reference_m,
            position_m: input.position_m,
            applied_a: input.applied_a,
        };
        let law_a = self.law.update(&law_input.with_gain(factors.gain));
        Decision {
            reference_m: law_input.reference_m,
            requested_a: command.added_to(law_a),
            feedforward_a: command.feedforward_a,
            active: true,
        }
    }
}

impl Program for Control {
    fn decide(&mut self, input: &ProgramInput) -> Decision {
        match input.tick.checked_sub(self.settle_ticks) {
            None => self.rest(input),
            Some(0) => {
                self.law.reset(self.rest_m);
                let command = self.command.at(0);
                self.closed(input, command)
            }
            Some(tick) => {
                let command = self.command.at(tick);
                self.closed(input, command)
            }
        }
    }

    /// The loop stays closed, its reference goes to the rest position, and the feedforward current to zero.
    fn settle(&mut self, input: &ProgramInput, scale: f64) -> Decision {
        match input.tick.checked_sub(self.settle_ticks) {
            None => Decision::default(),
            Some(tick) => {
                let command = self.command.at(tick).scaled(scale);
                self.closed(input, command)
            }
        }
    }

    fn ticks(&self) -> u64 {
        self.settle_ticks + self.closed_ticks
    }

    fn is_tunable(&self) -> bool {
        true
    }
}
