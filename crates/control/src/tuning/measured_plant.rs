//! A plant that was identified from a measured frequency response.

use super::plant::{DesignPlant, Tolerances, variations};
use super::uncertainty::{IdentifiedResponse, Uncertainty, loop_plant};
use super::unmodelled::UnmodelledBound;
use bench_plant::Mode;
use bench_plant::UnmodelledMode;

/// A plant from a measured frequency response.
#[derive(Clone, Debug)]
pub struct MeasuredPlant {
    /// Name, for messages.
    pub name: String,
    /// The fitted modes that the design uses with their signs, lowest frequency first, none of them a free body.
    pub modes: Vec<Mode>,
    /// The other fitted modes, which count with any phase. Modes that are too close to be determined separately are one group, and keep
    /// their signs relative to each other.
    pub minor: Vec<Vec<UnmodelledMode>>,
    /// Signal path, compliance above the band, and the region of the true response.
    pub response: IdentifiedResponse,
}

impl MeasuredPlant {
    /// The plant and its variations within the tolerances, as of a plant of the model, each with the region of its response.
    pub fn with_tolerances(&self, tolerances: &Tolerances) -> Vec<DesignPlant> {
        let variations = variations(&self.modes, tolerances).into_iter();
        let plants = variations.map(|(change, modes)| DesignPlant {
            is_nominal: change.is_empty(),
            ..self.varied(format!("{}{change}", self.name), modes)
        });
        plants.collect()
    }

    fn varied(&self, name: String, modes: Vec<Mode>) -> DesignPlant {
        let response = &self.response;
        DesignPlant {
            plant: loop_plant(&response.path, &modes, response.remainder_m_per_n),
            uncertainty: Uncertainty::of(response, &modes),
            ..DesignPlant::new(name, &response.path, modes)
        }
    }

    /// The bound of the modes that count with any phase, whose frequencies are known to `tolerance_ratio`.
    pub fn minor_bound(&self, tolerance_ratio: f64) -> UnmodelledBound {
        UnmodelledBound::of_groups(&self.response.path, &self.minor, tolerance_ratio)
    }
}
