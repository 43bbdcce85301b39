//! Runs plans on a bench: opens the rig, applies the calibration, runs the loop, and reports progress.

use std::path::PathBuf;
use std::time::SystemTime;

use serde::Serialize;

use super::error::ExperimentError;
use super::plan::Plan;
use super::run::{Run, run};
use crate::config::Config;
use crate::rig::calibration::{Calibration, ConnectedDevices, load_calibration};
use crate::rig::devices::{self, OpenRig};
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
    /// Folder for the recordings.
    pub folder: PathBuf,
}

impl Setup {
    /// The configured devices at their own pace.
    pub fn on_devices(folder: PathBuf) -> Setup {
        Setup {
            pace: Pace::Realtime,
            simulate: false,
            clear_fault: false,
            folder,
        }
    }

    /// The simulated stage as fast as possible.
    pub fn simulated(folder: PathBuf) -> Setup {
        Setup {
            pace: Pace::Virtual,
            simulate: true,
            clear_fault: false,
            folder,
        }
    }

    fn open(&self, config: &Config) -> Result<OpenRig, ExperimentError> {
        let mut opened = if self.simulate || devices::is_simulated(config) {
            devices::simulate(config)?
        } else {
            devices::open(config)?
        };
        for note in &opened.notes {
            tracing::warn!("{note}");
        }
        if self.clear_fault {
            opened.rig.reset_fault().map_err(|error| {
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
}

impl Runner {
    /// A runner whose progress is not shown.
    pub fn new(setup: Setup) -> Runner {
        Runner {
            setup,
            progress: Progress::default(),
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
        let opened = self.setup.open(&plan.config)?;
        let plan = calibrated(plan, &opened, calibration)?;
        self.progress.begin(phase, 0);
        let mut update = |done, total| self.progress.set(done, total);
        let (pace, folder) = (self.setup.pace, &self.setup.folder);
        Ok(run(&plan, opened.rig, pace, folder, &mut update)?)
    }
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
    let devices = ConnectedDevices {
        amplifier: &opened.amplifier,
        probe: &opened.probe,
    };
    let (settings, limit_a) = (&config.calibration, config.interlock.current_error_a);
    let loaded = load_calibration(settings, limit_a, Some(devices), SystemTime::now())?;
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
