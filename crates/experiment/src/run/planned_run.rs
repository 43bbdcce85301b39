//! A run as one process orders it from the process that owns the rig, and the report of that process.

use std::fmt::Debug;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::remembered_motor::MotorHandling;
use crate::certificate::{CertificateText, OverrideReason};
use crate::errors::ExperimentError;
use crate::live::{RemoteRecording, Run, RunEnd, RunFile};
use crate::plan::{Description, Plan, PlanError, RunKind};
use bench_base::progress::Progress;
use bench_control::ControllerText;
use bench_excitation::command::CommandFilter;
use bench_recording::Totals;
use bench_rig::calibration::Calibration;
use bench_rt::thread::Pace;

/// Everything that the owner of a rig needs for a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PlannedRun {
    /// Kind of the run.
    pub kind: RunKind,
    /// The settings as TOML.
    pub config_toml: String,
    /// Name and text of the controller.
    controller: Option<(String, String)>,
    /// Text of the file of the reference.
    reference: Option<String>,
    /// The filters of the command.
    #[serde(default)]
    command: Option<CommandFilter>,
    /// A calibration instead of the configured one, as TOML.
    calibration_toml: Option<String>,
    /// The certificate of a closed loop.
    #[serde(default)]
    certificate: Option<CertificateText>,
    /// Why an operator closes the loop without a valid certificate.
    #[serde(default)]
    override_reason: Option<OverrideReason>,
    /// Pace, motor and folder. The folder is an absolute path.
    pub conditions: RunConditions,
    /// Name, note and operator of the run.
    #[serde(default)]
    pub description: Description,
}

/// What a run needs besides its plan.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunConditions {
    /// Pace of the loop.
    pub pace: Pace,
    /// Whether a stored fault of the amplifier is cleared first. The operator confirms that its cause was removed.
    pub clear_fault: bool,
    /// How the thermal state of the motor is treated.
    pub motor: MotorHandling,
    /// Folder for the recordings.
    pub folder: PathBuf,
}

impl PlannedRun {
    /// The order of a plan.
    pub(super) fn of(
        plan: &Plan,
        conditions: &RunConditions,
        calibration: Option<&Calibration>,
    ) -> Result<PlannedRun, ExperimentError> {
        let mut plan = plan.clone();
        let file = plan.config.calibration.file.as_mut();
        // A file that is missing is named as the user named it.
        if let Some(file) = file.filter(|file| Path::new(file).exists()) {
            *file = absolute(Path::new(file))?.display().to_string();
        }
        let calibration_toml = calibration.map(Calibration::to_toml).transpose();
        Ok(PlannedRun {
            kind: plan.kind,
            config_toml: plan.config_toml()?,
            reference: plan.reference_file().map(String::from),
            command: plan.command_filter().cloned(),
            certificate: plan.certificate,
            override_reason: plan.override_reason,
            controller: plan.controller.map(|found| (found.name, found.text)),
            calibration_toml: calibration_toml
                .map_err(|error| PlanError::Text(error.to_string()))?,
            conditions: RunConditions {
                folder: absolute(&conditions.folder)?,
                ..conditions.clone()
            },
            description: plan.description,
        })
    }

    /// The plan.
    ///
    /// # Errors
    /// When its texts cannot be read.
    pub fn plan(&self) -> Result<Plan, PlanError> {
        let config = bench_config::whole("the ordered configuration", &self.config_toml)?;
        let controller = self.controller.clone();
        let controller = controller.map(|(name, text)| ControllerText { name, text });
        let mut plan = Plan::with_texts(
            self.kind,
            config,
            controller,
            self.reference.clone(),
            self.command.clone(),
        );
        plan.certificate.clone_from(&self.certificate);
        plan.override_reason.clone_from(&self.override_reason);
        plan.description.clone_from(&self.description);
        Ok(plan)
    }

    /// A calibration instead of the configured one.
    ///
    /// # Errors
    /// When its text cannot be read.
    pub fn calibration(&self) -> Result<Option<Calibration>, PlanError> {
        let text = self.calibration_toml.as_deref();
        let calibration = text.map(|text| bench_settings::typed("the ordered calibration", text));
        Ok(calibration.transpose()?)
    }
}

fn absolute(path: &Path) -> Result<PathBuf, ExperimentError> {
    let made = std::path::absolute(path);
    made.map_err(|error| {
        let path = path.display();
        ExperimentError::Failed(format!(
            "{path} has no absolute path: {error}; start the command in a folder that exists"
        ))
    })
}

/// A run that has ended in the process that owns the rig. Its recording is still open for results.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunReport {
    end: RunEnd,
    totals: Totals,
}

impl RunReport {
    /// Reports a run of this process.
    ///
    /// # Errors
    /// When the recording cannot be completed.
    pub fn of(run: &mut Run) -> Result<RunReport, ExperimentError> {
        Ok(RunReport {
            totals: run.totals()?,
            end: run.end.clone(),
        })
    }

    /// Path of the recording in the process that owns the rig.
    pub fn path(&self) -> &Path {
        &self.totals.path
    }

    /// The run, as this process knows it. `folder` is the folder of the order as the user named it.
    fn run(self, recording: Box<dyn RemoteRecording>, folder: &Path) -> Run {
        let name = self.totals.path.file_name().unwrap_or_default();
        Run {
            path: folder.join(name),
            end: self.end,
            file: RunFile::Remote {
                totals: self.totals,
                recording,
            },
        }
    }
}

/// Another process that owns the rig and runs orders.
pub trait RigOwner: Debug + Send + Sync {
    /// Runs an order, reports its progress, and returns when it has ended. A stop signal of this process ends the run.
    ///
    /// # Errors
    /// When the owner refuses the order, when the run fails, or when the owner cannot be reached.
    fn run(
        &self,
        order: &PlannedRun,
        progress: &Progress,
    ) -> Result<(RunReport, Box<dyn RemoteRecording>), ExperimentError>;
}

/// Runs a plan in the process that owns the rig.
pub(super) fn run_elsewhere(
    owner: &dyn RigOwner,
    plan: &Plan,
    conditions: &RunConditions,
    calibration: Option<&Calibration>,
    progress: &Progress,
) -> Result<Run, ExperimentError> {
    let order = PlannedRun::of(plan, conditions, calibration)?;
    let (report, recording) = owner.run(&order, progress)?;
    Ok(report.run(recording, &conditions.folder))
}
