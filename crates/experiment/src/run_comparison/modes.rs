//! The modes and the static compliance of two runs.

use serde::Serialize;

use super::difference::Difference;
use super::mode_pairs::same_mode;
use bench_identify::modal::{FittedMode, ModalFit};

/// A mode that both runs show.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ModeDifference {
    /// Undamped natural frequency in hertz.
    pub frequency_hz: Difference,
    /// Damping ratio.
    pub damping_ratio: Difference,
    /// Residue in 1/kg.
    #[serde(rename = "residue")]
    pub residue_per_kg: Difference,
    /// Whether the signs of the residues differ.
    pub sign_differs: bool,
}

impl ModeDifference {
    fn of(reference: &FittedMode, other: &FittedMode) -> ModeDifference {
        ModeDifference {
            frequency_hz: Difference::of(reference.frequency_hz(), other.frequency_hz()),
            damping_ratio: Difference::of(reference.damping_ratio, other.damping_ratio),
            residue_per_kg: Difference::of(reference.residue_per_kg, other.residue_per_kg),
            sign_differs: reference.sign() != other.sign(),
        }
    }

    /// Its differences.
    pub(super) fn tested(&mut self) -> [&mut Difference; 3] {
        [
            &mut self.frequency_hz,
            &mut self.damping_ratio,
            &mut self.residue_per_kg,
        ]
    }
}

/// The modes of two runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ModeDifferences {
    /// The modes that both runs show, lowest frequency first.
    pub modes: Vec<ModeDifference>,
    /// Frequencies in hertz of the modes that only the reference run shows.
    pub only_in_reference_hz: Vec<f64>,
    /// Frequencies in hertz of the modes that only the other run shows.
    pub only_in_other_hz: Vec<f64>,
    /// Static compliance in m/N by the fit; `None` for a free body.
    pub static_compliance_m_per_n: Option<Difference>,
}

impl ModeDifferences {
    /// Pairs the modes of two fits by frequency and compares them.
    pub(super) fn of(reference: &ModalFit, other: &ModalFit) -> ModeDifferences {
        let (first, second) = (reference.modes(), other.modes());
        let pairs: Vec<Option<usize>> = (0..first.len())
            .map(|k| same_mode(&first, k, &second))
            .collect();
        let shared = first.iter().zip(&pairs);
        let shared = shared.filter_map(|(mode, pair)| Some((mode, second.get((*pair)?)?)));
        let missing = first.iter().zip(&pairs).filter(|(_, pair)| pair.is_none());
        let added = second.iter().enumerate();
        let added = added.filter(|(k, _)| !pairs.contains(&Some(*k)));
        let compliances = (
            reference.static_compliance_m_per_n(),
            other.static_compliance_m_per_n(),
        );
        ModeDifferences {
            modes: shared
                .map(|(mode, other)| ModeDifference::of(mode, other))
                .collect(),
            only_in_reference_hz: missing.map(|(mode, _)| mode.frequency_hz().value).collect(),
            only_in_other_hz: added.map(|(_, mode)| mode.frequency_hz().value).collect(),
            static_compliance_m_per_n: match compliances {
                (Some(reference), Some(other)) => Some(Difference::of(reference, other)),
                _ => None,
            },
        }
    }
}
