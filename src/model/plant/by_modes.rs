//! A plant given by its modes, G(s) = sum of r/(s^2 + 2 zeta w s + w^2) (Eq. 3-1): one degree of freedom a mode, of unit
//! mass, all seen with weight 1, each driven with its residue.
//!
//! Coordinates in the order of the modes' names. What the floor does to such a plant is not known: it does nothing.

use nalgebra::{DMatrix, DVector};

use super::Structure;
use crate::config::{ModalSettings, ModeSettings};

pub(super) fn structure(s: &ModalSettings) -> Structure {
    let rate = |mode: &ModeSettings| 2.0 * mode.damping_ratio * mode.omega_rad_s;
    Structure {
        damping: DMatrix::from_diagonal(&vector(s, rate)),
        ..undamped(s)
    }
}

fn vector(s: &ModalSettings, of: fn(&ModeSettings) -> f64) -> DVector<f64> {
    DVector::from_iterator(s.modes.len(), s.modes.values().map(of))
}

/// The same with C = 0, whatever the damping of the settings.
pub(super) fn undamped(s: &ModalSettings) -> Structure {
    let n = s.modes.len();
    Structure {
        mass: DMatrix::identity(n, n),
        damping: DMatrix::zeros(n, n),
        stiffness: DMatrix::from_diagonal(&vector(s, |mode| mode.omega_rad_s * mode.omega_rad_s)),
        force: vector(s, |mode| mode.residue_per_kg),
        sensor: DVector::from_element(n, 1.0),
        floor: DVector::zeros(n),
        free_bodies: s
            .modes
            .values()
            .filter(|mode| mode.omega_rad_s == 0.0)
            .count(),
    }
}
