//! The plan of an excitation: its predicted extremes and the limits of the bench.

use serde::Serialize;

use super::motor_forecast::MotorSummary;
use crate::errors::ExperimentError;
use bench_config::Config;
use bench_excitation::{AmplitudePoint, Extremes};

/// The plan of an excitation, predicted by the model.
#[derive(Clone, Debug, Serialize)]
pub struct ExcitationPlan {
    /// Kind, band and length as text.
    pub excitation: String,
    /// Its extremes by the model.
    pub expected: Extremes,
    /// The limits of these extremes.
    pub limits: PlanLimits,
    /// The motor on devices, whose heat the run starts with; `None` on the simulated stage, whose motor is cold.
    pub motor: Option<MotorSummary>,
    /// Range and mounting of the probe, which are the scale of all positions; `None` for the simulated probe.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probe: Option<String>,
    /// Amplitude over frequency; empty for an excitation with one amplitude.
    pub amplitude: Vec<AmplitudePoint>,
}

/// Values that trip an interlock, or that the amplifier cannot follow.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PlanLimits {
    /// Travel to either side in metres.
    pub travel_m: f64,
    /// Current in amperes.
    pub current_a: f64,
    /// Thermal current of the motor in amperes.
    pub thermal_current_a: f64,
    /// Change of the current in amperes per second.
    pub slew_a_per_s: f64,
}

impl ExcitationPlan {
    /// The plan of the configured excitation with its extremes.
    ///
    /// # Errors
    /// When the excitation has no settings.
    pub fn new(config: &Config, expected: Extremes) -> Result<ExcitationPlan, ExperimentError> {
        let chosen = config.chosen_excitation()?;
        let amplitude = if chosen.design.has_amplitude_curve() {
            config.chirp.amplitude.clone()
        } else {
            Vec::new()
        };
        Ok(ExcitationPlan {
            excitation: chosen.describe(),
            expected,
            limits: PlanLimits::of(config),
            motor: None,
            probe: config.probe.device.scale_text(),
            amplitude,
        })
    }
}

impl PlanLimits {
    /// The limits of the configured bench.
    pub fn of(config: &Config) -> PlanLimits {
        let limits = config.excitation_limits();
        PlanLimits {
            travel_m: limits.travel_m,
            current_a: limits.amplifier_current_a.min(limits.peak_current_a),
            thermal_current_a: limits.continuous_current_a,
            slew_a_per_s: limits.slew_a_per_s,
        }
    }
}
