//! The moving stage: amplifier current, modes, floor and mechanical stop, carried from tick to tick.

use nalgebra::Vector2;

use super::floor::Line;
use super::noise::Gaussian;
use crate::config::Config;
use crate::plant::{Block, Mode, Sampled};

/// Steps of at most this length resolve the contact with the stop: its frequency against the lightest effective mass,
/// sqrt(1e7 N/m / 0.4 kg) = 5000 rad/s, turns by 0.1 rad a step.
const CONTACT_STEP_S: f64 = 20e-6;

/// The state of the simulated mechanics.
#[derive(Clone, Debug)]
pub(super) struct Stage {
    whole: Sampled,
    fine: Sampled,
    fine_steps: usize,
    current_a: f64,
    states: Vec<Vector2<f64>>,
    floor: Vec<Line>,
    stop_m: f64,
    stop_stiffness_n_per_m: f64,
    stop_damping_n_s_per_m: f64,
}

impl Stage {
    pub(super) fn new(config: &Config, modes: &[Mode]) -> Self {
        let period_s = config.servo.period_s();
        let fine_steps = libm::ceil(period_s / CONTACT_STEP_S).max(1.0) as usize;
        let sampled = |period_s| Sampled::new(modes, &config.amplifier, config.motor.force_constant_n_per_a, period_s);
        let line = |(index, line)| Line::new(line, period_s, Gaussian::new(config.sim.seed, 1 + index as u64));
        Stage {
            whole: sampled(period_s),
            fine: sampled(period_s / fine_steps as f64),
            fine_steps,
            current_a: 0.0,
            states: vec![Vector2::zeros(); modes.len()],
            floor: config.sim.floor.iter().enumerate().map(line).collect(),
            stop_m: config.sim.stop_m,
            stop_stiffness_n_per_m: config.sim.stop_stiffness_n_per_m,
            stop_damping_n_s_per_m: config.sim.stop_damping_n_s_per_m,
        }
    }

    /// Displacement at the probe in metres.
    pub(super) fn position_m(&self) -> f64 {
        self.whole.blocks.iter().zip(&self.states).map(|(block, x)| block.output * x[0]).sum()
    }

    fn velocity_m_per_s(&self) -> f64 {
        self.whole.blocks.iter().zip(&self.states).map(|(block, x)| block.output_rate * x[1]).sum()
    }

    /// One period with the set-point held. Where the stop may be touched, in fine steps.
    pub(super) fn advance(&mut self, setpoint_a: f64) {
        let floor_m_per_s2: f64 = self.floor.iter_mut().map(Line::next).sum();
        let reach_m = self.position_m().abs() + self.velocity_m_per_s().abs() * self.whole.period_s;
        if reach_m < self.stop_m {
            return step(&self.whole, &mut self.states, &mut self.current_a, setpoint_a, floor_m_per_s2, 0.0);
        }
        for _ in 0..self.fine_steps {
            let contact_n = self.contact_n();
            step(&self.fine, &mut self.states, &mut self.current_a, setpoint_a, floor_m_per_s2, contact_n);
        }
    }

    /// Force of the stop on the stage: a spring and a damper that push and never pull.
    fn contact_n(&self) -> f64 {
        let position_m = self.position_m();
        let depth_m = position_m.abs() - self.stop_m;
        if depth_m <= 0.0 {
            return 0.0;
        }
        let side = position_m.signum();
        let inward =
            self.stop_stiffness_n_per_m * depth_m + self.stop_damping_n_s_per_m * side * self.velocity_m_per_s();
        -side * inward.max(0.0)
    }
}

fn step(
    over: &Sampled,
    states: &mut [Vector2<f64>],
    current_a: &mut f64,
    setpoint_a: f64,
    floor_m_per_s2: f64,
    contact_n: f64,
) {
    for (block, x) in over.blocks.iter().zip(states) {
        let force = contact_n * block.output - floor_m_per_s2 * block.floor;
        *x = next(block, x, *current_a, setpoint_a, force);
    }
    *current_a = setpoint_a + (*current_a - setpoint_a) * over.lag;
}

fn next(block: &Block, x: &Vector2<f64>, current_a: f64, setpoint_a: f64, force: f64) -> Vector2<f64> {
    let row = |i: usize| {
        block.a[i][0] * x[0]
            + block.a[i][1] * x[1]
            + block.current[i] * current_a
            + block.setpoint[i] * setpoint_a
            + block.force[i] * force
    };
    Vector2::new(row(0), row(1))
}
