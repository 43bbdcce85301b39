//! Transmission zeros by pencils, never by summed polynomials.
//!
//! A zero is an s for which some motion z != 0 has no displacement at the probe, c^T z = 0, and is kept up by the
//! actuator alone, (s^2 M + s C + K) z = q F. With N_c and N_q orthonormal bases of what is orthogonal to c and q:
//!
//! ```text
//!   N_q^T (s^2 M + s C + K) N_c v = 0
//! ```
//!
//! Without damping this is a pencil of size n - 1 in u = s^2. One complex pair in u is a quartet in s: one pair of CNMP
//! zeros. With damping it is linearised to twice that size.

use nalgebra::{Complex, DMatrix, DVector};

use crate::model::plant::linear_algebra::{complement, pencil};
use crate::model::plant::{PlantError, Structure};

/// ZeroCounts of zeros (Fig 3-1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZeroKind {
    /// Marginal minimum phase: on the imaginary axis but for the damping.
    Mmp,
    /// Real, left half plane.
    Rmp,
    /// Real, right half plane.
    Rnmp,
    /// Complex, left half plane, of a quartet.
    Cmp,
    /// Complex, right half plane.
    Cnmp,
}

impl ZeroKind {
    /// The abbreviation used in the thesis.
    pub fn name(self) -> &'static str {
        match self {
            ZeroKind::Mmp => "MMP",
            ZeroKind::Rmp => "RMP",
            ZeroKind::Rnmp => "RNMP",
            ZeroKind::Cmp => "CMP",
            ZeroKind::Cnmp => "CNMP",
        }
    }
}

/// A zero with its kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zero {
    /// Where it is, in rad/s.
    pub s: Complex<f64>,
    /// What it is.
    pub kind: ZeroKind,
}

/// How many zeros of which kind a plant without damping has, by pairs and quartets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ZeroCounts {
    /// Pairs on the imaginary axis.
    pub mmp: usize,
    /// Pairs of one RMP and one RNMP zero.
    pub real: usize,
    /// Quartets of two CMP and two CNMP zeros.
    pub quartets: usize,
}

impl ZeroCounts {
    /// The kinds of the zeros of a plant without damping.
    pub fn of(zeros: &[Zero]) -> ZeroCounts {
        let count = |kind| zeros.iter().filter(|zero| zero.kind == kind).count();
        ZeroCounts {
            mmp: count(ZeroKind::Mmp) / 2,
            real: count(ZeroKind::Rnmp),
            quartets: count(ZeroKind::Cnmp) / 2,
        }
    }

    /// Zeros in the right half plane.
    pub fn in_right_half_plane(&self) -> usize {
        self.real + 2 * self.quartets
    }
}

/// As the thesis's tables write it: `dual MMP`, `MMP + RMP-RNMP`, `CMP-CNMP`.
impl std::fmt::Display for ZeroCounts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let named = |(count, name): (usize, &str)| match count {
            0 => None,
            1 => Some(name.to_string()),
            2 => Some(format!("dual {name}")),
            _ => Some(format!("{count} x {name}")),
        };
        let parts = [
            (self.mmp, "MMP"),
            (self.real, "RMP-RNMP"),
            (self.quartets, "CMP-CNMP"),
        ];
        let text = parts
            .into_iter()
            .filter_map(named)
            .collect::<Vec<_>>()
            .join(" + ");
        f.write_str(if text.is_empty() { "none" } else { &text })
    }
}

/// A pair in u counts as complex above this ratio of imaginary part to magnitude: two equal real values come out of the
/// eigenvalue iteration apart by the square root of the rounding (1.5e-8).
const COMPLEX_RATIO: f64 = 1e-7;

/// Zeros of the structure without its damping, slowest first.
pub fn undamped_zeros(structure: &Structure) -> Result<Vec<Zero>, PlantError> {
    undamped(&System::from(structure))
}

/// Zeros of the structure with its damping, slowest first. A zero in the left half plane has the kind of the undamped
/// zero it comes from.
pub fn damped_zeros(structure: &Structure) -> Result<Vec<Zero>, PlantError> {
    damped(&System::from(structure))
}

/// What the zeros of R + c^T (s^2 M + s C + K)^-1 q depend on.
pub(super) struct System<'a> {
    pub mass: &'a DMatrix<f64>,
    pub damping: &'a DMatrix<f64>,
    pub stiffness: &'a DMatrix<f64>,
    pub force: &'a DVector<f64>,
    pub sensor: &'a DVector<f64>,
    pub constant_m_per_n: f64,
}

impl<'a> From<&'a Structure> for System<'a> {
    fn from(structure: &'a Structure) -> Self {
        let Structure {
            mass,
            damping,
            stiffness,
            force,
            sensor,
            ..
        } = structure;
        System {
            mass,
            damping,
            stiffness,
            force,
            sensor,
            constant_m_per_n: 0.0,
        }
    }
}

/// The same with a constant beside the structure: zeros of R + c^T (s^2 M + K)^-1 q.
pub(super) fn undamped(system: &System) -> Result<Vec<Zero>, PlantError> {
    let scale = time_scale(system);
    let [mass, _, stiffness] = reduced(system, scale);
    let squares = pencil(&stiffness, &mass)?;
    let zeros = squares
        .iter()
        .flat_map(|u| of_square(u * (scale * scale)))
        .collect();
    Ok(sorted(zeros))
}

/// The same with damping: zeros of R + c^T (s^2 M + s C + K)^-1 q.
pub(super) fn damped(system: &System) -> Result<Vec<Zero>, PlantError> {
    let scale = time_scale(system);
    let [mass, damping, stiffness] = reduced(system, scale);
    let n = mass.nrows();
    let mut constant = DMatrix::identity(2 * n, 2 * n);
    let mut linear = DMatrix::zeros(2 * n, 2 * n);
    constant.view_mut((n, n), (n, n)).copy_from(&stiffness);
    linear.view_mut((0, n), (n, n)).fill_diagonal(-1.0);
    linear.view_mut((n, 0), (n, n)).copy_from(&mass);
    linear.view_mut((n, n), (n, n)).copy_from(&damping);
    let undamped = undamped(system)?;
    let zeros = pencil(&constant, &linear)?
        .iter()
        .map(|s| kind_of_damped(s * scale, &undamped))
        .collect();
    Ok(sorted(zeros))
}

/// Number of CNMP pairs among zeros.
pub fn cnmp_pairs(zeros: &[Zero]) -> usize {
    zeros
        .iter()
        .filter(|zero| zero.kind == ZeroKind::Cnmp)
        .count()
        / 2
}

/// Phase in degrees by which the plant falls below the minimum-phase plant of the same magnitude: 180 a zero in the right
/// half plane.
pub fn phase_drop_deg(zeros: &[Zero]) -> f64 {
    180.0
        * zeros
            .iter()
            .filter(|zero| matches!(zero.kind, ZeroKind::Cnmp | ZeroKind::Rnmp))
            .count() as f64
}

/// Mass, damping and stiffness of the pencil, with time in units of 1/`scale`: projected, by motions alone or, where there
/// is a constant beside the structure, by motions and force.
fn reduced(system: &System, scale: f64) -> [DMatrix<f64>; 3] {
    if system.constant_m_per_n != 0.0 {
        return with_constant(system, scale);
    }
    let [mass, damping, stiffness] = projected(system);
    [mass, damping / scale, stiffness / (scale * scale)]
}

/// With [N; m] an orthonormal basis of the motions z and forces f for which R f + c^T z = 0, and K N - q m for the
/// stiffness: M N, C N and that. Force and probe are brought to the size of the masses.
fn with_constant(system: &System, scale: f64) -> [DMatrix<f64>; 3] {
    let n = system.mass.nrows();
    let size = system.mass.norm();
    let (force, sensor) = (size / system.force.norm(), size / system.sensor.norm());
    let through = system.constant_m_per_n * scale * scale * force * sensor;
    let seen = system.sensor.clone() * sensor;
    let basis = complement(&seen.push(through));
    let (motions, forces) = (basis.rows(0, n), basis.row(n));
    let stiffness = system.stiffness * motions / (scale * scale) - force * system.force * forces;
    [
        system.mass * motions,
        system.damping * motions / scale,
        stiffness,
    ]
}

/// N_q^T (.) N_c of mass, damping and stiffness.
fn projected(system: &System) -> [DMatrix<f64>; 3] {
    let (output, input) = (complement(system.sensor), complement(system.force));
    [system.mass, system.damping, system.stiffness]
        .map(|matrix| input.transpose() * matrix * &output)
}

/// A frequency in the middle of the structure's own, so that scaled masses and stiffnesses are of one size.
fn time_scale(system: &System) -> f64 {
    let squared = system.stiffness.norm() / system.mass.norm();
    if squared > 0.0 { squared.sqrt() } else { 1.0 }
}

fn of_square(u: Complex<f64>) -> Vec<Zero> {
    let at = |re: f64, im: f64, kind| Zero {
        s: Complex::new(re, im),
        kind,
    };
    if u.im.abs() > COMPLEX_RATIO * u.norm() {
        // Both u and its conjugate come by here: each gives a right half plane zero and its mirror image.
        let s = u.sqrt();
        return vec![
            at(s.re, s.im, ZeroKind::Cnmp),
            at(-s.re, -s.im, ZeroKind::Cmp),
        ];
    }
    let size = u.re.abs().sqrt();
    if u.re < 0.0 {
        vec![at(0.0, size, ZeroKind::Mmp), at(0.0, -size, ZeroKind::Mmp)]
    } else {
        vec![at(-size, 0.0, ZeroKind::Rmp), at(size, 0.0, ZeroKind::Rnmp)]
    }
}

fn kind_of_damped(s: Complex<f64>, undamped: &[Zero]) -> Zero {
    let real = s.im.abs() <= COMPLEX_RATIO * s.norm();
    let nearest = undamped
        .iter()
        .min_by(|a, b| (a.s - s).norm().total_cmp(&(b.s - s).norm()));
    let kind = match (real, s.re > 0.0) {
        (true, true) => ZeroKind::Rnmp,
        (true, false) => ZeroKind::Rmp,
        (false, true) => ZeroKind::Cnmp,
        (false, false) if nearest.is_some_and(|zero| zero.kind != ZeroKind::Mmp) => ZeroKind::Cmp,
        (false, false) => ZeroKind::Mmp,
    };
    Zero { s, kind }
}

fn sorted(mut zeros: Vec<Zero>) -> Vec<Zero> {
    let key = |zero: &Zero| (zero.s.im.abs(), zero.s.re, zero.s.im);
    zeros.sort_by(|a, b| {
        key(a)
            .partial_cmp(&key(b))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    zeros
}
