//! Whether a loop may close with the evidence of its plan. Every process that runs a plan asks this function: the command line, and
//! the daemon that owns the devices.

use std::time::SystemTime;

use serde::Serialize;

use super::band::Band;
use super::check::{Connected, Today, conditions};
use super::condition::{Checked, Condition, Subject};
use crate::analysis::{FrfError, points};
use crate::certificate::{CertificateDefects, CertificateError, LoadedCertificate};
use crate::errors::ExperimentError;
use crate::live::DeviceNames;
use crate::plan::{Plan, PlanError, Stage, closed_loop_of};
use crate::stage_check::RestAfterCheck;
use bench_base::decimal::Decimal;
use bench_control::measured::{LowerMargin, MeasuredLoop, Stability};
use bench_control::{ClosedLoop, ControllerText};
use bench_plant::SignalPath;
use bench_rig::calibration::Calibration;

/// The evidence with which a loop closes. The names in JSON must not change.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Evidence {
    /// Path of the certificate, if one is given.
    pub certificate: Option<String>,
    /// Wall time of its chirp (RFC 3339).
    pub made: Option<String>,
    /// Lower 95 % bound of the modulus margin by the measured response.
    pub modulus_margin_lower: Option<f64>,
    /// Its frequency in hertz.
    pub modulus_margin_at_hz: Option<f64>,
    /// What must agree with the certificate, and whether it does.
    pub conditions: Vec<Condition>,
    /// What is wrong with the certificate, or that none is given on devices: accepted on the simulated stage, or by an override.
    pub defects: Vec<String>,
    /// The time with zero current between the check of the stage and the closing of the loop.
    pub rest_after_check: Option<RestAfterCheck>,
    /// The reason of the operator for closing the loop without a valid certificate.
    #[serde(rename = "override")]
    pub override_reason: Option<String>,
}

/// The rig of a run: devices and calibration, which are known when it is open.
#[derive(Clone, Copy, Debug)]
pub struct OpenRig<'a> {
    /// Identities of the devices.
    pub devices: &'a DeviceNames,
    /// The calibration in use.
    pub calibration: Option<&'a Calibration>,
}

/// Refuses a closed loop on devices without a certificate that belongs to this rig, unless the plan has the reason of an operator.
/// On the simulated stage, defects of a certificate are only reported. Devices and calibration are compared if `rig` is known.
/// A plan without a controller needs no evidence.
///
/// # Errors
/// With all defects; when certificate, controller or model cannot be used.
pub fn require_evidence(
    plan: &Plan,
    stage: Stage,
    rig: Option<OpenRig<'_>>,
) -> Result<Evidence, ExperimentError> {
    let (evidence, defects) = examined(plan, stage, rig)?;
    let is_accepted = stage == Stage::Simulated || plan.override_reason.is_some();
    match CertificateDefects::of(defects).filter(|_| !is_accepted) {
        Some(defects) => Err(defects.into()),
        None => Ok(evidence),
    }
}

/// As [`require_evidence`], and warns of accepted defects.
///
/// # Errors
/// Those of [`require_evidence`].
pub fn require_evidence_or_warn(
    plan: &Plan,
    stage: Stage,
    rig: OpenRig<'_>,
) -> Result<Evidence, ExperimentError> {
    let evidence = require_evidence(plan, stage, Some(rig))?;
    for defect in &evidence.defects {
        tracing::warn!("{defect}");
    }
    Ok(evidence)
}

fn examined(
    plan: &Plan,
    stage: Stage,
    rig: Option<OpenRig<'_>>,
) -> Result<(Evidence, Vec<CertificateError>), ExperimentError> {
    let Some(controller) = &plan.controller else {
        return Ok((Evidence::default(), Vec::new()));
    };
    let (mut evidence, defects) = match (&plan.certificate, stage) {
        (Some(text), _) => {
            let examined = Examined {
                plan,
                controller,
                name: &text.name,
                loaded: &text.load().map_err(PlanError::from)?,
            };
            examined.evidence(rig)?
        }
        (None, Stage::Devices) => (Evidence::default(), vec![CertificateError::Missing]),
        (None, Stage::Simulated) => (Evidence::default(), Vec::new()),
    };
    evidence.defects = defects.iter().map(ToString::to_string).collect();
    evidence.override_reason = plan.override_reason.as_ref().map(ToString::to_string);
    Ok((evidence, defects))
}

/// A plan with its certificate.
struct Examined<'a> {
    plan: &'a Plan,
    controller: &'a ControllerText,
    /// Path of the certificate.
    name: &'a str,
    loaded: &'a LoadedCertificate,
}

impl Examined<'_> {
    /// The evidence and all defects of the certificate.
    fn evidence(
        &self,
        rig: Option<OpenRig<'_>>,
    ) -> Result<(Evidence, Vec<CertificateError>), ExperimentError> {
        let connected = rig.map(connected).transpose()?;
        let certificate = &self.loaded.certificate;
        let today = Today {
            config: &self.plan.config,
            controller: self.controller,
            connected: connected.as_ref(),
            now: SystemTime::now(),
        };
        let mut checked = conditions(certificate, &today)?;
        let margin = self.measured_margin(&mut checked)?;
        let (conditions, defects): (Vec<_>, Vec<_>) = checked
            .into_iter()
            .map(|checked| (checked.condition, checked.defect))
            .unzip();
        let evidence = Evidence {
            certificate: Some(self.name.into()),
            made: Some(certificate.made.clone()),
            modulus_margin_lower: margin.map(|margin| margin.margin),
            modulus_margin_at_hz: margin.map(|margin| margin.at_hz),
            conditions,
            rest_after_check: self.plan.rest_after_check,
            ..Evidence::default()
        };
        Ok((evidence, defects.into_iter().flatten().collect()))
    }

    /// The lower bound of the modulus margin by the measured response; adds the conditions on band and margin. There is no bound if
    /// the loop is unstable by the model: other checks decide about it.
    fn measured_margin(
        &self,
        checked: &mut Vec<Checked>,
    ) -> Result<Option<LowerMargin>, ExperimentError> {
        let config = &self.plan.config;
        let model = closed_loop_of(self.controller, config)?;
        let margins = model.margins();
        if !margins.stable {
            return Ok(None);
        }
        let frf = &self.loaded.frf;
        let probe_period_s = config.probe.rate_hz.map(|rate_hz| 1.0 / rate_hz);
        if let Some(needed) = Band::needed(&model, &margins, probe_period_s) {
            let missing = needed.missing_in(&frf.frequency_hz);
            let is_missing = missing.is_some();
            let certified = &self.loaded.certificate.frf;
            checked.push(Checked::new(
                Subject::Band,
                band_text(certified.from_hz, certified.to_hz),
                band_text(needed.from_hz, needed.to_hz),
                missing,
            ));
            if is_missing {
                return Ok(None);
            }
        }
        let lower = self.lower_margin(&model)?;
        let least = config.control.min_modulus_margin;
        let margin = Decimal(lower.margin);
        checked.push(Checked::new(
            Subject::ModulusMargin,
            format!("at least {margin:.3} (95 %)"),
            format!("limit {least}"),
            margin_defect(&lower, least),
        ));
        Ok(Some(lower))
    }

    fn lower_margin(&self, model: &ClosedLoop) -> Result<LowerMargin, ExperimentError> {
        let points = points(&self.loaded.frf, &SignalPath::from(&self.plan.config));
        let law = |w: f64| model.law_response(w);
        let measured_band = points.first().zip(points.last());
        let further = measured_band.map_or(Vec::new(), |(first, last)| {
            model.frequencies(first.omega_rad_s, last.omega_rad_s)
        });
        let measured = MeasuredLoop::new(&points, &law, &further).map_err(|error| {
            PlanError::from(CertificateError::Damaged {
                file: self.name.into(),
                why: error.to_string().replace(';', ","),
            })
        })?;
        LowerMargin::of(&measured, model).ok_or(ExperimentError::Frf(FrfError::Poles))
    }
}

fn band_text(from_hz: f64, to_hz: f64) -> String {
    format!("{from_hz:.1} to {to_hz:.1} Hz")
}

fn connected(rig: OpenRig<'_>) -> Result<Connected<'_>, PlanError> {
    let calibration = rig.calibration.map(Calibration::to_toml).transpose();
    Ok(Connected {
        amplifier: &rig.devices.amplifier,
        probe: &rig.devices.probe,
        calibration: calibration.map_err(|error| PlanError::Text(error.to_string()))?,
    })
}

/// Why the measured loop may not close.
fn margin_defect(lower: &LowerMargin, least: f64) -> Option<CertificateError> {
    let LowerMargin { margin, at_hz, .. } = *lower;
    // Written this way, a margin that is not a number is too low.
    let is_enough = margin >= least && margin > 0.0;
    match lower.stability {
        Stability::Unstable => Some(CertificateError::Unstable),
        _ if !is_enough => Some(CertificateError::LowMargin {
            margin,
            at_hz,
            least,
        }),
        Stability::Undecided => Some(CertificateError::Undecided {
            sigmas: lower.distance_sigmas,
        }),
        Stability::Stable => None,
    }
}
