//! The plan of a run: the configuration and the files that it names. The recording contains all of them, so that the same plan
//! can be made from it again.

use std::f64::consts::TAU;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::command_plan::{self, CommandPlan, CommandSummary};
use super::description::Description;
use super::loop_check::closed_loop_of;
use super::motor_start::MotorStart;
use super::plan_error::PlanError;
use super::reference_check::{self, PlannedReference};
use super::swept_reference;
use crate::certificate::{CertificateText, OverrideReason};
use crate::stage_check::RestAfterCheck;
use bench_config::{CampaignSettings, Config, PlantSettings, whole};
use bench_control::ControllerText;
use bench_excitation::command::CommandFilter;
use bench_excitation::{Extremes, StageCheckSettings, StageCheckSignal, Staircase, ZeroCurrent};
use bench_plant::ModalModel;
use bench_recording::Recording;
use bench_rig::calibration::{Calibration, Correction};
use bench_rt::program::{Control, Excite, Program};

/// Name of the attachment with the controller.
const CONTROLLER: &str = "controller.toml";
/// Name of the attachment with the calibration in use.
pub(crate) const CALIBRATION: &str = "calibration.toml";
/// Name of the attachment with the points of the reference.
const REFERENCE: &str = "reference.csv";
/// Name of the attachment with the filters of the command.
const COMMAND: &str = "command.toml";
/// Name of the attachment with the certificate.
const CERTIFICATE: &str = "certificate.json";
/// Name of the attachment with the frequency response of the certificate.
const CERTIFICATE_FRF: &str = "certificate_frf.csv";
/// Name of the attachment with the settings of a stage check.
const STAGE_CHECK: &str = "stage_check.toml";
/// Metadata key of [`Plan::override_reason`].
pub(crate) const OVERRIDE: &str = "override";
/// Metadata key of the kind of run.
pub(crate) const KIND: &str = "run";
/// Metadata key of [`Plan::ramp_ticks`]. Recordings of older versions do not have it: the current ended in one step.
pub(crate) const RAMP_TICKS: &str = "ramp_ticks";
/// The longest ramp to zero current that is chosen from the model, in seconds.
const LONGEST_RAMP_S: f64 = 2.0;
/// Metadata key of the thermal state of the motor at the start, in A^2.
pub(crate) const MOTOR_THERMAL: &str = "motor_thermal_a2";
/// Metadata key of how that state was known.
pub(crate) const MOTOR_KNOWN_FROM: &str = "motor_known_from";

/// The kind of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunKind {
    /// An excitation, open loop.
    Chirp,
    /// A closed loop with a reference.
    Control,
    /// Static steps.
    Calibrate,
    /// No current, to measure the rest position.
    Quiet,
    /// A small step with two tones, open loop, before a loop closes.
    StageCheck,
}

impl RunKind {
    const ALL: [RunKind; 5] = [
        RunKind::Chirp,
        RunKind::Control,
        RunKind::Calibrate,
        RunKind::Quiet,
        RunKind::StageCheck,
    ];

    /// The name in file names and metadata.
    pub fn name(self) -> &'static str {
        match self {
            RunKind::Chirp => "chirp",
            RunKind::Control => "control",
            RunKind::Calibrate => "calibrate",
            RunKind::Quiet => "quiet",
            RunKind::StageCheck => "stage-check",
        }
    }
}

/// Everything that determines the commands of a run, except the readings of the probe.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Kind of the run.
    pub kind: RunKind,
    /// The settings.
    pub config: Config,
    /// The controller, for a closed loop.
    pub controller: Option<ControllerText>,
    /// Name, note and operator of the run.
    pub description: Description,
    /// The calibration in use.
    pub calibration: Option<Calibration>,
    /// Descriptions of the devices, for the metadata of the recording.
    pub devices: Vec<(&'static str, String)>,
    /// The thermal state of the motor with which the interlocks start.
    pub motor: MotorStart,
    /// The certificate of a closed loop, if one is configured.
    pub certificate: Option<CertificateText>,
    /// Why an operator closes the loop without a valid certificate.
    pub override_reason: Option<OverrideReason>,
    /// Step and tones of a stage check.
    pub stage_check: Option<StageCheckSettings>,
    /// The rest between the check of the stage and the closing of the loop, with a certificate. It is part of
    /// `config.control.settle_s`.
    pub rest_after_check: Option<RestAfterCheck>,
    /// Extremes of a swept reference by the model.
    pub predicted_extremes: Option<Extremes>,
    /// Text of the file of the reference, if it has one.
    reference: Option<String>,
    /// The planned command of a closed loop, if it has one beside its reference.
    command: Option<CommandPlan>,
}

impl Plan {
    /// An excitation.
    pub fn chirp(config: Config) -> Plan {
        Plan::excitation(RunKind::Chirp, config)
    }

    /// Static steps.
    pub fn calibrate(config: Config) -> Plan {
        Plan::excitation(RunKind::Calibrate, config)
    }

    /// No current.
    pub fn quiet(config: Config) -> Plan {
        Plan::excitation(RunKind::Quiet, config)
    }

    fn excitation(kind: RunKind, config: Config) -> Plan {
        Plan {
            kind,
            config,
            controller: None,
            description: Description::default(),
            calibration: None,
            devices: Vec::new(),
            motor: MotorStart::default(),
            certificate: None,
            override_reason: None,
            stage_check: None,
            rest_after_check: None,
            predicted_extremes: None,
            reference: None,
            command: None,
        }
    }

    /// A closed loop. The amplitudes of a swept reference without any are computed here from the model, so that the recording
    /// contains them.
    pub fn control(config: Config) -> Result<Plan, PlanError> {
        let controller = ControllerText::find(&config.control.controller)?;
        let (mut config, predicted_extremes) = swept_reference::planned(config, &controller)?;
        let is_swept = config.control.reference.is_swept();
        let reference = config.control.reference.design().text()?;
        let command = command_plan::planned(&config, &controller)?;
        let certificate = config.control.certificate.as_deref();
        let certificate = certificate.map(CertificateText::read).transpose()?;
        let rest_after_check = rest_after_check(certificate.as_ref(), &controller, &config)?;
        if let Some(rest) = rest_after_check {
            config.control.settle_s = rest.rest_s;
        }
        let plan = Plan {
            command,
            controller: Some(controller),
            reference,
            certificate,
            rest_after_check,
            predicted_extremes,
            ..Plan::excitation(RunKind::Control, config)
        };
        // Refuses a reference or a controller that cannot be built before the plan is shown.
        plan.program()?;
        if let Some(controller) = plan.controller.as_ref().filter(|_| !is_swept) {
            reference_check::predicted(&plan.planned_reference(), controller)?;
        }
        Ok(plan)
    }

    /// The check of the stage before this plan, with the same rig, calibration and evidence.
    pub(crate) fn stage_check(&self, settings: StageCheckSettings) -> Plan {
        Plan {
            description: self.description.clone(),
            calibration: self.calibration.clone(),
            devices: self.devices.clone(),
            certificate: self.certificate.clone(),
            override_reason: self.override_reason.clone(),
            stage_check: Some(settings),
            ..Plan::excitation(RunKind::StageCheck, self.config.clone())
        }
    }

    /// The plan with the reason of an operator for closing the loop without a valid certificate.
    pub fn with_override(self, reason: Option<OverrideReason>) -> Plan {
        Plan {
            override_reason: reason,
            ..self
        }
    }

    /// The plan of a recorded run.
    pub fn of(recording: &Recording) -> Result<Plan, PlanError> {
        let config = recording.config_toml();
        let config = config.ok_or(PlanError::Missing("configuration"))?;
        let config = whole("the configuration of the recording", config)?;
        let controller = attached_text(recording, CONTROLLER).map(|text| ControllerText {
            name: config.control.controller.clone(),
            text,
        });
        let command = attached_command(recording)?;
        if command.is_none() && config.control.has_command() {
            return Err(PlanError::Missing("command"));
        }
        let calibration = attached_text(recording, CALIBRATION);
        let calibration = calibration
            .map(|text| bench_settings::typed("the calibration of the recording", &text));
        Ok(Plan {
            controller,
            description: Description::of(recording),
            calibration: calibration.transpose()?,
            reference: attached_text(recording, REFERENCE),
            command,
            stage_check: attached_stage_check(recording)?,
            motor: motor_start(recording)?,
            ..Plan::excitation(kind(recording)?, config)
        })
    }

    /// A plan of another process, with the texts of its files.
    pub(crate) fn with_texts(
        kind: RunKind,
        config: Config,
        controller: Option<ControllerText>,
        reference: Option<String>,
        command: Option<CommandFilter>,
    ) -> Plan {
        Plan {
            controller,
            reference,
            command: command.map(CommandPlan::from),
            ..Plan::excitation(kind, config)
        }
    }

    /// Extremes of a closed loop with its reference, by the model; `None` for an unstable loop, of which nothing can be
    /// predicted, and for an open loop.
    ///
    /// # Errors
    /// When the reference cannot be built, or would trip an interlock.
    pub fn loop_extremes(&self) -> Result<Option<Extremes>, PlanError> {
        match &self.controller {
            Some(_) if self.config.control.reference.is_swept() => Ok(self.predicted_extremes),
            Some(controller) => reference_check::predicted(&self.planned_reference(), controller),
            None => Ok(None),
        }
    }

    /// The filters of the command, if it is not the reference alone.
    pub fn command_filter(&self) -> Option<&CommandFilter> {
        self.command.as_ref().map(|command| &command.filter)
    }

    /// Figures of the planned command; `None` without one, and for a plan that was read from a recording.
    pub fn command_summary(&self) -> Option<&CommandSummary> {
        self.command.as_ref()?.summary.as_ref()
    }

    /// The reference with what its command needs.
    pub(super) fn planned_reference(&self) -> PlannedReference<'_> {
        PlannedReference {
            config: &self.config,
            file: self.reference_file(),
            filter: self.command_filter(),
        }
    }

    /// Text of the file of the reference, if it has one.
    pub(crate) fn reference_file(&self) -> Option<&str> {
        self.reference.as_deref()
    }

    /// The run as described in the file name of its recording: `chirp`, `prbs`, `control-fast-step`.
    pub fn label(&self) -> String {
        let config = &self.config;
        match self.kind {
            RunKind::Chirp => config.excitation.kind.name().into(),
            RunKind::Control => {
                let controller = file_stem(&config.control.controller);
                let reference = config.control.reference.kind();
                format!("control-{controller}-{reference}")
            }
            RunKind::Calibrate | RunKind::Quiet | RunKind::StageCheck => self.kind.name().into(),
        }
    }

    /// The program of the loop.
    pub fn program(&self) -> Result<Box<dyn Program>, PlanError> {
        let (config, period_s) = (&self.config, self.config.servo.period_s());
        Ok(match self.kind {
            RunKind::Chirp => Box::new(Excite(config.chosen_excitation()?.build())),
            RunKind::Control => Box::new(self.control_program()?),
            RunKind::Calibrate => {
                Box::new(Excite(Staircase::new(&config.calibrate.steps(), period_s)))
            }
            RunKind::Quiet => Box::new(Excite(zero_current(&config.campaign, period_s))),
            RunKind::StageCheck => {
                let settings = self.stage_check.as_ref();
                let settings = settings.ok_or(PlanError::Missing("stage check"))?;
                Box::new(Excite(StageCheckSignal::new(settings, period_s)))
            }
        })
    }

    fn control_program(&self) -> Result<Control, PlanError> {
        let (control, servo) = (&self.config.control, &self.config.servo);
        let controller = self.controller.as_ref();
        let controller = controller.ok_or(PlanError::Missing("controller"))?;
        let law = controller.design(servo.rate_hz)?.law(servo.period_s());
        let design = control.reference.design();
        let reference = self.planned_reference();
        let context = reference.context();
        let settle = context.ticks(control.settle_s);
        let closed = design.closed_ticks(&context);
        let closed = closed.unwrap_or_else(|| context.ticks(control.duration_s));
        let command = reference.command()?;
        Ok(Control::with_command(law, command, settle, closed))
    }

    /// Length of each of the two ramps at the end of the run in ticks.
    pub fn ramp_ticks(&self) -> Result<u64, PlanError> {
        let servo = &self.config.servo;
        let ramp_s = match servo.stop_ramp_s {
            Some(ramp_s) => ramp_s,
            None => three_periods_s(&self.config.plant)?,
        };
        Ok(libm::round(ramp_s * servo.rate_hz) as u64)
    }

    /// The effective configuration as TOML.
    pub fn config_toml(&self) -> Result<String, PlanError> {
        toml::to_string(&self.config).map_err(|e| PlanError::Text(e.to_string()))
    }

    /// The correction by the calibration in use.
    pub fn correction(&self) -> Option<Correction> {
        self.calibration.as_ref().map(Correction::from)
    }

    /// The files that the configuration names, as name, media type and text.
    pub fn attachments(&self) -> Result<Vec<(&'static str, &'static str, String)>, PlanError> {
        let controller = self.controller.as_ref().map(|found| found.text.clone());
        let calibration = self.calibration.as_ref().map(Calibration::to_toml);
        let calibration = calibration
            .transpose()
            .map_err(|error| PlanError::Text(error.to_string()))?;
        let command = self.command_filter().map(toml::to_string);
        let command = command
            .transpose()
            .map_err(|error| PlanError::Text(error.to_string()))?;
        let certificate = self.certificate.as_ref();
        let stage_check = self.stage_check.as_ref().map(toml::to_string).transpose();
        let stage_check = stage_check.map_err(|error| PlanError::Text(error.to_string()))?;
        let attachments = [
            (COMMAND, "application/toml", command),
            (CONTROLLER, "application/toml", controller),
            (REFERENCE, "text/csv", self.reference.clone()),
            (CALIBRATION, "application/toml", calibration),
            (
                CERTIFICATE,
                "application/json",
                certificate.map(|text| text.json.clone()),
            ),
            (
                CERTIFICATE_FRF,
                "text/csv",
                certificate.map(|text| text.frf_csv.clone()),
            ),
            (STAGE_CHECK, "application/toml", stage_check),
        ];
        let present = attachments.into_iter();
        let present = present.filter_map(|(name, media, text)| Some((name, media, text?)));
        Ok(present.collect())
    }
}

fn zero_current(campaign: &CampaignSettings, period_s: f64) -> ZeroCurrent {
    ZeroCurrent::new(campaign.settle_s, campaign.average_s, period_s)
}

/// Three periods of the first mode of the model in seconds, at most [`LONGEST_RAMP_S`]. A free body is not a mode.
fn three_periods_s(plant: &PlantSettings) -> Result<f64, PlanError> {
    let model = ModalModel::of(&bench_plant::build(plant)?)?;
    let frequencies = model.modes.iter().map(|mode| mode.omega_rad_s / TAU);
    let first_hz = frequencies.filter(|hz| *hz > 0.0).reduce(f64::min);
    Ok(first_hz.map_or(LONGEST_RAMP_S, |hz| (3.0 / hz).min(LONGEST_RAMP_S)))
}

fn kind(recording: &Recording) -> Result<RunKind, PlanError> {
    let name = recording.metadata().get(KIND);
    let mut kind = RunKind::ALL.into_iter();
    let kind = kind.find(|kind| name.is_some_and(|name| name == kind.name()));
    kind.ok_or(PlanError::Missing("kind of run"))
}

/// The recorded thermal state of the motor; recordings of older versions began with a cold motor.
fn motor_start(recording: &Recording) -> Result<MotorStart, PlanError> {
    let metadata = recording.metadata();
    let thermal_a2 = match metadata.get(MOTOR_THERMAL) {
        None => 0.0,
        Some(text) => thermal_a2(text).ok_or_else(|| PlanError::MotorThermal(text.clone()))?,
    };
    Ok(MotorStart {
        thermal_a2,
        known_from: metadata.get(MOTOR_KNOWN_FROM).cloned().unwrap_or_default(),
    })
}

fn thermal_a2(text: &str) -> Option<f64> {
    let value: f64 = text.parse().ok()?;
    (value.is_finite() && value >= 0.0).then_some(value)
}

/// The rest after the check of the stage. A damaged certificate is refused later, by the check of the evidence.
fn rest_after_check(
    certificate: Option<&CertificateText>,
    controller: &ControllerText,
    config: &Config,
) -> Result<Option<RestAfterCheck>, PlanError> {
    let Some(Ok(loaded)) = certificate.map(CertificateText::load) else {
        return Ok(None);
    };
    let model = closed_loop_of(controller, config)?;
    Ok(RestAfterCheck::of(&loaded, &model, config))
}

fn attached_stage_check(recording: &Recording) -> Result<Option<StageCheckSettings>, PlanError> {
    let Some(text) = attached_text(recording, STAGE_CHECK) else {
        return Ok(None);
    };
    let settings = toml::from_str(&text);
    settings.map_err(|_| PlanError::Missing("readable stage check"))
}

fn attached_text(recording: &Recording, name: &str) -> Option<String> {
    let attachment = recording.attachment(name)?;
    Some(String::from_utf8_lossy(&attachment.data).into_owned())
}

/// The filters of the recorded command.
fn attached_command(recording: &Recording) -> Result<Option<CommandPlan>, PlanError> {
    let Some(text) = attached_text(recording, COMMAND) else {
        return Ok(None);
    };
    let filter: Result<CommandFilter, toml::de::Error> = toml::from_str(&text);
    match filter {
        Ok(filter) => Ok(Some(CommandPlan::from(filter))),
        Err(error) => Err(PlanError::DamagedCommand(error.message().into())),
    }
}

/// The name of a controller or of its file, without characters that are unusual in file names.
fn file_stem(name: &str) -> String {
    let stem = Path::new(name).file_stem().unwrap_or_default();
    let is_plain = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    stem.to_string_lossy().chars().filter(is_plain).collect()
}
