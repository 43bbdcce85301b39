//! Transmission zeros from pencils, not from summed polynomials.
//!
//! A zero is an s for which some motion z != 0 has no displacement at the probe, c^T z = 0, and needs no force but the
//! actuator's, (s^2 M + s C + K) z = q F. With N_c and N_q orthonormal bases of the vectors orthogonal to c and q:
//!
//! ```text
//!   N_q^T (s^2 M + s C + K) N_c v = 0
//! ```
//!
//! Without damping this is a pencil of size n - 1 in u = s^2. One complex pair in u is a quartet in s: one pair of CNMP
//! zeros. With damping it is linearised to twice that size.

use nalgebra::{Complex, DMatrix, DVector};
use serde::{Serialize, Serializer};

use crate::linear_algebra::{orthogonal_complement, pencil_roots};
use crate::{PlantError, Structure};

/// Kinds of zeros (Fig 3-1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum ZeroKind {
    /// Marginally minimum phase: without damping on the imaginary axis.
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

    /// Whether the zero lies in the right half plane.
    pub fn is_non_minimum_phase(self) -> bool {
        matches!(self, ZeroKind::Rnmp | ZeroKind::Cnmp)
    }
}

/// A zero with its kind. It is serialised as `re_rad_s`, `im_rad_s`, `kind`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Zero {
    /// Position in rad/s.
    #[serde(flatten, serialize_with = "rectangular")]
    pub s: Complex<f64>,
    /// Kind.
    pub kind: ZeroKind,
}

/// Serialises a complex number as the entries `re_rad_s` and `im_rad_s`, `null` at infinity.
pub(super) fn rectangular<S: Serializer>(s: &Complex<f64>, to: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Rectangular {
        re_rad_s: f64,
        im_rad_s: f64,
    }
    let (re_rad_s, im_rad_s) = (s.re, s.im);
    Rectangular { re_rad_s, im_rad_s }.serialize(to)
}

/// Numbers of zeros by kind of a plant without damping, in pairs and quartets.
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
    /// Counts the zeros of a plant without damping.
    pub fn of(zeros: &[Zero]) -> ZeroCounts {
        ZeroCounts {
            mmp: count(zeros, ZeroKind::Mmp) / 2,
            real: count(zeros, ZeroKind::Rnmp),
            quartets: cnmp_pairs(zeros),
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
        let parts = [
            named(self.mmp, "MMP"),
            named(self.real, "RMP-RNMP"),
            named(self.quartets, "CMP-CNMP"),
        ];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        if parts.is_empty() {
            f.write_str("none")
        } else {
            f.write_str(&parts.join(" + "))
        }
    }
}

fn named(count: usize, name: &str) -> Option<String> {
    match count {
        0 => None,
        1 => Some(name.to_string()),
        2 => Some(format!("dual {name}")),
        _ => Some(format!("{count} x {name}")),
    }
}

impl Serialize for ZeroCounts {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

fn count(zeros: &[Zero], kind: ZeroKind) -> usize {
    zeros.iter().filter(|zero| zero.kind == kind).count()
}

/// Number of CNMP pairs among zeros.
pub fn cnmp_pairs(zeros: &[Zero]) -> usize {
    count(zeros, ZeroKind::Cnmp) / 2
}

/// Phase lag in degrees beyond that of the minimum-phase plant of the same magnitude: 180 for each zero in the right half
/// plane.
pub fn phase_drop_deg(zeros: &[Zero]) -> f64 {
    let right = zeros
        .iter()
        .filter(|zero| zero.kind.is_non_minimum_phase())
        .count();
    180.0 * right as f64
}

/// Zeros of the structure without its damping, lowest frequency first.
///
/// ```
/// use bench_plant::{PlantSettings, build, zeros};
///
/// // Equal residues +, -, +: with S = s^2 the numerator is S^2 + 2 b S + (a b - a c + b c), whose discriminant
/// // 4 (b - a) (b - c) is negative: the zeros are complex.
/// let settings: PlantSettings = toml::from_str(
///     r#"
///     model = "modal"
///     [modes]
///     first = { omega_rad_s = 180.0, residue_per_kg = 1.0 }
///     second = { omega_rad_s = 200.0, residue_per_kg = -1.0 }
///     third = { omega_rad_s = 300.0, residue_per_kg = 1.0 }
///     "#,
/// )?;
/// let zeros_of_stage = zeros::undamped_zeros(&build(&settings)?)?;
/// assert_eq!(zeros::cnmp_pairs(&zeros_of_stage), 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn undamped_zeros(structure: &Structure) -> Result<Vec<Zero>, PlantError> {
    undamped(&System::from(structure))
}

/// Zeros of the structure with its damping, lowest frequency first. A zero in the left half plane has the kind of the nearest
/// undamped zero.
pub fn damped_zeros(structure: &Structure) -> Result<Vec<Zero>, PlantError> {
    damped(&System::from(structure))
}

/// The matrices, vectors and constant that determine the zeros of R + c^T (s^2 M + s C + K)^-1 q.
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
        System {
            mass: &structure.mass,
            damping: &structure.damping,
            stiffness: &structure.stiffness,
            force: &structure.force,
            sensor: &structure.sensor,
            constant_m_per_n: 0.0,
        }
    }
}

/// Zeros of R + c^T (s^2 M + K)^-1 q.
pub(super) fn undamped(system: &System) -> Result<Vec<Zero>, PlantError> {
    let scale = system.frequency_scale();
    let [mass, _, stiffness] = system.reduced(scale);
    let squares = pencil_roots(&stiffness, &mass)?;
    let zeros = squares
        .iter()
        .flat_map(|u| zeros_of_square(u * (scale * scale)));
    Ok(sorted(zeros.collect()))
}

/// Zeros of R + c^T (s^2 M + s C + K)^-1 q.
pub(super) fn damped(system: &System) -> Result<Vec<Zero>, PlantError> {
    let scale = system.frequency_scale();
    let [mass, damping, stiffness] = system.reduced(scale);
    let [constant, linear] = linearised(&mass, &damping, &stiffness);
    let undamped = undamped(system)?;
    let roots = pencil_roots(&constant, &linear)?;
    let zeros = roots.iter().map(|s| damped_zero(s * scale, &undamped));
    Ok(sorted(zeros.collect()))
}

/// The pencil P + s L of twice the size with the roots of s^2 M + s C + K.
fn linearised(
    mass: &DMatrix<f64>,
    damping: &DMatrix<f64>,
    stiffness: &DMatrix<f64>,
) -> [DMatrix<f64>; 2] {
    let n = mass.nrows();
    let mut constant = DMatrix::identity(2 * n, 2 * n);
    let mut linear = DMatrix::zeros(2 * n, 2 * n);
    constant.view_mut((n, n), (n, n)).copy_from(stiffness);
    linear.view_mut((0, n), (n, n)).fill_diagonal(-1.0);
    linear.view_mut((n, 0), (n, n)).copy_from(mass);
    linear.view_mut((n, n), (n, n)).copy_from(damping);
    [constant, linear]
}

impl System<'_> {
    /// Mass, damping and stiffness of the pencil, with time in units of 1/`scale`: projected by motions alone or, where
    /// there is a constant, by motions and force.
    fn reduced(&self, scale: f64) -> [DMatrix<f64>; 3] {
        if self.constant_m_per_n != 0.0 {
            return self.with_constant(scale);
        }
        let [mass, damping, stiffness] = self.projected();
        [mass, damping / scale, stiffness / (scale * scale)]
    }

    /// M N, C N and K N - q m, with [N; m] an orthonormal basis of the motions z and forces f for which R f + c^T z = 0.
    /// Force and probe are scaled to the size of the masses.
    fn with_constant(&self, scale: f64) -> [DMatrix<f64>; 3] {
        let n = self.mass.nrows();
        let size = self.mass.norm();
        let (force, sensor) = (size / self.force.norm(), size / self.sensor.norm());
        let through = self.constant_m_per_n * scale * scale * force * sensor;
        let measured = self.sensor.clone() * sensor;
        let basis = orthogonal_complement(&measured.push(through));
        let (motions, forces) = (basis.rows(0, n), basis.row(n));
        let stiffness = self.stiffness * motions / (scale * scale) - force * self.force * forces;
        [
            self.mass * motions,
            self.damping * motions / scale,
            stiffness,
        ]
    }

    /// N_q^T (.) N_c of mass, damping and stiffness.
    fn projected(&self) -> [DMatrix<f64>; 3] {
        let output = orthogonal_complement(self.sensor);
        let input = orthogonal_complement(self.force);
        [self.mass, self.damping, self.stiffness].map(|matrix| input.transpose() * matrix * &output)
    }

    /// A frequency between those of the structure: with its inverse as the unit of time, masses and stiffnesses have similar
    /// magnitudes.
    fn frequency_scale(&self) -> f64 {
        let squared = self.stiffness.norm() / self.mass.norm();
        if squared > 0.0 { squared.sqrt() } else { 1.0 }
    }
}

/// Above this ratio of imaginary part to magnitude a root is off the real axis: the eigenvalue iteration separates two
/// equal real ones by the square root of the rounding (1.5e-8).
const COMPLEX_RATIO: f64 = 1e-7;

/// Whether a root is real to rounding.
pub(super) fn is_real(root: Complex<f64>) -> bool {
    root.im.abs() <= COMPLEX_RATIO * root.norm()
}

/// The two zeros s = +-sqrt(u).
fn zeros_of_square(u: Complex<f64>) -> [Zero; 2] {
    let zero = |re: f64, im: f64, kind| Zero {
        s: Complex::new(re, im),
        kind,
    };
    let size = u.re.abs().sqrt();
    if !is_real(u) {
        // Called for u and for its conjugate: each call gives one zero in the right half plane and its mirror image.
        let s = u.sqrt();
        [
            zero(s.re, s.im, ZeroKind::Cnmp),
            zero(-s.re, -s.im, ZeroKind::Cmp),
        ]
    } else if u.re < 0.0 {
        [
            zero(0.0, size, ZeroKind::Mmp),
            zero(0.0, -size, ZeroKind::Mmp),
        ]
    } else {
        [
            zero(-size, 0.0, ZeroKind::Rmp),
            zero(size, 0.0, ZeroKind::Rnmp),
        ]
    }
}

/// A zero with damping. In the left half plane it has the kind of the nearest zero without damping.
pub(super) fn damped_zero(s: Complex<f64>, undamped: &[Zero]) -> Zero {
    let distance = |zero: &Zero| (zero.s - s).norm();
    let nearest = undamped
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let kind = match (is_real(s), s.re > 0.0) {
        (true, true) => ZeroKind::Rnmp,
        (true, false) => ZeroKind::Rmp,
        (false, true) => ZeroKind::Cnmp,
        (false, false) if nearest.is_some_and(|zero| zero.kind != ZeroKind::Mmp) => ZeroKind::Cmp,
        (false, false) => ZeroKind::Mmp,
    };
    Zero { s, kind }
}

pub(super) fn sorted(mut zeros: Vec<Zero>) -> Vec<Zero> {
    let key = |zero: &Zero| (zero.s.im.abs(), zero.s.re, zero.s.im);
    zeros.sort_by(|a, b| {
        key(a)
            .partial_cmp(&key(b))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    zeros
}
