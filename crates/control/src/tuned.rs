//! A control law with another loop gain.

use nalgebra::Complex;

use super::law::{ControlDesign, ControlLaw, LawInput, LinearLaw, OpenLoopPoles};
use super::state_space::StateSpace;

/// A design whose loop gain is `gain` times that of another one (see [`LawInput::with_gain`]).
pub struct TunedDesign {
    /// The other design.
    pub design: Box<dyn ControlDesign>,
    /// Factor of the loop gain.
    pub gain: f64,
}

struct TunedLaw {
    law: Box<dyn ControlLaw>,
    gain: f64,
}

struct TunedLinearLaw {
    linear: Box<dyn LinearLaw>,
    gain: f64,
}

impl ControlDesign for TunedDesign {
    fn law(&self, period_s: f64) -> Box<dyn ControlLaw> {
        Box::new(TunedLaw {
            law: self.design.law(period_s),
            gain: self.gain,
        })
    }
}

impl ControlLaw for TunedLaw {
    fn reset(&mut self, rest_m: f64) {
        self.law.reset(rest_m);
    }

    fn update(&mut self, input: &LawInput) -> f64 {
        self.law.update(&input.with_gain(self.gain))
    }

    fn linear(&self) -> Option<Box<dyn LinearLaw>> {
        let tuned = TunedLinearLaw {
            linear: self.law.linear()?,
            gain: self.gain,
        };
        Some(Box::new(tuned))
    }
}

impl LinearLaw for TunedLinearLaw {
    fn state_space(&self) -> Option<StateSpace> {
        let law = self.linear.state_space()?;
        Some(StateSpace {
            c: law.c * self.gain,
            d: law.d * self.gain,
            ..law
        })
    }

    fn open_loop_poles(&self) -> Option<OpenLoopPoles> {
        self.linear.open_loop_poles()
    }

    fn delay_ticks(&self) -> usize {
        self.linear.delay_ticks()
    }

    fn response(&self, z: Complex<f64>) -> Complex<f64> {
        self.linear.response(z) * self.gain
    }

    fn roots(&self) -> Vec<Complex<f64>> {
        self.linear.roots()
    }
}
