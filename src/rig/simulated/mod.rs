//! A rig that obeys the model: amplifier with limits, steps and latency, stage with unmodelled modes and stop, probe with
//! noise, quantisation, range, age and a rate of its own, a moving floor. Behind the hardware boundary, so that the loop
//! cannot tell.
//!
//! The same seed and settings give the same readings, bit for bit, on any x86-64 or ARM machine: sums are in a fixed
//! order, every transcendental function comes from the `libm` crate, and no library picks its kernel by the processor.

mod body;
mod course;
mod floor;
mod live;
mod noise;
mod probe;
mod setpoints;
mod stage;

use bench_hal::{AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, Reading, Tick};

use crate::config::{Config, Geometry, PlantSettings, UnmodelledMode};
use crate::model::plant::{self, ModalModel, Mode, PlantError};
use body::Body;
use course::Course;
use probe::Probe;
use stage::Stage;

pub use live::LiveStage;
pub use probe::Sensor;

/// The simulated amplifier, stage and probe.
#[derive(Clone, Debug)]
pub struct SimulatedRig {
    course: Course,
    status: AmplifierStatus,
    /// From a command to its action, in ticks.
    delay: f64,
    accepted_a: f64,
    current_limit_a: f64,
    largest_change_a: f64,
    current_step_a: f64,
    probe: Probe,
    /// All that happens, happens at ticks: no fraction of a period needs to be resolved.
    in_step: bool,
    tick: Option<u64>,
}

impl SimulatedRig {
    /// A rig at rest, as configured.
    pub fn new(config: &Config) -> Result<Self, PlantError> {
        let latency = config.amplifier.latency_s * config.servo.rate_hz;
        let delay = f64::from(config.servo.computing_delay_periods) + latency;
        Ok(SimulatedRig {
            course: Course::new(config, config.servo.period_s(), delay)?,
            status: AmplifierStatus::Disabled,
            delay,
            accepted_a: 0.0,
            current_limit_a: config.amplifier.current_limit_a,
            largest_change_a: config.amplifier.slew_limit_a_per_s * config.servo.period_s(),
            current_step_a: config.amplifier.device.current_step_a(),
            probe: Probe::new(config),
            in_step: latency == 0.0 && probe::is_immediate(config),
            tick: None,
        })
    }

    /// Where the stage really is, in metres: for tests and studies, nothing behind the boundary can see it.
    pub fn true_position_m(&self) -> f64 {
        self.course.position_m()
    }

    /// The period after `tick`.
    fn advance(&mut self, tick: u64) {
        if self.in_step {
            return self.course.advance(tick);
        }
        for step in 0..self.course.fine_steps() {
            let passed = self.course.pass_finely(tick, step);
            self.probe.watch(passed.to, |time| passed.position_m(time));
        }
    }

    /// The nearest step, limited in slope and size.
    fn accept(&self, current_a: f64) -> f64 {
        let change_a = current_a - self.accepted_a;
        let within = change_a.abs() <= self.largest_change_a;
        let reached_a = if within {
            current_a
        } else {
            self.accepted_a + self.largest_change_a.copysign(change_a)
        };
        let step_a = self.current_step_a;
        let stepped_a = if step_a > 0.0 {
            libm::round(reached_a / step_a) * step_a
        } else {
            reached_a
        };
        stepped_a.clamp(-self.current_limit_a, self.current_limit_a)
    }
}

/// The moving stage, its plant linear or not, to be carried by periods of `period_s`.
fn stage(config: &Config, period_s: f64) -> Result<Stage, PlantError> {
    match config.sim.geometry {
        Geometry::Linear => Ok(Stage::new(config, &modes(config)?, None, period_s)),
        Geometry::Quadratic => Ok(Stage::new(
            config,
            &unmodelled_modes(config),
            Some(Body::new(config)?),
            period_s,
        )),
    }
}

/// The modes of the linear rig: those of the plant's model and those that it leaves out.
pub fn modes(config: &Config) -> Result<Vec<Mode>, PlantError> {
    let mut modes = ModalModel::of(&plant::build(&actual_plant(config))?)?.modes;
    modes.extend(unmodelled_modes(config));
    Ok(modes)
}

/// The plant as the simulated stage was made: with an asymmetry that its configuration does not know of.
pub fn actual_plant(config: &Config) -> PlantSettings {
    let mut plant = config.plant.clone();
    if let PlantSettings::Sr4dof(settings) = &mut plant {
        settings.mass_asymmetry += config.sim.asymmetry_offset;
    }
    plant
}

fn unmodelled_modes(config: &Config) -> Vec<Mode> {
    config.sim.unmodelled.iter().map(unmodelled).collect()
}

/// An unmodelled mode has a residue, but neither a shape nor a part in the floor's motion.
fn unmodelled(mode: &UnmodelledMode) -> Mode {
    let size = mode.residue_per_kg.abs().sqrt();
    Mode {
        omega_rad_s: 2.0 * std::f64::consts::PI * mode.frequency_hz,
        damping_ratio: mode.damping_ratio,
        shape: nalgebra::DVector::zeros(0),
        force_gain: size * mode.residue_per_kg.signum(),
        sensor_gain: size,
        floor_gain: 0.0,
    }
}

impl CurrentAmplifier for SimulatedRig {
    fn enable(&mut self) -> Result<(), DeviceError> {
        self.status = AmplifierStatus::Enabled;
        Ok(())
    }

    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        if self.status != AmplifierStatus::Enabled {
            let remedy = "arm the loop first";
            return Err(DeviceError {
                what: "the simulated amplifier is disabled",
                remedy,
                code: 0,
            });
        }
        self.accepted_a = self.accept(current_a);
        self.course.push(
            self.tick.unwrap_or_default() as f64 + self.delay,
            self.accepted_a,
        );
        Ok(self.accepted_a)
    }

    fn disable(&mut self) {
        self.status = AmplifierStatus::Disabled;
        self.course.clear();
        self.accepted_a = 0.0;
    }

    fn status(&self) -> AmplifierStatus {
        self.status
    }
}

impl DisplacementProbe for SimulatedRig {
    fn latest(&mut self, now: Tick) -> Reading {
        for tick in self.tick.unwrap_or(now.number)..now.number {
            self.advance(tick);
        }
        self.tick = Some(now.number);
        if self.in_step {
            self.probe.measure(self.course.position_m())
        } else {
            self.probe.latest(now.number as f64)
        }
    }
}
