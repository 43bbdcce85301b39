//! Modes, residues, signs and zeros of a plant at one operating point.

use serde::Serialize;

use super::bounds::{Bound, Demand};
use super::sequence::{dominant_sequence, sign_sequence};
use bench_base::units::hz;
use bench_plant::zeros::{Zero, cnmp_pairs, damped_zeros, phase_drop_deg, undamped_zeros};
use bench_plant::{ModalModel, Mode, PlantError, PlantSettings, Sign, build};

/// One mode.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModeSummary {
    /// Undamped natural frequency in rad/s.
    pub omega_rad_s: f64,
    /// The same in hertz.
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Residue in 1/kg.
    pub residue: f64,
    /// Sign of the residue.
    pub sign: Sign,
    /// Shape over the coordinates, of unit length.
    pub shape: Vec<f64>,
}

impl ModeSummary {
    fn all(modal: &ModalModel) -> Vec<ModeSummary> {
        let modes = modal.modes.iter().zip(modal.signs());
        modes
            .map(|(mode, sign)| ModeSummary::new(mode, sign))
            .collect()
    }

    fn new(mode: &Mode, sign: Sign) -> ModeSummary {
        ModeSummary {
            omega_rad_s: mode.omega_rad_s,
            frequency_hz: hz(mode.omega_rad_s),
            damping_ratio: mode.damping_ratio,
            residue: mode.residue_per_kg(),
            sign,
            shape: mode.shape.iter().copied().collect(),
        }
    }
}

/// Modes and zeros of a plant, with the limits that its zeros set to a controller.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlantSummary {
    /// `plant.model`.
    pub model: &'static str,
    /// Operating point in metres, of a model that has one.
    pub operating_point_m: Option<f64>,
    /// Mass asymmetry D, of a model that has it.
    pub mass_asymmetry: Option<f64>,
    /// Names of the coordinates of a shape.
    pub coordinates: Vec<String>,
    /// The modes, lowest frequency first.
    pub modes: Vec<ModeSummary>,
    /// The zeros without damping.
    pub zeros: Vec<Zero>,
    /// The zeros with damping.
    pub damped_zeros: Vec<Zero>,
    /// Number of CNMP pairs without damping.
    pub cnmp_pairs: usize,
    /// Number of CNMP pairs with damping.
    pub damped_cnmp_pairs: usize,
    /// Signs of the modes that can be observed.
    pub sign_sequence: String,
    /// The dominant modes along frequency.
    pub dominant_sequence: String,
    /// Phase lag beyond that of a minimum-phase plant, in degrees.
    pub phase_drop_deg: f64,
    /// Bandwidths for |S| < [`Self::ALPHA`] in the band and a peak of [`Self::PEAK`], from the zeros without damping.
    pub bounds: Vec<Bound>,
}

impl PlantSummary {
    /// Limit of |S| in the band.
    pub const ALPHA: f64 = 0.5;
    /// Limit of |S| at all frequencies; 2 is a modulus margin of 0.5.
    pub const PEAK: f64 = 2.0;

    /// The summary of a plant.
    pub fn of(plant: &PlantSettings) -> Result<PlantSummary, PlantError> {
        let structure = build(plant)?;
        let modal = ModalModel::of(&structure)?;
        let zeros = undamped_zeros(&structure)?;
        let damped_zeros = damped_zeros(&structure)?;
        Ok(PlantSummary {
            model: plant.model(),
            operating_point_m: plant.operating_point_m(),
            mass_asymmetry: plant.mass_asymmetry(),
            coordinates: plant.coordinates().into_iter().map(String::from).collect(),
            modes: ModeSummary::all(&modal),
            cnmp_pairs: cnmp_pairs(&zeros),
            damped_cnmp_pairs: cnmp_pairs(&damped_zeros),
            sign_sequence: sign_sequence(&modal),
            dominant_sequence: dominant_sequence(&modal)?,
            phase_drop_deg: phase_drop_deg(&zeros),
            bounds: Bound::of(&zeros, Self::ALPHA, Demand::Peak(Self::PEAK)),
            zeros,
            damped_zeros,
        })
    }
}
