//! The plant with constraints that are not linearised.

use super::drive::Drive;
use bench_config::PlantSettings;
use bench_plant::{Disturbance, ModalModel, PlantError, QuadraticSr4dof, QuadraticState, build};

/// Largest phase of the fastest mode per step, in radians. The relative error of the phase is then (0.02)^4/120 = 1.3e-9, and
/// that of the amplitude (0.02)^5/144 = 2e-11 per radian, with a damping ratio of 1e-3.
const MAX_PHASE_RAD: f64 = 0.02;

/// The mechanism and its state.
#[derive(Clone, Debug)]
pub(super) struct NonlinearPlant {
    mechanism: QuadraticSr4dof,
    state: QuadraticState,
    fastest_rad_s: f64,
    lag_rad_s: f64,
    force_constant_n_per_a: f64,
}

impl NonlinearPlant {
    /// The plant at rest at the operating point.
    pub(super) fn new(plant: &PlantSettings, drive: Drive) -> Result<NonlinearPlant, PlantError> {
        let linear = ModalModel::of(&build(plant)?)?;
        let frequencies_rad_s = linear.modes.iter().map(|mode| mode.omega_rad_s);
        Ok(NonlinearPlant {
            mechanism: QuadraticSr4dof::of(plant)?,
            state: QuadraticState::default(),
            fastest_rad_s: frequencies_rad_s.fold(0.0, f64::max),
            lag_rad_s: std::f64::consts::TAU * drive.bandwidth_hz,
            force_constant_n_per_a: drive.force_constant_n_per_a,
        })
    }

    /// Number of steps that a period needs.
    pub(super) fn steps(&self, period_s: f64) -> usize {
        libm::ceil(period_s * self.fastest_rad_s / MAX_PHASE_RAD) as usize
    }

    /// x1 in metres.
    pub(super) fn position_m(&self) -> f64 {
        self.state.place[0]
    }

    /// x1' in metres per second.
    pub(super) fn velocity_m_per_s(&self) -> f64 {
        self.state.rate[0]
    }

    /// Advances by one step. The current approaches the set-point from `current_a` with the amplifier's bandwidth.
    pub(super) fn step(&mut self, step_s: f64, current_a: f64, setpoint_a: f64, load: Disturbance) {
        let after = |span_s: f64| {
            setpoint_a + (current_a - setpoint_a) * libm::exp(-self.lag_rad_s * span_s)
        };
        let force_n = [current_a, after(0.5 * step_s), after(step_s)]
            .map(|a| a * self.force_constant_n_per_a);
        self.mechanism.step(&mut self.state, step_s, force_n, load);
    }
}
