//! Runs plans on a bench: opens the rig, applies the calibration, runs the loop, and reports progress.

use std::cell::{Cell, RefCell};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::SystemTime;

use serde::Serialize;

use super::planned_run::{RigOwner, RunConditions, run_elsewhere};
use super::planned_stage_check::PlannedStageCheck;
use super::remembered_motor::{MotorHandling, RememberedMotor, rested};
use crate::analysis::Ending;
use crate::errors::{ExperimentError, MotorError, RunError};
use crate::evidence::{OpenRig, require_evidence, require_evidence_or_warn};
use crate::live::{DeviceNames, LiveRig, OpenBench, Opening, Run, RunHooks};
use crate::plan::{Description, Plan, Stage, closed_loop_of, require_margins};
use crate::stage_check::StageCheck;
use bench_base::progress::Progress;
use bench_config::Config;
use bench_recording::Recording;
use bench_rig::calibration::{Calibration, KnownDevices, load_calibration};
use bench_rig::motor::{Moment, MotorMemory};
use bench_rt::thread::Pace;

/// The rig on which a plan runs, its pace, and the folder for its recording.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Pace, motor and folder.
    pub conditions: RunConditions,
    /// Whether the simulated stage replaces the configured devices.
    pub simulate: bool,
    /// The clock between runs.
    pub now: fn() -> Moment,
    /// Name, note and operator of the runs; those of each plan if they are not given here.
    pub description: Description,
    /// The process that owns the rig; `None` if this process opens it.
    pub owner: Option<Arc<dyn RigOwner>>,
}

impl Setup {
    /// The configured devices at their own pace. A run waits until the motor is cool enough.
    pub fn on_devices(folder: PathBuf) -> Setup {
        Setup {
            conditions: RunConditions {
                pace: Pace::Realtime,
                clear_fault: false,
                motor: MotorHandling::WaitUntilCool,
                folder,
            },
            simulate: false,
            now: Moment::now,
            description: Description::default(),
            owner: None,
        }
    }

    /// The simulated stage as fast as possible.
    pub fn simulated(folder: PathBuf) -> Setup {
        Setup {
            conditions: RunConditions {
                pace: Pace::Virtual,
                clear_fault: false,
                motor: MotorHandling::Simulated,
                folder,
            },
            simulate: true,
            now: Moment::now,
            description: Description::default(),
            owner: None,
        }
    }

    /// The stage of a run.
    fn stage(&self, config: &Config) -> Stage {
        if self.simulate {
            Stage::Simulated
        } else {
            Stage::of(config)
        }
    }

    /// How the rig of a run is opened.
    fn opening(&self, config: &Config) -> Opening {
        Opening {
            stage: self.stage(config),
            pace: self.conditions.pace,
            clear_fault: self.conditions.clear_fault,
        }
    }
}

/// Runs plans. The rig stays open for later runs with the same rig; after a trip it is closed.
pub struct Runner {
    /// Rig, pace and folder.
    pub setup: Setup,
    /// Receives the progress of each run.
    pub progress: Progress,
    /// The thermal state of the motor after the last run, in A^2; `None` before the first.
    motor_a2: Cell<Option<f64>>,
    /// The rig of the last run, if it is open.
    open: RefCell<Option<OpenBench>>,
    /// What other threads do with its runs.
    hooks: RunHooks,
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
            open: RefCell::new(None),
            hooks: RunHooks::default(),
        }
    }

    /// A runner on a rig that is open already, with hooks for its runs.
    pub fn on_bench(setup: Setup, open: Option<OpenBench>, hooks: RunHooks) -> Runner {
        Runner {
            open: RefCell::new(open),
            hooks,
            ..Runner::new(setup)
        }
    }

    /// Replaces the hooks for the next run.
    pub fn set_hooks(&mut self, hooks: RunHooks) {
        self.hooks = hooks;
    }

    /// The rig, if it is open.
    pub fn into_bench(self) -> Option<OpenBench> {
        self.open.into_inner()
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
        let plan = &self.described(plan);
        let stage = self.setup.stage(&plan.config);
        require_stable_loop(plan, stage)?;
        require_evidence(plan, stage, None)?;
        if let Some(owner) = &self.setup.owner {
            self.progress.begin(phase, 0);
            let calibration = calibration.as_ref();
            let conditions = &self.setup.conditions;
            return run_elsewhere(&**owner, plan, conditions, calibration, &self.progress);
        }
        let mut bench = self.opened(&plan.config)?;
        bench.rig.set_hooks(self.hooks.clone());
        let plan = calibrated(plan, &bench.names, calibration)?;
        let rig = OpenRig {
            devices: &bench.names,
            calibration: plan.calibration.as_ref(),
        };
        require_evidence_or_warn(&plan, stage, rig)?;
        let ended = match self.checked_stage(&plan, stage, &mut bench)? {
            CheckedStage::Ended(run) => *run,
            CheckedStage::MayClose => self.run_on(plan, &mut bench, phase)?,
        };
        if ended.end.servo.trip.is_none() {
            self.open.replace(Some(bench));
        }
        Ok(ended)
    }

    /// The plan with name, note and operator.
    fn described(&self, plan: &Plan) -> Plan {
        let mut plan = plan.clone();
        plan.description = self.setup.description.clone().or(plan.description);
        plan
    }

    /// Checks the stage of a closed loop that has a certificate.
    fn checked_stage(
        &self,
        plan: &Plan,
        stage: Stage,
        bench: &mut OpenBench,
    ) -> Result<CheckedStage, ExperimentError> {
        let Some(planned) = PlannedStageCheck::before(plan)? else {
            return Ok(CheckedStage::MayClose);
        };
        let mut run = self.run_on(planned.plan.clone(), bench, "stage check")?;
        if Ending::from(&run.end.servo) != Ending::Completed {
            return Ok(CheckedStage::Ended(Box::new(run)));
        }
        run.totals()?;
        let check = planned.evaluated(&Recording::open(&run.path)?)?;
        close(run, &check)?;
        require_agreement(&check, plan, stage)?;
        Ok(CheckedStage::MayClose)
    }

    /// Runs a plan whose devices and calibration are known.
    fn run_on(
        &self,
        plan: Plan,
        bench: &mut OpenBench,
        phase: &'static str,
    ) -> Result<Run, ExperimentError> {
        let run = match self.setup.conditions.motor {
            MotorHandling::Simulated => self.run_simulated_motor(plan, bench, phase),
            MotorHandling::Remembered | MotorHandling::WaitUntilCool => {
                self.run_remembered_motor(plan, bench, phase)
            }
        }?;
        self.motor_a2.set(Some(run.end.servo.thermal_a2));
        Ok(run)
    }

    /// The rig that is open already, or the one of `config`. Another rig is closed first, because it may be the same devices.
    fn opened(&self, config: &Config) -> Result<OpenBench, ExperimentError> {
        let opening = self.setup.opening(config);
        let open = self.open.take();
        match open.filter(|open| open.is_of(config, &opening)) {
            Some(open) => Ok(open),
            None => OpenBench::open(config, opening, self.hooks.clone()),
        }
    }

    fn run_simulated_motor(
        &self,
        mut plan: Plan,
        bench: &mut OpenBench,
        phase: &'static str,
    ) -> Result<Run, ExperimentError> {
        plan.motor = rested(&plan, self.motor_a2.get().unwrap_or(0.0))?;
        Ok(self.run_loop(&plan, &mut bench.rig, phase)?)
    }

    /// A run whose motor is known by a file. The later runs of a runner wait in any case: a command that has begun is not refused
    /// in its middle.
    fn run_remembered_motor(
        &self,
        mut plan: Plan,
        bench: &mut OpenBench,
        phase: &'static str,
    ) -> Result<Run, ExperimentError> {
        let memory = MotorMemory::of(&plan.config).map_err(MotorError::from)?;
        let motor = RememberedMotor {
            memory,
            amplifier: &bench.names.amplifier,
            now: self.setup.now,
            stop: &self.hooks.stop,
        };
        let is_later = self.motor_a2.get().is_some();
        let waits = is_later || self.setup.conditions.motor == MotorHandling::WaitUntilCool;
        plan.motor = motor.ready(&plan, waits, &self.progress)?;
        motor.begin(&plan)?;
        let result = self.run_loop(&plan, &mut bench.rig, phase);
        motor.end(&plan, &result);
        Ok(result?)
    }

    fn run_loop(
        &self,
        plan: &Plan,
        rig: &mut LiveRig,
        phase: &'static str,
    ) -> Result<Run, RunError> {
        self.progress.begin(phase, 0);
        let mut update = |done, total| self.progress.set(done, total);
        rig.run(plan, &self.setup.conditions.folder, &mut update)
    }
}

/// What follows from the check of a stage.
enum CheckedStage {
    /// The loop may close.
    MayClose,
    /// The run of the check did not come to its end.
    Ended(Box<Run>),
}

/// Refuses a stage that does not agree with the certificate; only warns on the simulated stage, and with an override.
fn require_agreement(check: &StageCheck, plan: &Plan, stage: Stage) -> Result<(), ExperimentError> {
    let Some(refusal) = check.refusal() else {
        return Ok(());
    };
    if stage == Stage::Devices && plan.override_reason.is_none() {
        return Err(refusal.into());
    }
    tracing::warn!("{refusal}");
    Ok(())
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
    devices: &DeviceNames,
    given: Option<Calibration>,
) -> Result<Plan, ExperimentError> {
    let calibration = match given {
        Some(calibration) => Some(calibration),
        None => configured_calibration(&plan.config, devices)?,
    };
    let mut plan = plan.clone();
    plan.devices = vec![
        ("amplifier", devices.amplifier.clone()),
        ("probe", devices.probe.clone()),
    ];
    plan.calibration = calibration;
    Ok(plan)
}

fn configured_calibration(
    config: &Config,
    devices: &DeviceNames,
) -> Result<Option<Calibration>, ExperimentError> {
    let devices = KnownDevices {
        amplifier: Some(&devices.amplifier),
        probe: Some(&devices.probe),
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
mod tests;
