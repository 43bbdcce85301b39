//! The XY stage of section 2.2.4 (Fig 1-2a), derived from its sixteen parallelograms.
//!
//! ```text
//!                   ground
//!                 gT      YT                   degrees of freedom
//!                         sT                   z = [x_ms, y_ms, y_sL, y_sR, x_sT, x_sB, x_gL, x_gR, y_gT, y_gB]
//!          gL                      gR
//!  ground     XL  sL  ms  sR  XR     ground    at X = 0, Y = Y0: y_sL = y_sR = y_gT = y_gB = Y0/2
//!                         sB
//!                         YB  gB               the motor pushes XL in X, the probe measures x_ms
//!                         ground
//! ```
//!
//! The sides of the ground modules are unknown, as Fig 1-2a is missing. s = +-1 is the side of a secondary stage beside its
//! anchor, in X for gT and gB, in Y for gL and gR. The layout chooses s_T and s_B; s_L = +1 and s_R = -1 always. With
//! s_T = +1, s_B = -1 the mechanism is the same after a quarter turn (pinwheel). s_L and s_R affect the geometric stiffness
//! alone.
//!
//! Geometric stiffness: a force on YB, opposite to where a Y motor would push, holds Y0. It loads sB, gL, gR, sT along
//! their beams. The static force times the curvature of the constraint adds to the stiffness across these beams. The static
//! solution is that of equal stiffness in all parallelograms; no force acts in X.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::beam::Beam;
use super::coordinate::Coordinate;
use super::structure::Assembly;
use super::{DampingSettings, PlantModel, Port, Structure};

/// Degrees of freedom.
const N: usize = 10;
/// Index of y_ms among them.
const Y_MS: usize = 1;

/// The XY stage (Fig 1-2a, section 2.2.4): motion stage, four intermediate stages (XL, where the force acts, XR, YT, YB) and
/// eight secondary stages, joined by 16 equal parallelograms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct XySettings {
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
    /// Mass of the motion stage in kilograms.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub motion_stage_mass_kg: f64,
    /// Mass of an intermediate stage in kilograms.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub intermediate_stage_mass_kg: f64,
    /// Nominal mass of a secondary stage in kilograms.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub secondary_stage_mass_kg: f64,
    /// Deviation of each secondary mass from the nominal mass, as a ratio of it.
    pub secondary_mass_deviation: SecondaryMassDeviation,
    /// On which side of their anchors the secondary stages gT and gB sit.
    pub layout: XyLayout,
    /// Static Y displacement of the motion stage in metres, at X = 0.
    #[schemars(range(min = -0.5, max = 0.5))]
    pub operating_point_m: f64,
    /// Whether the static load of the beams changes the stiffness: a force on YB holds the operating point.
    pub geometric_stiffness: bool,
    /// Damping of the modes.
    pub damping: DampingSettings,
}

/// Deviations of the eight secondary masses by place: s between the motion stage and an intermediate stage, g between ground
/// and an intermediate stage; left, right, top, bottom.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "the names of the drawing")]
pub struct SecondaryMassDeviation {
    /// Motion stage to XL.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub sL: f64,
    /// Motion stage to XR.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub sR: f64,
    /// Motion stage to YT.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub sT: f64,
    /// Motion stage to YB.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub sB: f64,
    /// Ground to XL.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub gL: f64,
    /// Ground to XR.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub gR: f64,
    /// Ground to YT.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub gT: f64,
    /// Ground to YB.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub gB: f64,
}

/// Side on which the secondary stages gT and gB are in X, relative to their anchors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum XyLayout {
    /// gT on the far side of the motor, gB on the near side (s_T = +1, s_B = -1): the same after a quarter turn.
    Pinwheel,
    /// Both away from the motor (s_T = s_B = +1).
    MirrorAway,
    /// Both towards the motor (s_T = s_B = -1).
    MirrorToward,
}

/// The place of a stage in X and Y.
#[derive(Clone, Debug)]
struct Stage {
    x: Coordinate,
    y: Coordinate,
}

/// The thirteen stages: secondary stages in the order L, R, T, B, intermediate ones XL, XR, YT, YB.
struct Stages {
    motion: Stage,
    intermediate: [Stage; 4],
    inner: [Stage; 4],
    outer: [Stage; 4],
}

impl XySettings {
    fn beam(&self) -> Beam {
        Beam {
            length_m: self.beam_length_m,
            height_m: self.beam_height_m,
            thickness_m: self.beam_thickness_m,
            youngs_modulus_pa: self.youngs_modulus_pa,
            poisson_ratio: self.poisson_ratio,
        }
    }

    /// s_T and s_B.
    fn sides(&self) -> (f64, f64) {
        match self.layout {
            XyLayout::Pinwheel => (1.0, -1.0),
            XyLayout::MirrorAway => (1.0, 1.0),
            XyLayout::MirrorToward => (-1.0, -1.0),
        }
    }
}

/// The sides of the motion stage, each as its inner, intermediate and outer stage.
impl XySettings {
    fn free(&self, index: usize, at_m: f64) -> Coordinate {
        Coordinate::free(N, self.geometric_stiffness, index, at_m)
    }

    fn joined(&self, anchor: &Coordinate, across: &Coordinate, side: f64) -> Coordinate {
        anchor.joined(across, side, self.beam().shortening_per_m())
    }

    /// Left or right (`at` = -1 or 1), with the degrees of freedom of inner and outer stage. The inner module has its beams
    /// along X and deflects in Y. The outer one has them along Y, its secondary stage on `side` of ground in Y.
    fn across_y(
        &self,
        motion: &Stage,
        [inner, outer]: [usize; 2],
        at: f64,
        side: f64,
    ) -> [Stage; 3] {
        let ground = Coordinate::ground(N, self.geometric_stiffness);
        let (inner_y, outer_x) = (
            self.free(inner, self.operating_point_m / 2.0),
            self.free(outer, 0.0),
        );
        let inner = Stage {
            x: self.joined(&motion.x, &inner_y.from(&motion.y), at),
            y: inner_y,
        };
        // The intermediate stage does not move in Y: its row is zero, as the outer module is not bent at rest. The curve of
        // its y would change only the curve of its x, along which no static force acts.
        let x = self.joined(&inner.x, &ground.from(&inner.y), -at);
        let outer = Stage {
            y: self.joined(&ground, &outer_x, side),
            x: outer_x,
        };
        let y = self.joined(&outer.y, &x.from(&outer.x), -side);
        [inner, Stage { x, y }, outer]
    }

    /// Top or bottom (`at` = 1 or -1): as [`Self::across_y`] with X and Y exchanged, but here the outer module is bent at
    /// rest.
    fn across_x(
        &self,
        motion: &Stage,
        [inner, outer]: [usize; 2],
        at: f64,
        side: f64,
    ) -> [Stage; 3] {
        let ground = Coordinate::ground(N, self.geometric_stiffness);
        let (inner_x, outer_y) = (
            self.free(inner, 0.0),
            self.free(outer, self.operating_point_m / 2.0),
        );
        let inner = Stage {
            y: self.joined(&motion.y, &inner_x.from(&motion.x), at),
            x: inner_x,
        };
        let outer = Stage {
            x: self.joined(&ground, &outer_y, side),
            y: outer_y,
        };
        // To first order the intermediate stage follows the inner one in Y, as the inner module is not bent at rest.
        let x = self.joined(&outer.x, &inner.y.from(&outer.y), -side);
        let y = self.joined(&inner.y, &x.from(&inner.x), -at);
        [inner, Stage { x, y }, outer]
    }
}

impl PlantModel for XySettings {
    fn coordinates(&self) -> Vec<&str> {
        vec![
            "x_ms", "y_ms", "y_sL", "y_sR", "x_sT", "x_sB", "x_gL", "x_gR", "y_gT", "y_gB",
        ]
    }

    fn beam_length_m(&self) -> Option<f64> {
        Some(self.beam_length_m)
    }

    fn operating_point_m(&self) -> Option<f64> {
        Some(self.operating_point_m)
    }

    fn undamped(&self) -> Structure {
        let (stages, k) = (Stages::new(self), self.beam().parallelogram_n_per_m());
        let mut parts = Assembly::new(N);
        for (kilograms, stage) in stages.masses(self) {
            parts.add_mass(kilograms, stage.x.slice(), stage.y.slice());
        }
        let springs = stages.elongations();
        for spring in &springs {
            parts.add_spring(k, spring.slice());
        }
        let [pushed, .., loaded] = &stages.intermediate;
        let mut structure = parts.into_structure(pushed.x.slice(), stages.motion.x.slice());
        if self.geometric_stiffness {
            structure.stiffness += geometric_stiffness(&springs, k, &loaded.y);
        }
        structure
    }

    fn damping_settings(&self) -> Option<&DampingSettings> {
        Some(&self.damping)
    }

    /// Displacements of the thirteen stages in X and in Y; the row of one that cannot move is zero.
    fn ports(&self) -> Vec<Port> {
        let stages = Stages::new(self);
        let names = [
            "ms", "XL", "XR", "YT", "YB", "sL", "sR", "sT", "sB", "gL", "gR", "gT", "gB",
        ];
        let all = std::iter::once(stages.motion)
            .chain(stages.intermediate)
            .chain(stages.inner)
            .chain(stages.outer);
        names.into_iter().zip(all).flat_map(both_ports).collect()
    }
}

fn both_ports((name, stage): (&str, Stage)) -> [Port; 2] {
    [("x", stage.x), ("y", stage.y)]
        .map(|(axis, place)| Port::new(&format!("{axis}_{name}"), place.slice()))
}

/// The sum of static forces times curves: k d curve of each parallelogram bent by d, minus F curve of the holding force F,
/// which follows from the equilibrium in y_ms.
fn geometric_stiffness(springs: &[Coordinate], k: f64, held: &Coordinate) -> DMatrix<f64> {
    let pull_n: f64 = springs
        .iter()
        .map(|spring| k * spring.at_m * spring.row[Y_MS])
        .sum();
    let holding_n = pull_n / held.row[Y_MS];
    let bent = springs.iter().map(|spring| (k * spring.at_m, spring));
    let forces = bent.chain([(-holding_n, held)]);
    let curves = forces.filter_map(|(force_n, along)| Some((force_n, along.curve.as_ref()?)));
    curves.fold(DMatrix::zeros(N, N), |sum, (force_n, curve)| {
        sum + force_n * curve
    })
}

impl Stages {
    fn new(s: &XySettings) -> Stages {
        let (side_top, side_bottom) = s.sides();
        let motion = Stage {
            x: s.free(0, 0.0),
            y: s.free(Y_MS, s.operating_point_m),
        };
        let sides = [
            s.across_y(&motion, [2, 6], -1.0, 1.0),
            s.across_y(&motion, [3, 7], 1.0, -1.0),
            s.across_x(&motion, [4, 8], 1.0, side_top),
            s.across_x(&motion, [5, 9], -1.0, side_bottom),
        ];
        let of = |which: usize| sides.each_ref().map(|side| side[which].clone());
        Stages {
            inner: of(0),
            intermediate: of(1),
            outer: of(2),
            motion,
        }
    }

    /// Each stage with its mass in kilograms.
    fn masses(&self, s: &XySettings) -> impl Iterator<Item = (f64, &Stage)> {
        let d = &s.secondary_mass_deviation;
        let secondary_kg = [d.sL, d.sR, d.sT, d.sB, d.gL, d.gR, d.gT, d.gB]
            .map(|deviation| s.secondary_stage_mass_kg * (1.0 + deviation));
        let secondary = self.inner.iter().chain(&self.outer);
        let intermediate = self.intermediate.iter();
        std::iter::once((s.motion_stage_mass_kg, &self.motion))
            .chain(intermediate.map(|stage| (s.intermediate_stage_mass_kg, stage)))
            .chain(secondary_kg.into_iter().zip(secondary))
    }

    /// The transverse elongation of each of the sixteen parallelograms.
    fn elongations(&self) -> Vec<Coordinate> {
        (0..4)
            .flat_map(|place| self.module_elongations(place))
            .collect()
    }

    /// The elongations of the four parallelograms of one side: 0 left, 1 right, 2 top, 3 bottom.
    fn module_elongations(&self, place: usize) -> [Coordinate; 4] {
        let (inner, outer) = (&self.inner[place], &self.outer[place]);
        let (motion, intermediate) = (&self.motion, &self.intermediate[place]);
        if place < 2 {
            [
                motion.y.from(&inner.y),
                inner.y.from(&intermediate.y),
                outer.x.clone(),
                intermediate.x.from(&outer.x),
            ]
        } else {
            [
                motion.x.from(&inner.x),
                inner.x.from(&intermediate.x),
                outer.y.clone(),
                intermediate.y.from(&outer.y),
            ]
        }
    }
}
