//! Where a force may act and a probe may look.

use nalgebra::DVector;

/// A displacement of some stage: row^T z. A force along it is the generalised force row.
#[derive(Clone, Debug, PartialEq)]
pub struct Port {
    /// Of the stage or node, with the axis where it has two: `x4`, `y_ms`, `m2`.
    pub name: String,
    /// Over the degrees of freedom; of all zeros where it cannot move.
    pub row: DVector<f64>,
}

impl Port {
    pub(super) fn new(name: &str, row: &[f64]) -> Port {
        Port {
            name: name.into(),
            row: DVector::from_row_slice(row),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{build, ports};
    use crate::config::{Source, load};
    use nalgebra::DMatrix;

    /// Each stage's mass moves along its ports: together they are the mass matrix.
    #[test]
    fn the_stages_along_their_ports_make_the_mass_matrix() {
        for (profile, stages) in [
            ("chapter2", ["1", "2", "3", "4", "5"]),
            ("xy", ["ms", "X", "Y", "s", "g"]),
        ] {
            let config = load(&Source {
                config: Some(profile.into()),
                ..Source::default()
            })
            .unwrap();
            let plant = serde_json::to_value(&config.plant).unwrap();
            let key = |key: &str| plant[key].as_f64().unwrap();
            let mass_kg = |name: &str| {
                let stage = name.trim_start_matches(['x', 'y']).trim_start_matches('_');
                match *stages
                    .iter()
                    .find(|start| stage.starts_with(**start))
                    .unwrap()
                {
                    "1" | "ms" => key("motion_stage_mass_kg"),
                    "2" => key("secondary_stage_mass_kg") * (1.0 + key("mass_asymmetry")),
                    "3" | "s" | "g" => key("secondary_stage_mass_kg"),
                    _ => key("intermediate_stage_mass_kg"),
                }
            };
            let structure = build(&config.plant).unwrap();
            let n = structure.mass.nrows();
            let sum = ports(&config.plant)
                .iter()
                .fold(DMatrix::zeros(n, n), |sum, port| {
                    sum + mass_kg(&port.name) * &port.row * port.row.transpose()
                });
            assert!(
                (&sum - &structure.mass).amax() < 1e-14 * structure.mass.amax(),
                "{profile}: {sum}"
            );
        }
    }
}
