//! What a run will do: made from the configuration and the texts it names, all of which travel with the recording, so that
//! the same plan can be made again from it.

use std::path::Path;

use super::plan_error::PlanError;
use super::swept_reference;
use crate::config::{Config, whole};
use crate::control::ControllerText;
use crate::excitation::{Extremes, ReferenceContext, Staircase, ZeroCurrent};
use crate::recording::Recording;
use crate::rt::program::{Control, Excite, Program};

/// Name of the attachment with the controller's text.
const CONTROLLER: &str = "controller.toml";
/// Name of the attachment with the calibration in use.
const CALIBRATION: &str = "calibration.toml";
/// Name of the attachment with the reference's points.
const REFERENCE: &str = "reference.csv";
/// Metadata key of the kind of run.
pub(super) const KIND: &str = "run";

/// The kind of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunKind {
    /// An excitation, open loop.
    Chirp,
    /// A closed loop with a reference.
    Control,
    /// Static steps.
    Calibrate,
    /// No current: where the stage rests.
    Quiet,
}

impl RunKind {
    /// The name in file names and metadata.
    pub fn name(self) -> &'static str {
        match self {
            RunKind::Chirp => "chirp",
            RunKind::Control => "control",
            RunKind::Calibrate => "calibrate",
            RunKind::Quiet => "quiet",
        }
    }
}

/// Everything that decides the commands of a run, but the probe.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What kind of run it is.
    pub kind: RunKind,
    /// The settings.
    pub config: Config,
    /// The controller, for a closed loop.
    pub controller: Option<ControllerText>,
    /// The calibration in use.
    pub calibration: Option<String>,
    /// Which devices, for the recording's metadata.
    pub devices: Vec<(&'static str, String)>,
    /// What a swept reference would do by the model.
    pub predicted_extremes: Option<Extremes>,
    /// The reference's file, if it has one.
    reference: Option<String>,
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
            calibration: None,
            devices: Vec::new(),
            predicted_extremes: None,
            reference: None,
        }
    }

    /// A closed loop. A swept reference without amplitudes gets them here, from the model, so that they travel with the
    /// recording.
    pub fn control(config: Config) -> Result<Plan, PlanError> {
        let controller = ControllerText::find(&config.control.controller)?;
        let (config, predicted_extremes) = swept_reference::planned(config, &controller)?;
        let reference = config.control.reference.design().text()?;
        let plan = Plan {
            controller: Some(controller),
            reference,
            predicted_extremes,
            ..Plan::excitation(RunKind::Control, config)
        };
        // A reference or a controller that cannot be built is refused before anything is announced.
        plan.program()?;
        Ok(plan)
    }

    /// The plan of a recorded run.
    pub fn of(recording: &Recording) -> Result<Plan, PlanError> {
        let config = whole(
            "the recording's configuration",
            recording
                .config_toml()
                .ok_or(PlanError::Missing("configuration"))?,
        )?;
        let text = |name| {
            recording
                .attachment(name)
                .map(|a| String::from_utf8_lossy(&a.data).into_owned())
        };
        let kind = match recording.metadata().get(KIND).map(String::as_str) {
            Some("chirp") => RunKind::Chirp,
            Some("control") => RunKind::Control,
            Some("calibrate") => RunKind::Calibrate,
            Some("quiet") => RunKind::Quiet,
            _ => return Err(PlanError::Missing("kind of run")),
        };
        let controller = text(CONTROLLER).map(|text| ControllerText {
            name: config.control.controller.clone(),
            text,
        });
        let calibration = text(CALIBRATION);
        Ok(Plan {
            controller,
            calibration,
            reference: text(REFERENCE),
            ..Plan::excitation(kind, config)
        })
    }

    /// What the file name of the recording says of the run: `chirp`, `prbs`, `control-fast-step`.
    pub fn label(&self) -> String {
        let config = &self.config;
        match self.kind {
            RunKind::Chirp => config.excitation.kind.name().into(),
            RunKind::Control => {
                let controller = file_stem(&config.control.controller);
                format!(
                    "control-{controller}-{}",
                    config.control.reference.design().name()
                )
            }
            RunKind::Calibrate | RunKind::Quiet => self.kind.name().into(),
        }
    }

    /// The program of the loop.
    pub fn program(&self) -> Result<Box<dyn Program>, PlanError> {
        let (config, period_s) = (&self.config, self.config.servo.period_s());
        match self.kind {
            RunKind::Chirp => return Ok(Box::new(Excite(config.chosen_excitation().build()))),
            RunKind::Calibrate => {
                return Ok(Box::new(Excite(Staircase::new(
                    &config.calibrate.steps(),
                    period_s,
                ))));
            }
            RunKind::Quiet => {
                let (settle_s, average_s) = (config.campaign.settle_s, config.campaign.average_s);
                let zero = ZeroCurrent::new(settle_s, average_s, period_s);
                return Ok(Box::new(Excite(zero)));
            }
            RunKind::Control => {}
        }
        let text = self
            .controller
            .as_ref()
            .ok_or(PlanError::Missing("controller"))?;
        let law = text.design(config.servo.rate_hz)?.law(period_s);
        let design = config.control.reference.design();
        let context = ReferenceContext {
            chirp: &config.chirp,
            period_s,
            file: self.reference.as_deref(),
        };
        let reference = design.build(&context)?;
        let settle = context.ticks(config.control.settle_s);
        let closed = design.closed_ticks(&context);
        let closed = closed.unwrap_or_else(|| context.ticks(config.control.duration_s));
        Ok(Box::new(Control::new(law, reference, settle, closed)))
    }

    /// The effective configuration as TOML.
    pub fn config_toml(&self) -> Result<String, PlanError> {
        toml::to_string(&self.config).map_err(|e| PlanError::Text(e.to_string()))
    }

    /// Texts that the configuration names, for the recording.
    pub fn attachments(&self) -> Vec<(&'static str, &'static str, &str)> {
        let controller = self
            .controller
            .as_ref()
            .map(|c| (CONTROLLER, "application/toml", c.text.as_str()));
        let reference = self
            .reference
            .as_ref()
            .map(|text| (REFERENCE, "text/csv", text.as_str()));
        let calibration = self
            .calibration
            .as_ref()
            .map(|text| (CALIBRATION, "application/toml", text.as_str()));
        controller
            .into_iter()
            .chain(reference)
            .chain(calibration)
            .collect()
    }
}

/// The name of a controller or of its file, without what does not belong into a file name.
fn file_stem(name: &str) -> String {
    let stem = Path::new(name).file_stem().unwrap_or_default();
    let is_plain = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    stem.to_string_lossy().chars().filter(is_plain).collect()
}
