//! The linear model of the simulated stage, with what the configured model does not contain.

use crate::config::{Config, PlantSettings, UnmodelledMode};
use crate::model::plant::{self, ModalModel, Mode, PlantError};

/// The modes of the linear rig: those of the plant's model, and the unmodelled ones.
pub fn modes(config: &Config) -> Result<Vec<Mode>, PlantError> {
    let mut modes = ModalModel::of(&plant::build(&actual_plant(config))?)?.modes;
    modes.extend(unmodelled_modes(config));
    Ok(modes)
}

/// The plant of the simulated stage. Its mass asymmetry differs from the configured one by `sim.asymmetry_offset`.
pub fn actual_plant(config: &Config) -> PlantSettings {
    let mut plant = config.plant.clone();
    if let PlantSettings::Sr4dof(settings) = &mut plant {
        settings.mass_asymmetry += config.sim.asymmetry_offset;
    }
    plant
}

pub(super) fn unmodelled_modes(config: &Config) -> Vec<Mode> {
    config.sim.unmodelled.iter().map(unmodelled_mode).collect()
}

/// An unmodelled mode has a residue, but no shape, and the floor does not excite it.
fn unmodelled_mode(mode: &UnmodelledMode) -> Mode {
    let size = mode.residue_per_kg.abs().sqrt();
    Mode {
        omega_rad_s: std::f64::consts::TAU * mode.frequency_hz,
        damping_ratio: mode.damping_ratio,
        shape: nalgebra::DVector::zeros(0),
        force_gain: size * mode.residue_per_kg.signum(),
        sensor_gain: size,
        floor_gain: 0.0,
    }
}
