//! What the loop runs: an excitation, or a controller with a reference.
//!
//! A program is made before the run and handed over whole; what it decides depends on the tick of its run and the
//! measurements alone, so that a recording can be replayed.

use crate::control::Controller;
use crate::excitation::{Excitation, Reference};

/// What a program decides in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Decision {
    /// Reference in metres, 0 where there is none.
    pub reference_m: f64,
    /// The current it asks for, in amperes.
    pub requested_a: f64,
    /// Neither quiet before nor after.
    pub active: bool,
}

/// Decides one command a tick.
pub trait Program: Send {
    /// The command at a tick of the run, counted from 0, with the position measured in it. *In the tick.*
    fn decide(&mut self, tick: u64, position_m: f64) -> Decision;

    /// Length of the run in ticks.
    fn ticks(&self) -> u64;
}

/// Drives the motor with an excitation, whatever the position.
pub struct Excite<E>(
    /// The excitation.
    pub E,
);

impl<E: Excitation> Program for Excite<E> {
    fn decide(&mut self, tick: u64, _position_m: f64) -> Decision {
        Decision {
            reference_m: 0.0,
            requested_a: self.0.current_a(tick),
            active: self.0.active(tick),
        }
    }

    fn ticks(&self) -> u64 {
        self.0.ticks()
    }
}

/// Rests at zero current for a while, then closes the loop where the stage rests: u = C (r - y), r = origin + reference.
///
/// The start is bumpless: the origin is the mean position over the rest, the controller starts from rest, and the
/// reference is relative to the origin, so no old set-point and no offset of the probe can make the stage jump.
pub struct Control {
    controller: Controller,
    reference: Box<dyn Reference>,
    settle_ticks: u64,
    closed_ticks: u64,
    origin_m: f64,
}

impl Control {
    /// A run of `settle_ticks` at rest (one at least) and `closed_ticks` with the loop closed.
    pub fn new(
        mut controller: Controller,
        reference: Box<dyn Reference>,
        settle_ticks: u64,
        closed_ticks: u64,
    ) -> Self {
        controller.reset();
        Control {
            controller,
            reference,
            settle_ticks: settle_ticks.max(1),
            closed_ticks,
            origin_m: 0.0,
        }
    }
}

impl Program for Control {
    fn decide(&mut self, tick: u64, position_m: f64) -> Decision {
        if tick < self.settle_ticks {
            self.origin_m += (position_m - self.origin_m) / (tick + 1) as f64;
            return Decision {
                reference_m: self.origin_m,
                requested_a: 0.0,
                active: false,
            };
        }
        let reference_m = self.origin_m + self.reference.at_m(tick - self.settle_ticks);
        Decision {
            reference_m,
            requested_a: self.controller.update(reference_m - position_m),
            active: true,
        }
    }

    fn ticks(&self) -> u64 {
        self.settle_ticks + self.closed_ticks
    }
}
