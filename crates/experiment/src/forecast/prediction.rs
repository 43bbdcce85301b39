//! The extremes of an excitation by the model of the whole rig.

use crate::errors::ExperimentError;
use bench_config::Config;
use bench_excitation::{Excitation, Extremes};
use bench_plant::DiscretePlant;
use bench_rig::simulated;

/// The model of the rig: plant with all its modes, amplifier and hold.
pub fn rig_model(config: &Config) -> Result<DiscretePlant, ExperimentError> {
    let modes = simulated::modes(&config.plant, &config.sim)?;
    let (bandwidth_hz, period_s) = (config.amplifier.bandwidth_hz, config.servo.period_s());
    let force_constant = config.motor.force_constant_n_per_a;
    let model = DiscretePlant::new(&modes, bandwidth_hz, force_constant, period_s);
    Ok(model)
}

/// The extremes of the configured excitation. Refuses an excitation that would trip an interlock.
pub fn predicted_extremes(config: &Config) -> Result<Extremes, ExperimentError> {
    let model = rig_model(config)?;
    let limits = config.excitation_limits();
    let checked = config
        .chosen_excitation()?
        .check(&limits, positions(&model));
    Ok(checked?)
}

/// The extremes of any excitation.
pub fn extremes(
    excitation: &impl Excitation,
    config: &Config,
) -> Result<Extremes, ExperimentError> {
    let model = rig_model(config)?;
    let limits = config.excitation_limits();
    Ok(Extremes::of(excitation, &limits, positions(&model)))
}

/// The position in metres after the command of each tick, from rest.
fn positions(model: &DiscretePlant) -> impl FnMut(f64) -> f64 {
    let mut motion = model.at_rest();
    move |command_a| {
        model.step(&mut motion, command_a, |_| 0.0);
        model.position_m(&motion)
    }
}
