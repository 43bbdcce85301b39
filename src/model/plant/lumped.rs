//! Masses that move along one line, joined by springs: M diagonal, K = sum of k d d^T with d = e_i - e_j (or e_i, to ground).
//!
//! Coordinates in the order of the nodes' names. The floor moves along the same line.

use super::structure::Assembly;
use super::{PlantError, Port, Structure, damping};
use crate::config::LumpedSettings;

pub(super) fn structure(s: &LumpedSettings) -> Result<Structure, PlantError> {
    let mut structure = undamped(s);
    structure.damping = damping::matrix(&structure, &s.damping)?;
    Ok(structure)
}

/// The same with C = 0, whatever the damping of the settings.
pub(super) fn undamped(s: &LumpedSettings) -> Structure {
    let n = s.nodes.len();
    let place = |name: &str| s.nodes.keys().position(|node| node == name);
    let mut parts = Assembly::new(n);
    for (index, node) in s.nodes.values().enumerate() {
        let mut row = vec![0.0; n];
        row[index] = 1.0;
        parts.mass(node.mass_kg, &row, &vec![0.0; n]);
    }
    for spring in s.springs.values() {
        let mut along = vec![0.0; n];
        // A name that is no node is ground: any other was refused with the configuration.
        for (end, sign) in spring.between.iter().zip([1.0, -1.0]) {
            if let Some(index) = place(end) {
                along[index] += sign;
            }
        }
        parts.spring(spring.stiffness_n_per_m, &along);
    }
    let weights =
        |of: fn(&crate::config::NodeSettings) -> f64| s.nodes.values().map(of).collect::<Vec<_>>();
    let mut structure = parts.finish(&weights(|node| node.actuator), &weights(|node| node.sensor));
    structure.free_bodies = s.free().len();
    structure
}

/// The displacement of each node.
pub(super) fn ports(s: &LumpedSettings) -> Vec<Port> {
    let row = |index: usize| {
        (0..s.nodes.len())
            .map(|other| f64::from(u8::from(other == index)))
            .collect::<Vec<_>>()
    };
    s.nodes
        .keys()
        .enumerate()
        .map(|(index, name)| Port::new(name, &row(index)))
        .collect()
}
