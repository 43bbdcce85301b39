//! The XY stage of section 2.2.4 (Fig 1-2a), derived from its sixteen parallelograms.
//!
//! ```text
//!                   ground
//!                 gT      YT                   degrees of freedom
//!                         sT                   z = [x_ms, y_ms, y_sL, y_sR, x_sT, x_sB, x_gL, x_gR, y_gT, y_gB]
//!          gL                      gR
//!  ground     XL  sL  ms  sR  XR     ground    at X = 0, Y = Y0: y_sL = y_sR = y_gT = y_gB = Y0/2
//!                         sB
//!                         YB  gB               the motor pushes XL in X, the probe sees x_ms
//!                         ground
//! ```
//!
//! On which side of their stages the ground modules sit is not known, as Fig 1-2a is missing. With s = +-1 the side of the
//! secondary stage beside its anchor, in X for gT and gB, in Y for gL and gR: the layout chooses s_T and s_B; s_L = +1 and
//! s_R = -1 always, which with s_T = +1, s_B = -1 is the pinwheel, the same after a quarter turn. s_L and s_R decide
//! about the geometric stiffness alone.
//!
//! Geometric stiffness: a force on YB, opposite to where a Y motor pushes as XL is to X, holds Y0. It loads sB, gL, gR, sT
//! along their beams, and what moves across those gives way by the static force times the constraint's curvature. The
//! static solution is that of equal stiffness in all parallelograms; no force acts in X.

use nalgebra::DMatrix;

use super::beam::Beam;
use super::kinematics::Coordinate;
use super::structure::Assembly;
use super::{PlantError, Port, Structure, damping};
use crate::config::{XyLayout, XySettings};

/// Degrees of freedom.
const N: usize = 10;
/// The place of y_ms among them.
const Y_MS: usize = 1;

/// A stage: where it is in X and Y.
#[derive(Clone, Debug)]
struct Stage {
    x: Coordinate,
    y: Coordinate,
}

/// The thirteen stages; secondary stages in the order L, R, T, B, and intermediate ones XL, XR, YT, YB.
struct Stages {
    motion: Stage,
    intermediate: [Stage; 4],
    inner: [Stage; 4],
    outer: [Stage; 4],
}

pub(super) fn structure(s: &XySettings) -> Result<Structure, PlantError> {
    let mut structure = undamped(s);
    structure.damping = damping::matrix(&structure, &s.damping)?;
    Ok(structure)
}

/// The same with C = 0, whatever the damping of the settings.
pub(super) fn undamped(s: &XySettings) -> Structure {
    let beam = Beam::from(s);
    let stages = Stages::of(s, beam.shortening_per_m());
    let mut parts = Assembly::new(N);
    for (kilograms, stage) in stages.masses(s) {
        parts.mass(kilograms, stage.x.row.as_slice(), stage.y.row.as_slice());
    }
    let springs = stages.springs();
    let k = beam.parallelogram_n_per_m();
    for spring in &springs {
        parts.spring(k, spring.row.as_slice());
    }
    let [pushed, .., loaded] = &stages.intermediate;
    let mut structure = parts.finish(pushed.x.row.as_slice(), stages.motion.x.row.as_slice());
    if s.geometric_stiffness {
        structure.stiffness += geometric_stiffness(&springs, k, &loaded.y);
    }
    structure
}

/// The displacements of the thirteen stages in X and in Y; the row of one that cannot move is zero.
pub(super) fn ports(s: &XySettings) -> Vec<Port> {
    let stages = Stages::of(s, Beam::from(s).shortening_per_m());
    let named = |names: [&'static str; 4], four: [Stage; 4]| names.into_iter().zip(four);
    let motion = std::iter::once(("ms", stages.motion));
    let all = motion
        .chain(named(["XL", "XR", "YT", "YB"], stages.intermediate))
        .chain(named(["sL", "sR", "sT", "sB"], stages.inner))
        .chain(named(["gL", "gR", "gT", "gB"], stages.outer));
    let both = |(name, stage): (&str, Stage)| {
        [("x", stage.x.row), ("y", stage.y.row)]
            .map(|(axis, row)| Port::new(&format!("{axis}_{name}"), row.as_slice()))
    };
    all.flat_map(both).collect()
}

/// The sum of static forces times curves: k d curve of each parallelogram bent by d, less F curve of the holding force F,
/// which follows from the equilibrium in y_ms.
fn geometric_stiffness(springs: &[Coordinate], k: f64, held: &Coordinate) -> DMatrix<f64> {
    let pull_n: f64 = springs
        .iter()
        .map(|spring| k * spring.at_m * spring.row[Y_MS])
        .sum();
    let holding_n = pull_n / held.row[Y_MS];
    let add = |sum: DMatrix<f64>, (force_n, along): (f64, &Coordinate)| match &along.curve {
        Some(curve) => sum + force_n * curve,
        None => sum,
    };
    let bent = springs.iter().map(|d| (k * d.at_m, d));
    bent.chain([(-holding_n, held)])
        .fold(DMatrix::zeros(N, N), add)
}

impl Stages {
    fn of(s: &XySettings, c: f64) -> Stages {
        let (y0, half) = (s.operating_point_m, s.operating_point_m / 2.0);
        let free = |index, at_m| Coordinate::free(N, s.geometric_stiffness, index, at_m);
        let (side_top, side_bottom) = match s.layout {
            XyLayout::Pinwheel => (1.0, -1.0),
            XyLayout::MirrorAway => (1.0, 1.0),
            XyLayout::MirrorToward => (-1.0, -1.0),
        };
        let motion = Stage {
            x: free(0, 0.0),
            y: free(Y_MS, y0),
        };
        let [(s_l, xl, g_l), (s_r, xr, g_r)] =
            [(2, 6, -1.0, 1.0), (3, 7, 1.0, -1.0)].map(|(inner, outer, at, side)| {
                across_y(&motion, free(inner, half), free(outer, 0.0), at, side, c)
            });
        let [(s_t, yt, g_t), (s_b, yb, g_b)] = [(4, 8, 1.0, side_top), (5, 9, -1.0, side_bottom)]
            .map(|(inner, outer, at, side)| {
                across_x(&motion, free(inner, 0.0), free(outer, half), at, side, c)
            });
        Stages {
            motion,
            intermediate: [xl, xr, yt, yb],
            inner: [s_l, s_r, s_t, s_b],
            outer: [g_l, g_r, g_t, g_b],
        }
    }

    fn masses(&self, s: &XySettings) -> Vec<(f64, &Stage)> {
        let d = &s.secondary_mass_deviation;
        let secondary = |deviation: f64| s.secondary_stage_mass_kg * (1.0 + deviation);
        let inner = [d.sL, d.sR, d.sT, d.sB]
            .map(secondary)
            .into_iter()
            .zip(&self.inner);
        let outer = [d.gL, d.gR, d.gT, d.gB]
            .map(secondary)
            .into_iter()
            .zip(&self.outer);
        let intermediate = self
            .intermediate
            .iter()
            .map(|stage| (s.intermediate_stage_mass_kg, stage));
        std::iter::once((s.motion_stage_mass_kg, &self.motion))
            .chain(intermediate)
            .chain(inner)
            .chain(outer)
            .collect()
    }

    /// How far each of the sixteen parallelograms is bent.
    fn springs(&self) -> Vec<Coordinate> {
        let module = |place: usize| {
            let (inner, outer, intermediate) = (
                &self.inner[place],
                &self.outer[place],
                &self.intermediate[place],
            );
            let in_y = [
                self.motion.y.from(&inner.y),
                inner.y.from(&intermediate.y),
                outer.x.clone(),
                intermediate.x.from(&outer.x),
            ];
            let in_x = [
                self.motion.x.from(&inner.x),
                inner.x.from(&intermediate.x),
                outer.y.clone(),
                intermediate.y.from(&outer.y),
            ];
            if place < 2 { in_y } else { in_x }
        };
        (0..4).flat_map(module).collect()
    }
}

/// Left or right (`at` = -1 or 1): the inner module has its beams along X and gives way in Y, the outer one the other way
/// round, its secondary stage on `side` of ground in Y. Returns inner, intermediate and outer stage.
fn across_y(
    motion: &Stage,
    inner_y: Coordinate,
    outer_x: Coordinate,
    at: f64,
    side: f64,
    c: f64,
) -> (Stage, Stage, Stage) {
    let ground = Coordinate::ground(N, motion.x.curve.is_some());
    let inner = Stage {
        x: motion.x.joined(&inner_y.from(&motion.y), at, c),
        y: inner_y,
    };
    // In Y the intermediate stage is held: its row is zero, as the outer module is not bent at rest. Its curve, which the
    // line after the next finds, would change only the curve of its x, along which no static force acts.
    let x = inner.x.joined(&ground.from(&inner.y), -at, c);
    let outer = Stage {
        y: ground.joined(&outer_x, side, c),
        x: outer_x,
    };
    let y = outer.y.joined(&x.from(&outer.x), -side, c);
    (inner, Stage { x, y }, outer)
}

/// Top or bottom (`at` = 1 or -1): as [`across_y`] with X and Y exchanged, but here the outer module is bent at rest.
fn across_x(
    motion: &Stage,
    inner_x: Coordinate,
    outer_y: Coordinate,
    at: f64,
    side: f64,
    c: f64,
) -> (Stage, Stage, Stage) {
    let ground = Coordinate::ground(N, motion.x.curve.is_some());
    let inner = Stage {
        y: motion.y.joined(&inner_x.from(&motion.x), at, c),
        x: inner_x,
    };
    let outer = Stage {
        x: ground.joined(&outer_y, side, c),
        y: outer_y,
    };
    // To first order the intermediate stage follows the inner one in Y, as the inner module is not bent at rest.
    let x = outer.x.joined(&inner.y.from(&outer.y), -side, c);
    let y = inner.y.joined(&x.from(&inner.x), -at, c);
    (inner, Stage { x, y }, outer)
}
