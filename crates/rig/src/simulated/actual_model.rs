//! The linear model of the simulated stage, with what the configured model does not contain.

use bench_config::{PlantSettings, SimSettings};
use bench_plant::UnmodelledMode;
use bench_plant::{ModalModel, Mode, PlantError};

/// The modes of the linear rig: those of the plant's model, and the unmodelled ones.
pub fn modes(plant: &PlantSettings, sim: &SimSettings) -> Result<Vec<Mode>, PlantError> {
    let mut modes = ModalModel::of(&bench_plant::build(&actual_plant(plant, sim))?)?.modes;
    for mode in &mut modes {
        mode.omega_rad_s *= sim.frequency_ratio;
    }
    modes.extend(unmodelled_modes(sim));
    Ok(modes)
}

/// The plant of the simulated stage. Its mass asymmetry differs from the configured one by `sim.asymmetry_offset`.
pub(super) fn actual_plant(plant: &PlantSettings, sim: &SimSettings) -> PlantSettings {
    let mut plant = plant.clone();
    if let PlantSettings::Sr4dof(settings) = &mut plant {
        settings.mass_asymmetry += sim.asymmetry_offset;
    }
    plant
}

pub(super) fn unmodelled_modes(sim: &SimSettings) -> Vec<Mode> {
    sim.unmodelled.iter().map(unmodelled_mode).collect()
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
