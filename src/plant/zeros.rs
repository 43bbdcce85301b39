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

use nalgebra::{Complex, DMatrix};

use super::linear_algebra::{complement, pencil};
use super::{PlantError, Structure};

/// Kinds of zeros (Fig 3-1).
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

/// A pair in u counts as complex above this ratio of imaginary part to magnitude: two equal real values come out of the
/// eigenvalue iteration apart by the square root of the rounding (1.5e-8).
const COMPLEX_RATIO: f64 = 1e-7;

/// Zeros of the structure without its damping, slowest first.
pub fn undamped_zeros(structure: &Structure) -> Result<Vec<Zero>, PlantError> {
    let [mass, _, stiffness] = projected(structure);
    let scale = time_scale(structure);
    let squares = pencil(&(stiffness / (scale * scale)), &mass)?;
    let zeros = squares.iter().flat_map(|u| of_square(u * (scale * scale))).collect();
    Ok(sorted(zeros))
}

/// Zeros of the structure with its damping, slowest first. A zero in the left half plane has the kind of the undamped
/// zero it comes from.
pub fn damped_zeros(structure: &Structure) -> Result<Vec<Zero>, PlantError> {
    let [mass, damping, stiffness] = projected(structure);
    let n = mass.nrows();
    let scale = time_scale(structure);
    let mut constant = DMatrix::identity(2 * n, 2 * n);
    let mut linear = DMatrix::zeros(2 * n, 2 * n);
    constant.view_mut((n, n), (n, n)).copy_from(&(stiffness / (scale * scale)));
    linear.view_mut((0, n), (n, n)).fill_with_identity();
    linear.view_mut((0, n), (n, n)).neg_mut();
    linear.view_mut((n, 0), (n, n)).copy_from(&mass);
    linear.view_mut((n, n), (n, n)).copy_from(&(damping / scale));
    let undamped = undamped_zeros(structure)?;
    let zeros = pencil(&constant, &linear)?.iter().map(|s| damped(s * scale, &undamped)).collect();
    Ok(sorted(zeros))
}

/// Number of CNMP pairs among zeros.
pub fn cnmp_pairs(zeros: &[Zero]) -> usize {
    zeros.iter().filter(|zero| zero.kind == ZeroKind::Cnmp).count() / 2
}

/// Phase in degrees by which the plant falls below the minimum-phase plant of the same magnitude: 180 a zero in the right
/// half plane.
pub fn phase_drop_deg(zeros: &[Zero]) -> f64 {
    180.0 * zeros.iter().filter(|zero| matches!(zero.kind, ZeroKind::Cnmp | ZeroKind::Rnmp)).count() as f64
}

/// N_q^T (.) N_c of mass, damping and stiffness.
fn projected(structure: &Structure) -> [DMatrix<f64>; 3] {
    let (output, input) = (complement(&structure.sensor), complement(&structure.force));
    [&structure.mass, &structure.damping, &structure.stiffness].map(|matrix| input.transpose() * matrix * &output)
}

/// A frequency in the middle of the structure's own, so that scaled masses and stiffnesses are of one size.
fn time_scale(structure: &Structure) -> f64 {
    (structure.stiffness.norm() / structure.mass.norm()).sqrt()
}

fn of_square(u: Complex<f64>) -> Vec<Zero> {
    let at = |re: f64, im: f64, kind| Zero { s: Complex::new(re, im), kind };
    if u.im.abs() > COMPLEX_RATIO * u.norm() {
        // Both u and its conjugate come by here: each gives a right half plane zero and its mirror image.
        let s = u.sqrt();
        return vec![at(s.re, s.im, ZeroKind::Cnmp), at(-s.re, -s.im, ZeroKind::Cmp)];
    }
    let size = u.re.abs().sqrt();
    if u.re < 0.0 {
        vec![at(0.0, size, ZeroKind::Mmp), at(0.0, -size, ZeroKind::Mmp)]
    } else {
        vec![at(-size, 0.0, ZeroKind::Rmp), at(size, 0.0, ZeroKind::Rnmp)]
    }
}

fn damped(s: Complex<f64>, undamped: &[Zero]) -> Zero {
    let real = s.im.abs() <= COMPLEX_RATIO * s.norm();
    let nearest = undamped.iter().min_by(|a, b| (a.s - s).norm().total_cmp(&(b.s - s).norm()));
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
    zeros.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
    zeros
}
