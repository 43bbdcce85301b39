//! Whether a loop may close with the evidence of its plan. Every process that runs a plan asks this function: the command line, and
//! the daemon that owns the devices.

use std::time::SystemTime;

use serde::Serialize;

use super::check::{Connected, defects};
use super::error::CertificateError;
use super::file::LoadedCertificate;
use super::margin::{LowerMargin, MeasuredLoop};
use crate::experiment::error::ExperimentError;
use crate::experiment::loop_check::{Stage, closed_loop_of};
use crate::experiment::open_bench::DeviceNames;
use crate::experiment::plan::Plan;
use crate::experiment::plan_error::PlanError;
use crate::rig::calibration::Calibration;

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
    /// What is wrong with the certificate, or that none is given on devices: accepted on the simulated stage, or by an override.
    pub defects: Vec<String>,
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
/// With the first defect; when certificate, controller or model cannot be used.
pub fn require_evidence(
    plan: &Plan,
    stage: Stage,
    rig: Option<OpenRig<'_>>,
) -> Result<Evidence, ExperimentError> {
    let (evidence, defects) = examined(plan, stage, rig)?;
    let is_accepted = stage == Stage::Simulated || plan.override_reason.is_some();
    match defects.into_iter().next().filter(|_| !is_accepted) {
        Some(defect) => Err(defect.into()),
        None => Ok(evidence),
    }
}

/// As [`require_evidence`], and warns of accepted defects.
///
/// # Errors
/// Those of [`require_evidence`].
pub(in crate::experiment) fn require_evidence_or_warn(
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
    if plan.controller.is_none() {
        return Ok((Evidence::default(), Vec::new()));
    }
    let (mut evidence, defects) = match (&plan.certificate, stage) {
        (Some(text), _) => of_certificate(
            plan,
            &text.name,
            &text.load().map_err(PlanError::from)?,
            rig,
        )?,
        (None, Stage::Devices) => (Evidence::default(), vec![CertificateError::Missing]),
        (None, Stage::Simulated) => (Evidence::default(), Vec::new()),
    };
    evidence.defects = defects.iter().map(ToString::to_string).collect();
    evidence.override_reason = plan.override_reason.as_ref().map(ToString::to_string);
    Ok((evidence, defects))
}

fn of_certificate(
    plan: &Plan,
    name: &str,
    loaded: &LoadedCertificate,
    rig: Option<OpenRig<'_>>,
) -> Result<(Evidence, Vec<CertificateError>), ExperimentError> {
    let connected = rig.map(connected).transpose()?;
    let certificate = &loaded.certificate;
    let mut defects = defects(
        certificate,
        &plan.config,
        connected.as_ref(),
        SystemTime::now(),
    )?;
    let margin = measured_margin(plan, loaded, &mut defects)?;
    let evidence = Evidence {
        certificate: Some(name.into()),
        made: Some(certificate.made.clone()),
        modulus_margin_lower: margin.map(|margin| margin.margin),
        modulus_margin_at_hz: margin.map(|margin| margin.at_hz),
        ..Evidence::default()
    };
    Ok((evidence, defects))
}

fn connected(rig: OpenRig<'_>) -> Result<Connected<'_>, PlanError> {
    let calibration = rig.calibration.map(Calibration::to_toml).transpose();
    Ok(Connected {
        amplifier: &rig.devices.amplifier,
        probe: &rig.devices.probe,
        calibration: calibration.map_err(|error| PlanError::Text(error.to_string()))?,
    })
}

/// The lower bound of the modulus margin by the measured response, and its defects. There is no bound if the loop is unstable by the
/// model: other checks decide about it.
fn measured_margin(
    plan: &Plan,
    loaded: &LoadedCertificate,
    defects: &mut Vec<CertificateError>,
) -> Result<Option<LowerMargin>, PlanError> {
    let config = &plan.config;
    let controller = plan.controller.as_ref();
    let model = closed_loop_of(controller.ok_or(PlanError::Missing("controller"))?, config)?;
    let margins = model.margins();
    if !margins.stable {
        return Ok(None);
    }
    let measured = MeasuredLoop {
        frf: &loaded.frf,
        model: &model,
        probe_period_s: config.probe.rate_hz.map(|rate_hz| 1.0 / rate_hz),
    };
    if let Err(missing) = measured.require_band(&margins) {
        defects.push(missing);
        return Ok(None);
    }
    let lower = measured.lower_margin();
    defects.extend(margin_defect(&lower, config.control.min_modulus_margin));
    Ok(Some(lower))
}

fn margin_defect(lower: &LowerMargin, least: f64) -> Option<CertificateError> {
    let LowerMargin {
        margin,
        at_hz,
        is_stable,
    } = *lower;
    if !is_stable {
        return Some(CertificateError::Unstable);
    }
    // Written this way, a margin that is not a number is too low.
    let is_enough = margin >= least && margin > 0.0;
    (!is_enough).then_some(CertificateError::LowMargin {
        margin,
        at_hz,
        least,
    })
}
