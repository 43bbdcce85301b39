//! The simulated rig: an amplifier with limits, resolution and latency, a stage with unmodelled modes, mechanical stop and
//! floor motion, and a probe with noise, quantisation, range, delay and its own clock. It implements the traits of
//! [`bench_hal`], so the loop drives it as it drives real devices.
//!
//! The same seed and settings give bit-identical readings on every x86-64 and ARM machine: the order of sums is fixed, every
//! transcendental function comes from the `libm` crate, and no library selects code by the processor.

mod actual_model;
mod drive;
mod floor;
mod live;
mod noise;
mod nonlinear_plant;
mod probe;
mod setpoints;
mod spectra;
mod stage;
mod trajectory;

use bench_hal::{AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, Reading, Tick};
use std::task::Poll;

use super::devices::amplifier::current_step_a;
use bench_config::Config;
use bench_plant::PlantError;
use probe::Probe;
use stage::Stage;
use trajectory::Trajectory;

pub use actual_model::modes;
pub use live::LiveStage;
pub use probe::Sensor;
pub use spectra::DisturbanceSpectra;

/// The simulated amplifier, stage and probe.
///
/// ```
/// use bench_config::{Source, load};
/// use bench_rig::simulated::SimulatedRig;
/// use bench_hal::{DisplacementProbe, Tick, Validity};
///
/// let config = load(&Source::default()).unwrap();
/// let mut rig = SimulatedRig::new(&config).unwrap();
/// assert_eq!(rig.latest(Tick::default()).validity, Validity::Valid);
/// ```
#[derive(Clone, Debug)]
pub struct SimulatedRig {
    trajectory: Trajectory,
    status: AmplifierStatus,
    /// Time from a command to its effect, in ticks.
    delay: f64,
    accepted_a: f64,
    current_limit_a: f64,
    max_change_a: f64,
    current_step_a: f64,
    probe: Probe,
    /// Whether commands and measurements occur at ticks only, so that no fraction of a period needs to be resolved.
    is_synchronous: bool,
    tick: Option<u64>,
}

impl SimulatedRig {
    /// The configured rig, at rest.
    pub fn new(config: &Config) -> Result<Self, PlantError> {
        let latency = config.amplifier.latency_s * config.servo.rate_hz;
        let delay = f64::from(config.servo.computing_delay_periods) + latency;
        let is_synchronous = latency == 0.0 && probe::is_immediate(&config.probe);
        let stage = Stage::new(config, config.servo.period_s())?;
        Ok(SimulatedRig {
            trajectory: Trajectory::new(stage, delay),
            status: AmplifierStatus::Disabled,
            delay,
            accepted_a: 0.0,
            current_limit_a: config.amplifier.current_limit_a,
            max_change_a: config.amplifier.slew_limit_a_per_s * config.servo.period_s(),
            current_step_a: current_step_a(&config.amplifier.device),
            probe: Probe::new(&config.probe, &config.sim, &config.servo, is_synchronous),
            is_synchronous,
            tick: None,
        })
    }

    /// The true displacement of the stage in metres, for tests and studies. The loop does not see it.
    pub fn true_position_m(&self) -> f64 {
        self.trajectory.position_m()
    }

    /// Advances by the period after `tick`.
    fn advance(&mut self, tick: u64) {
        if self.is_synchronous {
            return self.trajectory.advance(tick);
        }
        for step in 0..self.trajectory.fine_steps() {
            let interval = self.trajectory.advance_interval_finely(tick, step);
            // Measurements before the first tick are those of the stage at rest.
            let position_m = |time: f64| interval.position_m(time.max(interval.from));
            self.probe.measure_until(interval.to, position_m);
        }
    }

    /// The set-point that the amplifier accepts: limited in slope, rounded to its resolution, limited in size.
    fn accept(&self, current_a: f64) -> f64 {
        let change_a = current_a - self.accepted_a;
        let reached_a = if change_a.abs() <= self.max_change_a {
            current_a
        } else {
            self.accepted_a + self.max_change_a.copysign(change_a)
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

const DISABLED: DeviceError = DeviceError {
    what: "the simulated amplifier is disabled",
    remedy: "arm the loop first",
    code: 0,
};

impl CurrentAmplifier for SimulatedRig {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        self.status = AmplifierStatus::Enabled;
        Ok(())
    }

    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        Poll::Ready(Ok(()))
    }

    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        if self.status != AmplifierStatus::Enabled {
            return Err(DISABLED);
        }
        self.accepted_a = self.accept(current_a);
        let due = self.tick.unwrap_or_default() as f64 + self.delay;
        self.trajectory.push(due, self.accepted_a);
        Ok(self.accepted_a)
    }

    fn rounded_a(&self, current_a: f64) -> f64 {
        self.accept(current_a)
    }

    fn disable(&mut self) {
        self.status = AmplifierStatus::Disabled;
        self.trajectory.clear();
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
        if self.is_synchronous {
            self.probe.measure(self.trajectory.position_m())
        } else {
            self.probe.latest(now.number as f64)
        }
    }
}
