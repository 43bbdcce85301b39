//! The simple representative 4-DoF mechanism of Fig 2-2, derived from its kinematic constraints.
//!
//! Degrees of freedom z = [x1, y1, y2, y3]; a = 0.6 Y1o/L (Eq. 2-6), as each parallelogram takes half of Y1o. The four
//! parallelograms, linearised about the operating point (Eq. 2-4):
//!
//! ```text
//!  x2 = x1 + a (y1 - y2)        x3 = x1 - a (y1 - y3)
//!  x4 = x1 + a y1 - 2 a y2      x5 = x1 - a y1 + 2 a y3       y4 = y5 = 0
//! ```
//!
//! The force P acts in X on stage 4, the probe sees x1. The sum over masses and springs gives Eq. (2-5) as printed.

use super::beam::Beam;
use super::structure::Assembly;
use super::{PlantError, Port, Structure, damping};
use crate::config::Sr4dofSettings;

const NONE: [f64; 4] = [0.0; 4];
const X1: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
const Y1: [f64; 4] = [0.0, 1.0, 0.0, 0.0];
const Y2: [f64; 4] = [0.0, 0.0, 1.0, 0.0];
const Y3: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
const Y12: [f64; 4] = [0.0, 1.0, -1.0, 0.0];
const Y13: [f64; 4] = [0.0, 1.0, 0.0, -1.0];

pub(super) fn structure(s: &Sr4dofSettings) -> Result<Structure, PlantError> {
    let mut structure = undamped(s);
    structure.damping = damping::matrix(&structure, &s.damping)?;
    Ok(structure)
}

/// The displacements of the five stages in X, and of those that move in Y.
pub(super) fn ports(s: &Sr4dofSettings) -> Vec<Port> {
    let [[x1, _], [x2, _], [x3, _], [x4, _], [x5, _]] = stages(s);
    let rows = [
        ("x1", x1),
        ("x2", x2),
        ("x3", x3),
        ("x4", x4),
        ("x5", x5),
        ("y1", Y1),
        ("y2", Y2),
        ("y3", Y3),
    ];
    rows.into_iter()
        .map(|(name, row)| Port::new(name, &row))
        .collect()
}

/// Displacements x and y of the stages 1 to 5 (Fig 2-2), over the degrees of freedom [x1, y1, y2, y3].
pub fn stages(s: &Sr4dofSettings) -> [[[f64; 4]; 2]; 5] {
    let a = 0.6 * s.operating_point_m / s.beam_length_m;
    [
        [X1, Y1],
        [[1.0, a, -a, 0.0], Y2],
        [[1.0, -a, 0.0, a], Y3],
        [[1.0, a, -2.0 * a, 0.0], NONE],
        [[1.0, -a, 0.0, 2.0 * a], NONE],
    ]
}

/// The force in Y on the motion stage that holds the operating point: F = k Y1o, k of one parallelogram.
///
/// Of the statics with the constraints of Eq. (2-1), not linearised: the secondary stages rest where each of their
/// parallelograms takes half, y2 = y3 = Y1o/2. There both shorten alike, c (y1 - y2)^2 = c y2^2, so that x4 = x5 = x1: no bearing
/// in X is strained, the stage rests at **x1 = 0 whatever the load**, and V = 4 k (Y1o/2)^2/2 = k Y1o^2/2. The static compliance
/// in X, 1/(k4 + k5), knows nothing of it either. So the probe does not see the load while the stage rests: modes u and v do.
pub fn holding_force_n(s: &Sr4dofSettings) -> f64 {
    Beam::from(s).parallelogram_n_per_m() * s.operating_point_m
}

/// [`structure`] with C = 0, whatever the damping of the settings.
pub fn undamped(s: &Sr4dofSettings) -> Structure {
    let m3 = s.secondary_stage_mass_kg;
    let k = Beam::from(s).parallelogram_n_per_m();
    let rows = stages(s);
    let (x4, x5) = (rows[3][0], rows[4][0]);
    let (m1, m2, m4) = (
        s.motion_stage_mass_kg,
        m3 * (1.0 + s.mass_asymmetry),
        s.intermediate_stage_mass_kg,
    );
    let mut parts = Assembly::new(4);
    for (kilograms, [x, y]) in [m1, m2, m3, m4, m4].into_iter().zip(&rows) {
        parts.mass(kilograms, x, y);
    }
    for along in [&Y12, &Y2, &Y13, &Y3] {
        parts.spring(k, along);
    }
    parts.spring(s.spring_stiffness_n_per_m, &x4);
    parts.spring(s.spring_stiffness_n_per_m, &x5);
    parts.finish(&x4, &X1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{PlantSettings, Source, load};
    use crate::model::plant::kinematics::Coordinate;
    use nalgebra::{DMatrix, Matrix4};
    use proptest::prelude::*;

    /// Eq. (2-5) as printed, for m4 = m5, k4 = k5 and four equal parallelograms k.
    fn printed(s: &Sr4dofSettings) -> (Matrix4<f64>, Matrix4<f64>) {
        let a = 0.6 * s.operating_point_m / s.beam_length_m;
        let (m1, m3, m4) = (
            s.motion_stage_mass_kg,
            s.secondary_stage_mass_kg,
            s.intermediate_stage_mass_kg,
        );
        let (m2, m5, k4, k5) = (
            m3 * (1.0 + s.mass_asymmetry),
            m4,
            s.spring_stiffness_n_per_m,
            s.spring_stiffness_n_per_m,
        );
        let i = s.beam_height_m * s.beam_thickness_m.powi(3) / 12.0;
        let k = 24.0 * s.youngs_modulus_pa * i
            / (s.beam_length_m.powi(3) * (1.0 - s.poisson_ratio.powi(2)));
        let a2 = a * a;
        #[rustfmt::skip]
        let mass = Matrix4::new(
            m1 + m2 + m3 + m4 + m5, a * (m2 + m4 - m3 - m5), -a * (m2 + 2.0 * m4), a * (m3 + 2.0 * m5),
            a * (m2 + m4 - m3 - m5), m1 + a2 * (m2 + m3 + m4 + m5), -a2 * (m2 + 2.0 * m4), -a2 * (m3 + 2.0 * m5),
            -a * (m2 + 2.0 * m4), -a2 * (m2 + 2.0 * m4), m2 + a2 * m2 + 4.0 * a2 * m4, 0.0,
            a * (m3 + 2.0 * m5), -a2 * (m3 + 2.0 * m5), 0.0, m3 + a2 * m3 + 4.0 * a2 * m5,
        );
        #[rustfmt::skip]
        let stiffness = Matrix4::new(
            k4 + k5, a * (k4 - k5), -2.0 * a * k4, 2.0 * a * k5,
            a * (k4 - k5), 2.0 * k + a2 * (k4 + k5), -2.0 * a2 * k4 - k, -2.0 * a2 * k5 - k,
            -2.0 * a * k4, -2.0 * a2 * k4 - k, 4.0 * a2 * k4 + 2.0 * k, 0.0,
            2.0 * a * k5, -2.0 * a2 * k5 - k, 0.0, 4.0 * a2 * k5 + 2.0 * k,
        );
        (mass, stiffness)
    }

    /// M, K and geometric stiffness by [`Coordinate`]: stages 2 and 3 on either side of stage 1, 4 and 5 beyond them.
    fn by_parallelograms(s: &Sr4dofSettings) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
        let (beam, y0) = (Beam::from(s), s.operating_point_m);
        let (c, k, k4, ground) = (
            beam.shortening_per_m(),
            beam.parallelogram_n_per_m(),
            s.spring_stiffness_n_per_m,
            Coordinate::ground(4, true),
        );
        let free = |index, at_m| Coordinate::free(4, true, index, at_m);
        let (x1, y1, y2, y3) = (
            free(0, 0.0),
            free(1, y0),
            free(2, y0 / 2.0),
            free(3, y0 / 2.0),
        );
        let (x2, x3) = (
            x1.joined(&y2.from(&y1), -1.0, c),
            x1.joined(&y3.from(&y1), 1.0, c),
        );
        let (x4, x5) = (
            x2.joined(&ground.from(&y2), 1.0, c),
            x3.joined(&ground.from(&y3), -1.0, c),
        );
        let m3 = s.secondary_stage_mass_kg;
        let (m2, m4) = (m3 * (1.0 + s.mass_asymmetry), s.intermediate_stage_mass_kg);
        let stages = [
            (s.motion_stage_mass_kg, &x1, &y1),
            (m2, &x2, &y2),
            (m3, &x3, &y3),
            (m4, &x4, &ground),
            (m4, &x5, &ground),
        ];
        let mut parts = Assembly::new(4);
        for (kilograms, x, y) in stages {
            parts.mass(kilograms, x.row.as_slice(), y.row.as_slice());
        }
        let springs = [
            (k, y1.from(&y2)),
            (k, y2.clone()),
            (k, y1.from(&y3)),
            (k, y3.clone()),
            (k4, x4),
            (k4, x5),
        ];
        let mut geometric = DMatrix::zeros(4, 4);
        for (stiffness, spring) in &springs {
            parts.spring(*stiffness, spring.row.as_slice());
            geometric += *stiffness * spring.at_m * spring.curve.as_ref().unwrap();
        }
        let structure = parts.finish(&X1, &X1);
        (structure.mass, structure.stiffness, geometric)
    }

    proptest! {
        #[test]
        fn the_constraints_give_the_printed_matrices(
            point in -0.15..0.15f64, asymmetry in -0.5..0.5f64, m1 in 0.01..2.0f64, m3 in 0.001..0.5f64, m4 in 0.01..2.0f64, k4 in 1.0..1e5f64,
        ) {
            let PlantSettings::Sr4dof(mut s) = load(&Source::default()).unwrap().plant else { panic!("the default plant") };
            s.operating_point_m = point * s.beam_length_m;
            (s.mass_asymmetry, s.motion_stage_mass_kg, s.secondary_stage_mass_kg) = (asymmetry, m1, m3);
            (s.intermediate_stage_mass_kg, s.spring_stiffness_n_per_m) = (m4, k4);
            let ours = structure(&s).unwrap();
            let (mass, stiffness) = printed(&s);
            // Ten sums of products, each rounded: some 1e-15 of the largest element.
            prop_assert!((&ours.mass - mass).amax() <= 1e-14 * mass.amax());
            prop_assert!((&ours.stiffness - stiffness).amax() <= 1e-14 * stiffness.amax());
            // The general way from parallelograms to coordinates, which the XY stage takes, gives the same matrices; and the
            // static force that holds Y1o stores no force in X, so that linearising first or last is the same.
            let (mass, stiffness, geometric) = by_parallelograms(&s);
            prop_assert!((ours.mass - &mass).amax() <= 1e-14 * mass.amax());
            prop_assert!((ours.stiffness - &stiffness).amax() <= 1e-14 * stiffness.amax());
            prop_assert!(geometric.amax() <= 1e-14 * stiffness.amax(), "{geometric}");
        }
    }
}
