//! Modal form: G(s) = sum of r_i/(s^2 + 2 zeta_i w_i s + w_i^2), force (N) to displacement (m).

use nalgebra::{Complex, DVector};
use serde::Serialize;

use super::linear_algebra::modes;
use super::{PlantError, Structure};

/// Natural frequency in rad/s of a mode far above all frequencies of interest: it acts as a constant compliance of
/// r/FAR_RAD_S^2 in m/N, with r its residue in 1/kg.
pub const FAR_RAD_S: f64 = 1e6;

/// One mode of a structure.
#[derive(Clone, Debug, PartialEq)]
pub struct Mode {
    /// Undamped natural frequency in rad/s; 0 of a free body.
    pub omega_rad_s: f64,
    /// Damping ratio; 0 of a free body.
    pub damping_ratio: f64,
    /// Shape over the degrees of freedom, of unit length, positive at the probe.
    pub shape: DVector<f64>,
    /// Modal force per newton, for the shape of unit modal mass.
    pub force_gain: f64,
    /// Displacement at the probe, for the shape of unit modal mass.
    pub sensor_gain: f64,
    /// Modal force per m/s^2 of floor acceleration (against it), for the shape of unit modal mass.
    pub floor_gain: f64,
}

impl Mode {
    /// A mode of residue 1/kg, 1/(s^2 + 2 zeta w s + w^2), without a shape and undisturbed by the floor.
    pub fn unit(omega_rad_s: f64, damping_ratio: f64) -> Mode {
        Mode {
            omega_rad_s,
            damping_ratio,
            shape: DVector::zeros(0),
            force_gain: 1.0,
            sensor_gain: 1.0,
            floor_gain: 0.0,
        }
    }

    /// The modal residue r = (c^T v)(q^T v)/(v^T M v) in 1/kg (Eq. 4-15, modal mass included).
    pub fn residue_per_kg(&self) -> f64 {
        self.force_gain * self.sensor_gain
    }

    /// The scale that gives velocities the size of displacements: w, or 1 rad/s of a free body.
    pub fn rate_scale_rad_s(&self) -> f64 {
        if self.omega_rad_s > 0.0 {
            self.omega_rad_s
        } else {
            1.0
        }
    }

    /// 1/(s^2 + 2 zeta w s + w^2).
    pub fn resonance(&self, s: Complex<f64>) -> Complex<f64> {
        let w = self.omega_rad_s;
        (s * s + s * (2.0 * self.damping_ratio * w) + w * w).inv()
    }

    /// r/(s^2 + 2 zeta w s + w^2).
    fn response(&self, s: Complex<f64>) -> Complex<f64> {
        self.resonance(s) * self.residue_per_kg()
    }

    /// The peak |r|/(2 zeta w^2) in m/N, with [`OBSERVED_DAMPING`] at least; infinite of a double integrator.
    fn peak_m_per_n(&self) -> f64 {
        let damping_ratio = self.damping_ratio.max(OBSERVED_DAMPING);
        let w = self.omega_rad_s;
        self.residue_per_kg().abs() / (2.0 * damping_ratio * w * w)
    }

    fn new(structure: &Structure, omega_rad_s: f64, unit_mass_shape: DVector<f64>) -> Mode {
        let v = oriented(structure, unit_mass_shape);
        let damping_rate = v.dot(&(&structure.damping * &v));
        Mode {
            omega_rad_s,
            damping_ratio: if omega_rad_s == 0.0 {
                0.0
            } else {
                damping_rate / (2.0 * omega_rad_s)
            },
            force_gain: structure.force.dot(&v),
            sensor_gain: structure.sensor.dot(&v),
            floor_gain: structure.floor.dot(&v),
            shape: v.normalize(),
        }
    }
}

/// The shape with the sign that is positive at the probe, or at its largest element where the probe measures none of it.
fn oriented(structure: &Structure, shape: DVector<f64>) -> DVector<f64> {
    let sensor_gain = structure.sensor.dot(&shape);
    let largest = shape[shape.iamax()];
    let is_measured = sensor_gain.abs() > 1e-6 * structure.sensor.norm() * largest.abs();
    let reference = if is_measured { sensor_gain } else { largest };
    (if reference < 0.0 { -1.0 } else { 1.0 }) * shape
}

/// Sign of a residue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Sign {
    /// The mode moves the probe in the direction of the force at low frequency.
    #[serde(rename = "+")]
    Plus,
    /// It moves the probe against the force.
    #[serde(rename = "-")]
    Minus,
    /// The mode cannot be observed between this actuator and this probe.
    #[serde(rename = "0")]
    Hidden,
}

impl Sign {
    /// The sign of the residue of a mode that can be observed.
    pub fn of(residue_per_kg: f64) -> Sign {
        if residue_per_kg > 0.0 {
            Sign::Plus
        } else {
            Sign::Minus
        }
    }

    /// `+`, `-` or `0`.
    pub fn symbol(self) -> char {
        match self {
            Sign::Plus => '+',
            Sign::Minus => '-',
            Sign::Hidden => '0',
        }
    }
}

/// Eigenvalues have an error of some 1e-15 of the largest: a mode below this ratio of it is not held by a spring.
const HELD_RATIO: f64 = 1e-12;
/// Residues below this ratio of the largest force gain times the largest sensor gain are rounding.
const ROUNDING_RATIO: f64 = 1e-13;
/// A mode whose peak is below this ratio of all other modes at its own frequency cannot be observed.
const OBSERVED_RATIO: f64 = 1e-3;
/// Damping ratio assumed for that decision where the model has less.
const OBSERVED_DAMPING: f64 = 1e-3;

/// The frequency of a mode from the eigenvalues, which rise: 0 of a free body.
fn frequency_rad_s(
    squares: &DVector<f64>,
    index: usize,
    free_bodies: usize,
) -> Result<f64, PlantError> {
    let square = squares[index];
    if index < free_bodies {
        Ok(0.0)
    } else if square > HELD_RATIO * squares.amax() {
        Ok(square.sqrt())
    } else {
        Err(PlantError::Unsupported {
            number: index + 1,
            eigenvalue_rad2_s2: square,
        })
    }
}

/// A structure as the sum of its modes, lowest frequency first.
///
/// ```
/// use bench_plant::{ModalModel, PlantSettings, build};
///
/// let settings: PlantSettings = toml::from_str(
///     r#"
///     model = "modal"
///     [modes]
///     first = { omega_rad_s = 180.0, residue_per_kg = 0.6 }
///     second = { omega_rad_s = 520.0, residue_per_kg = -0.1 }
///     "#,
/// )?;
/// let modal = ModalModel::of(&build(&settings)?)?;
/// let signs: String = modal.signs().iter().map(|sign| sign.symbol()).collect();
/// assert_eq!(signs, "+-");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ModalModel {
    /// The modes.
    pub modes: Vec<Mode>,
}

impl ModalModel {
    /// The modes of a structure whose damping matrix is diagonal in its mode shapes.
    pub fn of(structure: &Structure) -> Result<ModalModel, PlantError> {
        let (squares, shapes) = modes(&structure.mass, &structure.stiffness)?;
        let mut modal = ModalModel { modes: Vec::new() };
        for (index, shape) in shapes.column_iter().enumerate() {
            let omega_rad_s = frequency_rad_s(&squares, index, structure.free_bodies)?;
            let mode = Mode::new(structure, omega_rad_s, shape.into_owned());
            modal.modes.push(mode);
        }
        if modal.has_response() {
            Ok(modal)
        } else {
            Err(PlantError::NoResponse)
        }
    }

    /// Whether any residue is more than rounding of its two factors.
    fn has_response(&self) -> bool {
        let force = self.largest(|mode| mode.force_gain);
        let sensor = self.largest(|mode| mode.sensor_gain);
        self.largest(Mode::residue_per_kg) > ROUNDING_RATIO * force * sensor
    }

    fn largest(&self, of: fn(&Mode) -> f64) -> f64 {
        let sizes = self.modes.iter().map(|mode| of(mode).abs());
        sizes.fold(0.0, f64::max)
    }

    /// G(s): displacement in metres per newton.
    pub fn response(&self, s: Complex<f64>) -> Complex<f64> {
        self.modes.iter().map(|mode| mode.response(s)).sum()
    }

    /// The sign of each residue; hidden where the mode's peak |r|/(2 zeta w^2) is below 0.1 % of the response of all other
    /// modes at its frequency, so that no measurement would show it.
    pub fn signs(&self) -> Vec<Sign> {
        (0..self.modes.len())
            .map(|index| self.sign(index))
            .collect()
    }

    fn sign(&self, index: usize) -> Sign {
        let mode = &self.modes[index];
        let residue = mode.residue_per_kg();
        // The peak of a double integrator has no limit: it is observed unless its residue is rounding.
        let is_hidden = if mode.omega_rad_s == 0.0 {
            residue.abs() <= ROUNDING_RATIO * self.largest(Mode::residue_per_kg)
        } else {
            mode.peak_m_per_n() <= OBSERVED_RATIO * self.others(index)
        };
        if is_hidden {
            Sign::Hidden
        } else {
            Sign::of(residue)
        }
    }

    /// |G| of all modes but one, at that one's frequency.
    fn others(&self, index: usize) -> f64 {
        let s = Complex::new(0.0, self.modes[index].omega_rad_s);
        let modes = self.modes.iter().enumerate();
        let others = modes.filter(|(other, _)| *other != index);
        others
            .map(|(_, mode)| mode.response(s))
            .sum::<Complex<f64>>()
            .norm()
    }
}
