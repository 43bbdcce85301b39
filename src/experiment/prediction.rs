//! What an excitation would do, by the model of the whole rig.

use super::error::ExperimentError;
use crate::config::Config;
use crate::excitation::{self, Extremes};
use crate::model::plant::DiscretePlant;
use crate::rig::simulated;

/// The model of the rig: plant with all its modes, amplifier and hold.
pub fn rig_model(config: &Config) -> Result<DiscretePlant, ExperimentError> {
    let modes = simulated::modes(config)?;
    let bandwidth_hz = config.amplifier.bandwidth_hz;
    let force_constant = config.motor.force_constant_n_per_a;
    let period_s = config.servo.period_s();
    Ok(DiscretePlant::new(
        &modes,
        bandwidth_hz,
        force_constant,
        period_s,
    ))
}

/// The extremes of the configured excitation. Refuses an excitation that would trip an interlock.
pub fn predicted_extremes(config: &Config) -> Result<Extremes, ExperimentError> {
    let excitation = excitation::of(config);
    Ok(excitation::check(&excitation, config, &rig_model(config)?)?)
}
