//! The end of a run without a step of the current: reference and current go to zero along ramps.
//!
//! Two ramps of equal length follow each other. In the first one the program goes on, with reference and excitation scaled by
//! the ramp; a closed loop stays closed. In the second one the loop is open, and what is left of the current is scaled by the
//! ramp. The shape is the cycloid
//!
//! s(x) = 1 - x + sin(2 pi x) / (2 pi), 0 <= x <= 1,
//!
//! with zero slope and curvature at both ends. After a ramp of length T, a mode of frequency f without damping that followed the
//! current swings with
//!
//! |sin(pi f T)| / (pi f T |1 - (f T)^2|)
//!
//! of its deflection before: 0 for f T = 2, 3, ..., and at most 2.5 % for f T >= 2.5.

use std::f64::consts::TAU;

/// The ramps of a run that ends.
#[derive(Clone, Copy, Debug)]
pub struct Settling {
    ramp_ticks: u64,
    tick: u64,
    done: bool,
    /// Current in amperes at the end of the first ramp.
    left_a: f64,
}

/// What drives the motor in a tick of [`Settling`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SettlingStep {
    /// The program, with reference and excitation scaled by this factor.
    Program {
        /// Factor from 1 to 0.
        scale: f64,
    },
    /// A current in amperes, in open loop.
    Current(f64),
    /// Nothing: the ramps have ended.
    Done,
}

impl Settling {
    /// Two ramps of `ramp_ticks` each.
    pub fn new(ramp_ticks: u64) -> Self {
        Settling {
            ramp_ticks,
            tick: 0,
            done: false,
            left_a: 0.0,
        }
    }

    /// The next step. `requested_a`: the current in amperes that was requested in the tick before.
    pub fn next(&mut self, requested_a: f64) -> SettlingStep {
        self.tick += 1;
        if self.tick <= self.ramp_ticks {
            let scale = ramp(self.tick, self.ramp_ticks);
            return SettlingStep::Program { scale };
        }
        if self.tick == self.ramp_ticks + 1 {
            self.left_a = requested_a;
        }
        let tick = self.tick - self.ramp_ticks;
        self.done = tick >= self.ramp_ticks || self.left_a == 0.0;
        if self.done {
            SettlingStep::Done
        } else {
            SettlingStep::Current(self.left_a * ramp(tick, self.ramp_ticks))
        }
    }

    /// Whether the ramps have ended.
    pub fn is_done(&self) -> bool {
        self.done
    }
}

/// The factor after `tick` of `ticks` ticks: near 1 at first, 0 at the end.
pub(super) fn ramp(tick: u64, ticks: u64) -> f64 {
    if tick >= ticks {
        return 0.0;
    }
    let x = tick as f64 / ticks as f64;
    1.0 - x + libm::sin(TAU * x) / TAU
}
