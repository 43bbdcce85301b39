//! Runs plans on a bench: opens the rig, applies the calibration, runs the loop, and reports progress.

use std::cell::Cell;
use std::path::PathBuf;
use std::time::SystemTime;

use bench_hal::{Rig, blocking};
use serde::Serialize;

use super::error::ExperimentError;
use super::loop_check::{Stage, closed_loop_of, require_margins};
use super::motor_error::MotorError;
use super::plan::Plan;
use super::remembered_motor::{MotorHandling, RememberedMotor, rested};
use super::run::{Run, run};
use super::run_error::RunError;
use crate::config::Config;
use crate::rig::calibration::{Calibration, KnownDevices, load_calibration};
use crate::rig::devices::{self, OpenRig};
use crate::rig::motor::{Moment, MotorMemory};
use crate::rt::thread::Pace;
use crate::util::progress::Progress;

/// The rig on which a plan runs, its pace, and the folder for its recording.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Pace of the loop.
    pub pace: Pace,
    /// Whether the simulated stage replaces the configured devices.
    pub simulate: bool,
    /// Whether a stored fault of the amplifier is cleared first. The operator confirms that its cause was removed.
    pub clear_fault: bool,
    /// How the thermal state of the motor is treated.
    pub motor: MotorHandling,
    /// The clock between runs.
    pub now: fn() -> Moment,
    /// Folder for the recordings.
    pub folder: PathBuf,
}

impl Setup {
    /// The configured devices at their own pace. A run waits until the motor is cool enough.
    pub fn on_devices(folder: PathBuf) -> Setup {
        Setup {
            pace: Pace::Realtime,
            simulate: false,
            clear_fault: false,
            motor: MotorHandling::WaitUntilCool,
            now: Moment::now,
            folder,
        }
    }

    /// The simulated stage as fast as possible.
    pub fn simulated(folder: PathBuf) -> Setup {
        Setup {
            pace: Pace::Virtual,
            simulate: true,
            clear_fault: false,
            motor: MotorHandling::Simulated,
            now: Moment::now,
            folder,
        }
    }

    /// The stage of a run.
    fn stage(&self, config: &Config) -> Stage {
        match self.simulate {
            true => Stage::Simulated,
            false => Stage::of(config),
        }
    }

    fn open(&self, config: &Config) -> Result<OpenRig, ExperimentError> {
        let mut opened = match self.stage(config) {
            Stage::Simulated => devices::simulate(config)?,
            Stage::Devices => devices::open(config)?,
        };
        for note in &opened.notes {
            tracing::warn!("{note}");
        }
        if self.clear_fault {
            blocking::reset_fault(&mut opened.rig, std::thread::sleep).map_err(|error| {
                ExperimentError::Failed(format!("amplifier: {error}; nothing was moved"))
            })?;
        }
        Ok(opened)
    }
}

/// Runs plans.
pub struct Runner {
    /// Rig, pace and folder.
    pub setup: Setup,
    /// Receives the progress of each run.
    pub progress: Progress,
    /// The thermal state of the motor after the last run, in A^2; `None` before the first.
    motor_a2: Cell<Option<f64>>,
}

impl Runner {
    /// A runner whose progress is not shown.
    pub fn new(setup: Setup) -> Runner {
        Runner::with_progress(setup, Progress::default())
    }

    /// A runner that reports to `progress`.
    pub fn with_progress(setup: Setup, progress: Progress) -> Runner {
        Runner {
            setup,
            progress,
            motor_a2: Cell::new(None),
        }
    }

    /// Runs a plan with the configured calibration.
    pub fn run(&self, plan: &Plan, phase: &'static str) -> Result<Run, ExperimentError> {
        self.run_calibrated(plan, phase, None)
    }

    /// Runs a plan with `calibration` instead of the configured one.
    pub fn run_calibrated(
        &self,
        plan: &Plan,
        phase: &'static str,
        calibration: Option<Calibration>,
    ) -> Result<Run, ExperimentError> {
        require_stable_loop(plan, self.setup.stage(&plan.config))?;
        let opened = self.setup.open(&plan.config)?;
        let plan = calibrated(plan, &opened, calibration)?;
        let run = match self.setup.motor {
            MotorHandling::Simulated => self.run_simulated_motor(plan, opened, phase),
            MotorHandling::Remembered | MotorHandling::WaitUntilCool => {
                self.run_remembered_motor(plan, opened, phase)
            }
        }?;
        self.motor_a2.set(Some(run.ended.thermal_a2));
        Ok(run)
    }

    fn run_simulated_motor(
        &self,
        mut plan: Plan,
        opened: OpenRig,
        phase: &'static str,
    ) -> Result<Run, ExperimentError> {
        plan.motor = rested(&plan, self.motor_a2.get().unwrap_or(0.0))?;
        Ok(self.run_loop(&plan, opened.rig, phase)?)
    }

    /// A run whose motor is known by a file. The later runs of a runner wait in any case: a command that has begun is not refused
    /// in its middle.
    fn run_remembered_motor(
        &self,
        mut plan: Plan,
        opened: OpenRig,
        phase: &'static str,
    ) -> Result<Run, ExperimentError> {
        let memory = MotorMemory::of(&plan.config).map_err(MotorError::from)?;
        let motor = RememberedMotor {
            memory,
            amplifier: &opened.amplifier,
            now: self.setup.now,
        };
        let is_later = self.motor_a2.get().is_some();
        let waits = is_later || self.setup.motor == MotorHandling::WaitUntilCool;
        plan.motor = motor.ready(&plan, waits, &self.progress)?;
        motor.begin(&plan)?;
        let result = self.run_loop(&plan, opened.rig, phase);
        motor.end(&plan, &result);
        Ok(result?)
    }

    fn run_loop(
        &self,
        plan: &Plan,
        rig: Box<dyn Rig>,
        phase: &'static str,
    ) -> Result<Run, RunError> {
        self.progress.begin(phase, 0);
        let mut update = |done, total| self.progress.set(done, total);
        let (pace, folder) = (self.setup.pace, &self.setup.folder);
        run(plan, rig, pace, folder, &mut update)
    }
}

/// Refuses the loop of a plan, if it has one, before a device is opened.
fn require_stable_loop(plan: &Plan, stage: Stage) -> Result<(), ExperimentError> {
    let Some(controller) = &plan.controller else {
        return Ok(());
    };
    let margins = closed_loop_of(controller, &plan.config)?.margins();
    Ok(require_margins(&plan.config, &margins, stage)?)
}

/// The plan with the devices, and with the given or the configured calibration.
fn calibrated(
    plan: &Plan,
    opened: &OpenRig,
    given: Option<Calibration>,
) -> Result<Plan, ExperimentError> {
    let calibration = match given {
        Some(calibration) => Some(calibration),
        None => configured_calibration(&plan.config, opened)?,
    };
    let mut plan = plan.clone();
    plan.devices = vec![
        ("amplifier", opened.amplifier.clone()),
        ("probe", opened.probe.clone()),
    ];
    plan.calibration = calibration;
    Ok(plan)
}

fn configured_calibration(
    config: &Config,
    opened: &OpenRig,
) -> Result<Option<Calibration>, ExperimentError> {
    let devices = KnownDevices {
        amplifier: Some(&opened.amplifier),
        probe: Some(&opened.probe),
    };
    let loaded = load_calibration(config, devices, SystemTime::now())?;
    let Some(loaded) = loaded else {
        return Ok(None);
    };
    for warning in loaded.warnings {
        tracing::warn!("{warning}");
    }
    Ok(Some(loaded.calibration))
}

/// Adds the result of a run to its recording as JSON and closes the file; returns the JSON.
pub fn close(run: Run, result: &impl Serialize) -> Result<String, ExperimentError> {
    let json = serde_json::to_string_pretty(result).map_err(|e| {
        ExperimentError::Failed(format!(
            "cannot write the result as JSON: {e}; report this with the command"
        ))
    })?;
    run.finish(&json)?;
    Ok(json + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Purpose, Source, load};
    use crate::experiment::MarginError;

    #[test]
    fn refuses_unstable_loop_before_a_device_is_opened() {
        let sets = [
            "control.controller=fast",
            "control.min_modulus_margin=0",
            "amplifier.device.interface=no-such-can",
            "probe.device.line.port=/dev/ttyNONE9",
        ];
        let config = load(&Source {
            config: Some("lab".into()),
            sets: sets.map(String::from).to_vec(),
            options: Vec::new(),
            purpose: Purpose::Control,
        })
        .unwrap();
        let folder = tempfile::tempdir().unwrap();
        let runner = Runner::new(Setup::on_devices(folder.path().into()));
        let refused = runner.run(&Plan::control(config).unwrap(), "control");
        let error = refused.err().expect("a refusal");
        let is_unstable = matches!(
            error,
            ExperimentError::Margin(MarginError::UnstableOnDevices { .. })
        );
        assert!(is_unstable, "{error}");
    }
}
