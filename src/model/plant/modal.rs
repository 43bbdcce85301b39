//! ModalModel form: G(s) = sum of r_i/(s^2 + 2 zeta_i w_i s + w_i^2), force (N) to displacement (m).

use nalgebra::{Complex, DVector};

use super::linear_algebra::modes;
use super::{PlantError, Structure};

/// One mode of a structure.
#[derive(Clone, Debug, PartialEq)]
pub struct Mode {
    /// Undamped natural frequency in rad/s; 0 of a free body.
    pub omega_rad_s: f64,
    /// Damping ratio; 0 of a free body.
    pub damping_ratio: f64,
    /// Shape over the degrees of freedom, of unit length, positive at the probe.
    pub shape: DVector<f64>,
    /// ModalModel force per newton, for the shape of unit modal mass.
    pub force_gain: f64,
    /// Displacement at the probe, for the shape of unit modal mass.
    pub sensor_gain: f64,
    /// ModalModel force per m/s^2 of the floor (against its acceleration), for the shape of unit modal mass.
    pub floor_gain: f64,
}

impl Mode {
    /// The modal residue r = (c^T v)(q^T v)/(v^T M v) in 1/kg (Eq. 4-15 with the modal mass in it).
    pub fn residue_per_kg(&self) -> f64 {
        self.force_gain * self.sensor_gain
    }

    /// What the velocity is divided by to be of the displacement's size: w, or 1 rad/s of a free body.
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
}

/// Sign of a residue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// In phase with the force at low frequency.
    Plus,
    /// Against it.
    Minus,
    /// The mode does not show between this actuator and this probe.
    Hidden,
}

impl Sign {
    /// Of the residue of a mode that shows.
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

/// Eigenvalues come with an error of some 1e-15 of the largest: below this ratio of it a mode is not held by its spring.
const HELD_RATIO: f64 = 1e-12;
/// Residues below this ratio of the largest force gain times the largest sensor gain are rounding.
const SILENT_RATIO: f64 = 1e-13;
/// A mode whose peak stays below this ratio of everything else at its own frequency does not show.
const VISIBLE_RATIO: f64 = 1e-3;
/// Damping assumed for that question where the model has less.
const VISIBLE_DAMPING: f64 = 1e-3;

/// A structure as the sum of its modes, slowest first.
#[derive(Clone, Debug, PartialEq)]
pub struct ModalModel {
    /// The modes.
    pub modes: Vec<Mode>,
}

impl ModalModel {
    /// The modes of a structure whose damping matrix its shapes make diagonal.
    pub fn of(structure: &Structure) -> Result<ModalModel, PlantError> {
        let (values, shapes) = modes(&structure.mass, &structure.stiffness)?;
        let floor = HELD_RATIO * values.amax();
        let modes =
            values
                .iter()
                .zip(shapes.column_iter())
                .enumerate()
                .map(|(index, (&w2, shape))| {
                    let shape: DVector<f64> = shape.into_owned();
                    match index < structure.free_bodies {
                        true => Ok(mode(structure, 0.0, shape)),
                        false if w2 <= floor => Err(PlantError::Free {
                            number: index + 1,
                            eigenvalue_rad2_s2: w2,
                        }),
                        false => Ok(mode(structure, w2.sqrt(), shape)),
                    }
                });
        let modal = ModalModel {
            modes: modes.collect::<Result<_, _>>()?,
        };
        if modal.is_deaf() {
            Err(PlantError::NoResponse)
        } else {
            Ok(modal)
        }
    }

    /// Whether no force reaches the probe: every residue is rounding beside its two parts.
    fn is_deaf(&self) -> bool {
        let largest = |of: fn(&Mode) -> f64| {
            self.modes
                .iter()
                .map(|mode| of(mode).abs())
                .fold(0.0, f64::max)
        };
        let (force, sensor) = (
            largest(|mode| mode.force_gain),
            largest(|mode| mode.sensor_gain),
        );
        largest(Mode::residue_per_kg) <= SILENT_RATIO * force * sensor
    }

    /// G(s): displacement in metres per newton.
    pub fn response(&self, s: Complex<f64>) -> Complex<f64> {
        self.modes
            .iter()
            .map(|mode| mode.resonance(s) * mode.residue_per_kg())
            .sum()
    }

    /// The sign of each residue; `None` where the mode's peak |r|/(2 zeta w^2) stays below 0.1 % of what all other modes
    /// give at its frequency, so that no measurement would show it.
    pub fn signs(&self) -> Vec<Sign> {
        let sign = |(index, mode): (usize, &Mode)| {
            let residue = mode.residue_per_kg();
            let peak = residue.abs()
                / (2.0
                    * mode.damping_ratio.max(VISIBLE_DAMPING)
                    * mode.omega_rad_s
                    * mode.omega_rad_s);
            // The peak of a double integrator has no end: it shows unless its residue is rounding.
            let free = mode.omega_rad_s == 0.0;
            let hidden = if free {
                self.is_rounding(residue)
            } else {
                peak <= VISIBLE_RATIO * self.others(index)
            };
            if hidden {
                Sign::Hidden
            } else {
                Sign::of(residue)
            }
        };
        self.modes.iter().enumerate().map(sign).collect()
    }

    fn is_rounding(&self, residue: f64) -> bool {
        residue.abs()
            <= SILENT_RATIO
                * self
                    .modes
                    .iter()
                    .map(|mode| mode.residue_per_kg().abs())
                    .fold(0.0, f64::max)
    }

    /// |G| of all modes but one, at that one's frequency.
    fn others(&self, index: usize) -> f64 {
        let s = Complex::new(0.0, self.modes[index].omega_rad_s);
        let rest = self
            .modes
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != index);
        rest.map(|(_, mode)| mode.resonance(s) * mode.residue_per_kg())
            .sum::<Complex<f64>>()
            .norm()
    }
}

fn mode(structure: &Structure, omega_rad_s: f64, unit_mass_shape: DVector<f64>) -> Mode {
    let sensor_gain = structure.sensor.dot(&unit_mass_shape);
    // The sign of a shape is free. Positive at the probe, or at its largest element where the probe sees nothing.
    let largest = unit_mass_shape[unit_mass_shape.iamax()];
    let seen = sensor_gain.abs() > 1e-6 * structure.sensor.norm() * largest.abs();
    let flip = if (if seen { sensor_gain } else { largest }) < 0.0 {
        -1.0
    } else {
        1.0
    };
    let v = flip * unit_mass_shape;
    Mode {
        omega_rad_s,
        damping_ratio: if omega_rad_s == 0.0 {
            0.0
        } else {
            v.dot(&(&structure.damping * &v)) / (2.0 * omega_rad_s)
        },
        force_gain: structure.force.dot(&v),
        sensor_gain: structure.sensor.dot(&v),
        floor_gain: structure.floor.dot(&v),
        shape: v.normalize(),
    }
}
