//! The section controller: a cascade of discrete sections, metres in, amperes out.

use nalgebra::Complex;

use super::law::{ControlDesign, ControlLaw, LawInput, LinearLaw};
use super::state_space::StateSpace;
use super::{Biquad, BiquadState, Section};
use bench_base::units::UM_PER_M;

/// Coefficients of a discrete controller u = C (r - y), a cascade of sections in amperes per micrometre. Immutable.
///
/// ```
/// use bench_control::{Controller, Section};
///
/// // A gain of 2 A/um: an error of 10 nm gives a command of 20 mA.
/// let gain = Section { numerator: [2.0, 0.0, 0.0], denominator: [1.0, 0.0, 0.0], prewarp_rad_s: None };
/// let controller = Controller::new(&[gain], 1e-3);
/// let mut state = controller.at_rest();
/// assert!((controller.update(&mut state, 10e-9) - 0.020).abs() < 1e-15);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Controller {
    sections: Vec<Biquad>,
}

/// The state of each section of a [`Controller`].
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerState(Vec<BiquadState>);

impl Controller {
    /// Discretises continuous sections for a loop of period T, one by one (Tustin).
    pub fn new(sections: &[Section], period_s: f64) -> Controller {
        let discrete = sections.iter().map(|section| section.tustin(period_s));
        Controller::of_biquads(discrete.collect())
    }

    /// A cascade of discrete sections in amperes per micrometre, for the loop for which they were designed.
    pub fn of_biquads(sections: Vec<Biquad>) -> Controller {
        Controller { sections }
    }

    /// The state at rest. A change to coefficients of as many sections may keep the state: it is then bumpless.
    pub fn at_rest(&self) -> ControllerState {
        ControllerState(vec![BiquadState::default(); self.sections.len()])
    }

    /// The command in amperes for the error r - y in metres. Runs in the tick: must not allocate or block.
    pub fn update(&self, state: &mut ControllerState, error_m: f64) -> f64 {
        let sections = self.sections.iter().zip(&mut state.0);
        sections.fold(error_m * UM_PER_M, |x, (section, state)| {
            section.update(state, x)
        })
    }
}

impl LinearLaw for Controller {
    fn state_space(&self) -> Option<StateSpace> {
        let gain = StateSpace::gain(UM_PER_M);
        let sections = self.sections.iter();
        Some(sections.fold(gain, |cascade, section| {
            cascade.then(&StateSpace::from(section))
        }))
    }

    fn response(&self, z: Complex<f64>) -> Complex<f64> {
        let sections = self.sections.iter().map(|section| section.response(z));
        sections.product::<Complex<f64>>() * UM_PER_M
    }

    fn roots(&self) -> Vec<Complex<f64>> {
        self.sections.iter().flat_map(Biquad::roots).collect()
    }
}

/// A [`Controller`] with its state: the control law u = C (r - y).
#[derive(Clone, Debug, PartialEq)]
pub struct SectionController {
    controller: Controller,
    state: ControllerState,
}

impl SectionController {
    /// The control law at rest.
    pub fn new(controller: Controller) -> SectionController {
        let state = controller.at_rest();
        SectionController { controller, state }
    }
}

impl ControlLaw for SectionController {
    fn reset(&mut self, _rest_m: f64) {
        self.state.0.fill(BiquadState::default());
    }

    fn update(&mut self, input: &LawInput) -> f64 {
        let error_m = input.reference_m - input.position_m;
        self.controller.update(&mut self.state, error_m)
    }

    fn linear(&self) -> Option<Box<dyn LinearLaw>> {
        Some(Box::new(self.controller.clone()))
    }
}

impl ControlDesign for Vec<Section> {
    fn law(&self, period_s: f64) -> Box<dyn ControlLaw> {
        Box::new(SectionController::new(Controller::new(self, period_s)))
    }

    fn sections(&self) -> Option<&[Section]> {
        Some(self)
    }
}

/// C(s) in amperes per metre of continuous sections.
pub fn continuous_response(sections: &[Section], s: Complex<f64>) -> Complex<f64> {
    let responses = sections.iter().map(|section| section.response(s));
    responses.product::<Complex<f64>>() * UM_PER_M
}
