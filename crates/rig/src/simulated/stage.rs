//! The mechanics: amplifier current, modes, floor and mechanical stop, from tick to tick.
//!
//! With linear geometry the modes are those of the plant and the unmodelled ones; the solution over a period is exact. With
//! quadratic geometry the plant is a [`NonlinearPlant`], solved in fine steps, and only the unmodelled modes are linear.

use super::actual_model::{actual_plant, modes, unmodelled_modes};
use super::drive::Drive;
use super::floor::Line;
use super::noise::Gaussian;
use super::nonlinear_plant::NonlinearPlant;
use bench_config::{Config, Geometry, SimSettings};
use bench_plant::{DiscretePlant, Disturbance, Mode, PlantError, PlantState};

/// Largest step during contact with the stop. The contact frequency with the smallest effective mass is
/// sqrt(1e7 N/m / 0.4 kg) = 5000 rad/s, so a step is 0.1 rad.
const CONTACT_STEP_S: f64 = 20e-6;

/// Position and velocity at one time.
#[derive(Clone, Copy, Debug)]
pub(super) struct MotionState {
    position_m: f64,
    velocity_m_per_s: f64,
}

impl MotionState {
    /// The position at the fraction `share` of the time to `after`, which is `length_s` later, by cubic Hermite interpolation.
    pub(super) fn interpolate(&self, after: &MotionState, length_s: f64, share: f64) -> f64 {
        let rise_m = after.position_m - self.position_m;
        let (start_m, end_m) = (
            self.velocity_m_per_s * length_s,
            after.velocity_m_per_s * length_s,
        );
        let bend_m =
            3.0 * rise_m - 2.0 * start_m - end_m + share * (start_m + end_m - 2.0 * rise_m);
        self.position_m + share * (start_m + share * bend_m)
    }
}

/// The lines of the floor's acceleration; the noise of each has its own random stream.
fn floor_lines(sim: &SimSettings, period_s: f64) -> Vec<Line> {
    let streams = (1..).map(|stream| Gaussian::new(sim.seed, stream));
    let lines = sim.floor.iter().zip(streams);
    lines
        .map(|(line, noise)| Line::new(line, period_s, noise))
        .collect()
}

/// The state of the simulated mechanics.
#[derive(Clone, Debug)]
pub(super) struct Stage {
    whole: DiscretePlant,
    fine: DiscretePlant,
    fine_steps: usize,
    motion: PlantState,
    nonlinear: Option<NonlinearPlant>,
    floor: Vec<Line>,
    floor_m_per_s2: f64,
    stop_m: f64,
    stop_stiffness_n_per_m: f64,
    stop_damping_n_s_per_m: f64,
}

impl Stage {
    /// The configured stage at rest, with a linear or a nonlinear plant, for periods of `period_s`.
    pub(super) fn new(config: &Config, period_s: f64) -> Result<Stage, PlantError> {
        let (plant, sim) = (&config.plant, &config.sim);
        let drive = Drive {
            bandwidth_hz: config.amplifier.bandwidth_hz,
            force_constant_n_per_a: config.motor.force_constant_n_per_a,
        };
        let (modes, nonlinear) = match sim.geometry {
            Geometry::Linear => (modes(plant, sim)?, None),
            Geometry::Quadratic => {
                let nonlinear = NonlinearPlant::new(&actual_plant(plant, sim), drive)?;
                (unmodelled_modes(sim), Some(nonlinear))
            }
        };
        Ok(Stage::of(&modes, nonlinear, drive, sim, period_s))
    }

    /// A stage with linear `modes`, and with a nonlinear plant, if there is one.
    fn of(
        modes: &[Mode],
        nonlinear: Option<NonlinearPlant>,
        drive: Drive,
        sim: &SimSettings,
        period_s: f64,
    ) -> Stage {
        let contact_steps = libm::ceil(period_s / CONTACT_STEP_S).max(1.0) as usize;
        let plant_steps = nonlinear.as_ref().map_or(0, |plant| plant.steps(period_s));
        let fine_steps = plant_steps.max(contact_steps);
        let whole = drive.sampled(modes, period_s);
        Stage {
            motion: whole.at_rest(),
            nonlinear,
            whole,
            fine: drive.sampled(modes, period_s / fine_steps as f64),
            fine_steps,
            floor: floor_lines(sim, period_s),
            floor_m_per_s2: 0.0,
            stop_m: sim.stop_m,
            stop_stiffness_n_per_m: sim.stop_stiffness_n_per_m,
            stop_damping_n_s_per_m: sim.stop_damping_n_s_per_m,
        }
    }

    /// The current in amperes.
    pub(super) fn current_a(&self) -> f64 {
        self.motion.current_a
    }

    /// Displacement at the probe in metres.
    pub(super) fn position_m(&self) -> f64 {
        let modes_m = self.whole.position_m(&self.motion);
        self.nonlinear
            .as_ref()
            .map_or(modes_m, |nonlinear| nonlinear.position_m() + modes_m)
    }

    /// Position and velocity at the probe.
    pub(super) fn motion_state(&self) -> MotionState {
        MotionState {
            position_m: self.position_m(),
            velocity_m_per_s: self.velocity_m_per_s(),
        }
    }

    /// Velocity at the probe in metres per second.
    fn velocity_m_per_s(&self) -> f64 {
        let modes_m_per_s = self.whole.velocity_m_per_s(&self.motion);
        self.nonlinear.as_ref().map_or(modes_m_per_s, |nonlinear| {
            nonlinear.velocity_m_per_s() + modes_m_per_s
        })
    }

    /// Length of a period in seconds.
    pub(super) fn period_s(&self) -> f64 {
        self.whole.period_s
    }

    /// Length of a fine step in seconds.
    pub(super) fn fine_step_s(&self) -> f64 {
        self.fine.period_s
    }

    /// Fine steps per period.
    pub(super) fn fine_steps(&self) -> usize {
        self.fine_steps
    }

    /// Advances by one period with a constant set-point; in fine steps near the stop, and always with a nonlinear plant.
    pub(super) fn advance(&mut self, setpoint_a: f64) {
        self.update_floor();
        let reach_m = self.position_m().abs() + self.velocity_m_per_s().abs() * self.whole.period_s;
        if self.nonlinear.is_none() && reach_m < self.stop_m {
            let floor_m_per_s2 = self.floor_m_per_s2;
            return self.whole.step(&mut self.motion, setpoint_a, |block| {
                -floor_m_per_s2 * block.floor
            });
        }
        for _ in 0..self.fine_steps {
            self.advance_finely(setpoint_a);
        }
    }

    /// Updates the acceleration of the floor for the next period.
    pub(super) fn update_floor(&mut self) {
        self.floor_m_per_s2 = self.floor.iter_mut().map(Line::next).sum();
    }

    /// Advances by one fine step, with the contact force of the stop.
    pub(super) fn advance_finely(&mut self, setpoint_a: f64) {
        let (contact_n, floor_m_per_s2) = (self.contact_n(), self.floor_m_per_s2);
        if let Some(nonlinear) = &mut self.nonlinear {
            let load = Disturbance {
                probe_n: contact_n,
                floor_m_per_s2,
            };
            nonlinear.step(self.fine.period_s, self.motion.current_a, setpoint_a, load);
        }
        self.fine.step(&mut self.motion, setpoint_a, |block| {
            contact_n * block.output - floor_m_per_s2 * block.floor
        });
    }

    /// Force of the stop on the stage: a spring and a damper that never pull.
    fn contact_n(&self) -> f64 {
        let position_m = self.position_m();
        let depth_m = position_m.abs() - self.stop_m;
        if depth_m <= 0.0 {
            return 0.0;
        }
        let side = position_m.signum();
        let inward = self.stop_stiffness_n_per_m * depth_m
            + self.stop_damping_n_s_per_m * side * self.velocity_m_per_s();
        -side * inward.max(0.0)
    }
}
