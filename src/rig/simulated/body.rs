//! The plant of a rig whose constraints are not linearised.

use crate::config::Config;
use crate::model::plant::{
    Disturbance, ModalModel, PlantError, QuadraticSr4dof, QuadraticState, build,
};

/// A step turns the fastest mode by no more than this: its phase then errs by (0.02)^4/120 = 1.3e-9 of itself, its size by
/// (0.02)^5/144 = 2e-11 a radian, against a damping ratio of 1e-3.
const LARGEST_TURN: f64 = 0.02;

/// The mechanism and its state.
#[derive(Clone, Debug)]
pub(super) struct Body {
    mechanism: QuadraticSr4dof,
    state: QuadraticState,
    fastest_rad_s: f64,
    lag_rad_s: f64,
    force_constant_n_per_a: f64,
}

impl Body {
    /// At rest at the operating point.
    pub(super) fn new(config: &Config) -> Result<Body, PlantError> {
        let made = super::actual_plant(config);
        let linear = ModalModel::of(&build(&made)?)?;
        Ok(Body {
            mechanism: QuadraticSr4dof::of(&made)?,
            state: QuadraticState::default(),
            fastest_rad_s: linear
                .modes
                .iter()
                .map(|mode| mode.omega_rad_s)
                .fold(0.0, f64::max),
            lag_rad_s: 2.0 * std::f64::consts::PI * config.amplifier.bandwidth_hz,
            force_constant_n_per_a: config.motor.force_constant_n_per_a,
        })
    }

    /// Steps that a period needs.
    pub(super) fn steps(&self, period_s: f64) -> usize {
        libm::ceil(period_s * self.fastest_rad_s / LARGEST_TURN) as usize
    }

    /// x1 in metres.
    pub(super) fn position_m(&self) -> f64 {
        self.state.place[0]
    }

    /// x1' in metres per second.
    pub(super) fn velocity_m_per_s(&self) -> f64 {
        self.state.rate[0]
    }

    /// One step: the current goes from `current_a` towards the set-point as the amplifier has it.
    pub(super) fn step(&mut self, step_s: f64, current_a: f64, setpoint_a: f64, load: Disturbance) {
        let after = |span_s: f64| {
            setpoint_a + (current_a - setpoint_a) * libm::exp(-self.lag_rad_s * span_s)
        };
        let force_n = [current_a, after(0.5 * step_s), after(step_s)]
            .map(|a| a * self.force_constant_n_per_a);
        self.mechanism.step(&mut self.state, step_s, force_n, load);
    }
}
