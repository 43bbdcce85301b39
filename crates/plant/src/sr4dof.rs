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
//! The force P acts in X on stage 4, the probe measures x1. The sum over masses and springs is Eq. (2-5) as printed.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::beam::Beam;
use super::structure::Assembly;
use super::{DampingSettings, PlantModel, Port, Structure};

const NONE: [f64; 4] = [0.0; 4];
const X1: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
const Y1: [f64; 4] = [0.0, 1.0, 0.0, 0.0];
const Y2: [f64; 4] = [0.0, 0.0, 1.0, 0.0];
const Y3: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
const Y12: [f64; 4] = [0.0, 1.0, -1.0, 0.0];
const Y13: [f64; 4] = [0.0, 1.0, 0.0, -1.0];

/// The SR4DoF mechanism (Fig 2-2): motion stage 1, secondary stages 2 and 3, intermediate stages 4 and 5.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sr4dofSettings {
    /// Beam length L in metres.
    #[schemars(range(min = 0.001, max = 1.0))]
    pub beam_length_m: f64,
    /// Beam height H (out of plane) in metres.
    #[schemars(range(min = 0.0001, max = 1.0))]
    pub beam_height_m: f64,
    /// Beam thickness T (in plane) in metres.
    #[schemars(range(min = 0.00001, max = 0.1))]
    pub beam_thickness_m: f64,
    /// Young's modulus E in pascals.
    #[schemars(range(min = 1e6, max = 1e13))]
    pub youngs_modulus_pa: f64,
    /// Poisson ratio nu; the beams' bending stiffness takes the plate modulus E/(1 - nu^2).
    #[schemars(range(min = 0.0, max = 0.5))]
    pub poisson_ratio: f64,
    /// Mass m1 of the motion stage in kilograms.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub motion_stage_mass_kg: f64,
    /// Mass m3 of a secondary stage in kilograms.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub secondary_stage_mass_kg: f64,
    /// Mass m4 = m5 of an intermediate stage in kilograms.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub intermediate_stage_mass_kg: f64,
    /// Stiffness k4 = k5 of each X bearing in newtons per metre.
    #[schemars(range(min = 1e-3, max = 1e9))]
    pub spring_stiffness_n_per_m: f64,
    /// Mass asymmetry D = m2/m3 - 1, a ratio.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub mass_asymmetry: f64,
    /// Static Y displacement Y1o of the motion stage in metres.
    #[schemars(range(min = -0.5, max = 0.5))]
    pub operating_point_m: f64,
    /// Damping of the modes.
    pub damping: DampingSettings,
}

impl Sr4dofSettings {
    /// The beams of the parallelograms.
    pub fn beam(&self) -> Beam {
        Beam {
            length_m: self.beam_length_m,
            height_m: self.beam_height_m,
            thickness_m: self.beam_thickness_m,
            youngs_modulus_pa: self.youngs_modulus_pa,
            poisson_ratio: self.poisson_ratio,
        }
    }

    /// The force in Y on the motion stage that holds the operating point: F = k Y1o, k of one parallelogram.
    ///
    /// It follows from the statics with the constraints of Eq. (2-1), not linearised. The secondary stages rest at
    /// y2 = y3 = Y1o/2, where each of their parallelograms takes half. Both shorten equally, c (y1 - y2)^2 = c y2^2, so that
    /// x4 = x5 = x1. No bearing in X is strained, and the stage rests at **x1 = 0 whatever the load**, with
    /// V = 4 k (Y1o/2)^2/2 = k Y1o^2/2. The static compliance in X, 1/(k4 + k5), does not depend on the load either. The
    /// probe therefore cannot measure the load while the stage rests; modes u and v show it.
    pub fn holding_force_n(&self) -> f64 {
        self.beam().parallelogram_n_per_m() * self.operating_point_m
    }

    /// Rows of the displacements x and y of stages 1 to 5 (Fig 2-2), over the degrees of freedom [x1, y1, y2, y3].
    pub fn stage_rows(&self) -> [[[f64; 4]; 2]; 5] {
        let a = 0.6 * self.operating_point_m / self.beam_length_m;
        [
            [X1, Y1],
            [[1.0, a, -a, 0.0], Y2],
            [[1.0, -a, 0.0, a], Y3],
            [[1.0, a, -2.0 * a, 0.0], NONE],
            [[1.0, -a, 0.0, 2.0 * a], NONE],
        ]
    }

    /// m1 to m5.
    pub fn masses_kg(&self) -> [f64; 5] {
        let m3 = self.secondary_stage_mass_kg;
        let m2 = m3 * (1.0 + self.mass_asymmetry);
        let m4 = self.intermediate_stage_mass_kg;
        [self.motion_stage_mass_kg, m2, m3, m4, m4]
    }
}

impl PlantModel for Sr4dofSettings {
    fn coordinates(&self) -> Vec<&str> {
        vec!["x1", "y1", "y2", "y3"]
    }

    fn beam_length_m(&self) -> Option<f64> {
        Some(self.beam_length_m)
    }

    fn operating_point_m(&self) -> Option<f64> {
        Some(self.operating_point_m)
    }

    fn mass_asymmetry(&self) -> Option<f64> {
        Some(self.mass_asymmetry)
    }

    fn undamped(&self) -> Structure {
        let k = self.beam().parallelogram_n_per_m();
        let rows = self.stage_rows();
        let (x4, x5) = (rows[3][0], rows[4][0]);
        let mut parts = Assembly::new(4);
        for (kilograms, [x, y]) in self.masses_kg().into_iter().zip(&rows) {
            parts.add_mass(kilograms, x, y);
        }
        for along in [&Y12, &Y2, &Y13, &Y3] {
            parts.add_spring(k, along);
        }
        parts.add_spring(self.spring_stiffness_n_per_m, &x4);
        parts.add_spring(self.spring_stiffness_n_per_m, &x5);
        parts.into_structure(&x4, &X1)
    }

    fn damping_settings(&self) -> Option<&DampingSettings> {
        Some(&self.damping)
    }

    /// Displacements of the five stages in X, and of those that move in Y.
    fn ports(&self) -> Vec<Port> {
        let rows = self.stage_rows();
        let x = ["x1", "x2", "x3", "x4", "x5"]
            .into_iter()
            .zip(rows.map(|[x, _]| x));
        let y = [("y1", Y1), ("y2", Y2), ("y3", Y3)];
        x.chain(y)
            .map(|(name, row)| Port::new(name, &row))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlantSettings;
    use crate::coordinate::Coordinate;
    use crate::test_profile::plant_of_profile;
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
        let (beam, y0) = (s.beam(), s.operating_point_m);
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
            parts.add_mass(kilograms, x.row.as_slice(), y.row.as_slice());
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
            parts.add_spring(*stiffness, spring.row.as_slice());
            geometric += *stiffness * spring.at_m * spring.curve.as_ref().unwrap();
        }
        let structure = parts.into_structure(&X1, &X1);
        (structure.mass, structure.stiffness, geometric)
    }

    proptest! {
        #[test]
        fn constraints_reproduce_the_printed_matrices(
            point in -0.15..0.15f64, asymmetry in -0.5..0.5f64, m1 in 0.01..2.0f64, m3 in 0.001..0.5f64, m4 in 0.01..2.0f64, k4 in 1.0..1e5f64,
        ) {
            let PlantSettings::Sr4dof(mut s) = plant_of_profile("stage", &[]) else { panic!("the default plant") };
            s.operating_point_m = point * s.beam_length_m;
            (s.mass_asymmetry, s.motion_stage_mass_kg, s.secondary_stage_mass_kg) = (asymmetry, m1, m3);
            (s.intermediate_stage_mass_kg, s.spring_stiffness_n_per_m) = (m4, k4);
            let ours = s.undamped();
            let (mass, stiffness) = printed(&s);
            // Ten sums of products, each rounded: some 1e-15 of the largest element.
            prop_assert!((&ours.mass - mass).amax() <= 1e-14 * mass.amax());
            prop_assert!((&ours.stiffness - stiffness).amax() <= 1e-14 * stiffness.amax());
            // The general method of the XY stage gives the same matrices. The static force that holds Y1o has no
            // component in X, so the order of linearisation does not matter.
            let (mass, stiffness, geometric) = by_parallelograms(&s);
            prop_assert!((ours.mass - &mass).amax() <= 1e-14 * mass.amax());
            prop_assert!((ours.stiffness - &stiffness).amax() <= 1e-14 * stiffness.amax());
            prop_assert!(geometric.amax() <= 1e-14 * stiffness.amax(), "{geometric}");
        }
    }
}
