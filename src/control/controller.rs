//! A controller as the loop runs it: a cascade of discrete sections, metres in, amperes out.

use nalgebra::Complex;

use super::{Biquad, Section};

/// Sections take micrometres, the loop has metres.
const UM_PER_M: f64 = 1e6;

/// A discrete controller u = C (r - y).
#[derive(Clone, Debug, PartialEq)]
pub struct Controller {
    sections: Vec<Biquad>,
}

impl Controller {
    /// Discretises continuous sections, one by one.
    pub fn new(sections: &[Section], period_s: f64) -> Controller {
        Controller {
            sections: sections
                .iter()
                .map(|section| section.tustin(period_s))
                .collect(),
        }
    }

    /// The command in amperes for the error r - y in metres. *In the tick.*
    pub fn update(&mut self, error_m: f64) -> f64 {
        self.sections
            .iter_mut()
            .fold(error_m * UM_PER_M, |x, section| section.update(x))
    }

    /// Forgets the past: the first command after it is that of a controller at rest.
    pub fn reset(&mut self) {
        self.sections.iter_mut().for_each(Biquad::reset);
    }

    /// C(z) in amperes per metre.
    pub fn response(&self, z: Complex<f64>) -> Complex<f64> {
        self.sections
            .iter()
            .map(|section| section.response(z))
            .product::<Complex<f64>>()
            * UM_PER_M
    }

    /// The sections, first to last.
    pub fn sections(&self) -> &[Biquad] {
        &self.sections
    }
}

/// C(s) in amperes per metre of continuous sections.
pub fn continuous_response(sections: &[Section], s: Complex<f64>) -> Complex<f64> {
    sections
        .iter()
        .map(|section| section.response(s))
        .product::<Complex<f64>>()
        * UM_PER_M
}
