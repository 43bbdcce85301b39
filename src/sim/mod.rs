//! A rig that obeys the model: amplifier with limits, stage with unmodelled modes and stop, probe with noise, quantisation
//! and range, one period of computing delay, a moving floor. Behind the hardware boundary, so that the loop cannot tell.
//!
//! The same seed and settings give the same readings, bit for bit, on any x86-64 or ARM machine: sums are in a fixed
//! order, every transcendental function comes from the `libm` crate, and no library picks its kernel by the processor.

mod floor;
mod noise;
mod stage;

use std::collections::VecDeque;

use bench_hal::{AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, Reading, Tick, Validity};

use crate::config::{Config, UnmodelledMode};
use crate::plant::{self, Modal, Mode, PlantError};
use noise::Gaussian;
use stage::Stage;

/// The simulated amplifier, stage and probe.
#[derive(Clone, Debug)]
pub struct SimulatedRig {
    stage: Stage,
    status: AmplifierStatus,
    /// Commands on their way through the computing delay, each with the tick from which it acts; the oldest first.
    delayed_a: VecDeque<(u64, f64)>,
    delay: u64,
    acting_a: f64,
    accepted_a: f64,
    current_limit_a: f64,
    largest_change_a: f64,
    probe_noise: Gaussian,
    probe_noise_rms_m: f64,
    quantum_m: f64,
    half_range_m: f64,
    sequence: u64,
    tick: Option<u64>,
}

impl SimulatedRig {
    /// A rig at rest, as configured.
    pub fn new(config: &Config) -> Result<Self, PlantError> {
        let delay = u64::from(config.servo.computing_delay_periods);
        Ok(SimulatedRig {
            stage: Stage::new(config, &modes(config)?),
            status: AmplifierStatus::Disabled,
            delayed_a: VecDeque::with_capacity(delay as usize + 2),
            delay,
            acting_a: 0.0,
            accepted_a: 0.0,
            current_limit_a: config.amplifier.current_limit_a,
            largest_change_a: config.amplifier.slew_limit_a_per_s * config.servo.period_s(),
            probe_noise: Gaussian::new(config.sim.seed, 0),
            probe_noise_rms_m: config.sim.probe_noise_rms_m,
            quantum_m: config.sim.probe_quantisation_m,
            half_range_m: config.probe.range_m / 2.0,
            sequence: 0,
            tick: None,
        })
    }

    /// Where the stage really is, in metres: for tests and studies, nothing behind the boundary can see it.
    pub fn true_position_m(&self) -> f64 {
        self.stage.position_m()
    }

    /// The period after `tick`: the command that has waited long enough begins to act, and goes on until the next does.
    fn advance(&mut self, tick: u64) {
        while let Some((_, current_a)) = self.delayed_a.pop_front_if(|(from, _)| *from <= tick) {
            self.acting_a = current_a;
        }
        self.stage.advance(self.acting_a);
    }

    fn read(&mut self) -> Reading {
        let noisy_m = self.stage.position_m() + self.probe_noise_rms_m * self.probe_noise.next();
        let quantised_m =
            if self.quantum_m > 0.0 { libm::round(noisy_m / self.quantum_m) * self.quantum_m } else { noisy_m };
        let validity = if quantised_m.abs() <= self.half_range_m { Validity::Valid } else { Validity::OutOfRange };
        self.sequence += 1;
        let position_m = quantised_m.clamp(-self.half_range_m, self.half_range_m);
        Reading { position_m, sequence: self.sequence, age_ns: 0, validity }
    }
}

/// The modes of the rig: those of the plant's model and those that it leaves out.
pub fn modes(config: &Config) -> Result<Vec<Mode>, PlantError> {
    let mut modes = Modal::of(&plant::build(&config.plant)?)?.modes;
    modes.extend(config.sim.unmodelled.iter().map(unmodelled));
    Ok(modes)
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
            return Err(DeviceError { what: "the simulated amplifier is disabled", remedy, code: 0 });
        }
        let change_a = current_a - self.accepted_a;
        let within = change_a.abs() <= self.largest_change_a;
        let reached_a = if within { current_a } else { self.accepted_a + self.largest_change_a.copysign(change_a) };
        self.accepted_a = reached_a.clamp(-self.current_limit_a, self.current_limit_a);
        let from = self.tick.unwrap_or_default() + self.delay;
        // The last word of a tick counts.
        self.delayed_a.pop_back_if(|(other, _)| *other == from);
        self.delayed_a.push_back((from, self.accepted_a));
        Ok(self.accepted_a)
    }

    fn disable(&mut self) {
        self.status = AmplifierStatus::Disabled;
        self.delayed_a.clear();
        (self.acting_a, self.accepted_a) = (0.0, 0.0);
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
        self.read()
    }
}
