//! Chapter 4: veering and CNMP zeros.

mod loci;
mod two_modes;
mod zeros;

pub(crate) use loci::{fig_4_1, fig_4_7, fig_4_9};
pub(crate) use two_modes::{fig_4_2, fig_4_4};
pub(crate) use zeros::{fig_4_6, fig_4_8, fig_4_10};

use super::model::Model;

const W: &str = "Frequency (rad/s)";
const K: &str = "plant.springs.k.stiffness_n_per_m";
const Y: &str = "plant.operating_point_m";
const L: f64 = 0.0475;
const K23: &str = "plant.springs.k23.stiffness_n_per_m";

fn three_mass(k: f64) -> Model {
    Model::profile("three-mass").set(&format!("plant.springs.k.stiffness_n_per_m={k:?}"))
}

fn sr4dof(asymmetry: f64) -> Model {
    Model::profile("chapter2")
        .set("plant.secondary_stage_mass_kg=0.018")
        .set(&format!("plant.mass_asymmetry={asymmetry:?}"))
}
