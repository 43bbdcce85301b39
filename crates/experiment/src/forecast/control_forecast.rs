//! The forecast of a closed loop: its response by the model, and the demands on the rig with their limits.

use serde::Serialize;

use super::excitation_plan::PlanLimits;
use super::motor_forecast::MotorSummary;
use super::predicted_sine::PredictedSine;
use super::predicted_step::predicted_step;
use crate::evidence::Evidence;
use crate::plan::{CommandSummary, Plan, PlanError};
use bench_control::{ClosedLoop, Margins, StepMetrics};
use bench_excitation::Extremes;

/// The plan of a closed loop, predicted by the model.
#[derive(Clone, Debug, Serialize)]
pub struct ControlForecast {
    /// The reference and its length as text.
    pub reference: String,
    /// Extremes by the model; `None` if the loop of the model is unstable.
    pub expected: Option<Extremes>,
    /// The limits of these extremes.
    pub limits: PlanLimits,
    /// The motor on devices, whose heat the run starts with; `None` on the simulated stage, whose motor is cold.
    pub motor: Option<MotorSummary>,
    /// Range and mounting of the probe; `None` for the simulated probe.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probe: Option<String>,
    /// Margins and response.
    pub predicted: PredictedLoop,
    /// Shaping, prefilter and feedforward.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub command: Option<CommandSummary>,
    /// The certificate with which the loop closes, and what is wrong with it.
    pub evidence: Evidence,
}

/// The loop by the model.
#[derive(Clone, Debug, Serialize)]
pub struct PredictedLoop {
    /// Its margins.
    #[serde(flatten)]
    pub margins: Margins,
    /// Settling and overshoot of a step.
    #[serde(flatten)]
    pub step: Option<StepMetrics>,
    /// Gain and phase at the frequency of a sine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sine: Option<PredictedSine>,
}

impl ControlForecast {
    /// The forecast of a planned run, without the motor.
    ///
    /// # Errors
    /// When the reference is refused.
    pub fn new(
        plan: &Plan,
        predicted: PredictedLoop,
        evidence: Evidence,
    ) -> Result<ControlForecast, PlanError> {
        let config = &plan.config;
        Ok(ControlForecast {
            reference: config.reference_text(),
            expected: plan.loop_extremes()?,
            limits: PlanLimits::of(config),
            motor: None,
            probe: config.probe.device.scale_text(),
            predicted,
            command: plan.command_summary().cloned(),
            evidence,
        })
    }
}

impl PredictedLoop {
    /// The margins of a planned loop and, if it is stable, its response to the reference.
    pub fn new(plan: &Plan, closed_loop: &ClosedLoop, margins: Margins) -> PredictedLoop {
        let step = if margins.stable {
            predicted_step(plan, closed_loop).map(|step| step.metrics)
        } else {
            None
        };
        PredictedLoop {
            sine: PredictedSine::of(&plan.config, closed_loop, &margins),
            margins,
            step,
        }
    }
}
