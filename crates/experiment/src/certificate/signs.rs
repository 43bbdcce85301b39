//! The signs of measured residues beside those of a model.
//!
//! The signs of the residues decide how fast a controller may be (thesis, section 6.2): with other signs than those of the model,
//! the margins of the model do not apply.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use bench_identify::modal::FittedMode;
use bench_plant::{ModalModel, Sign};

/// Modes above this multiple of the highest mode of the model are not compared.
const HIGHEST: f64 = 1.2;

/// What other signs than those of the model mean.
pub const SIGNS_DIFFER: &str = "The margins of the model do not apply to this stage: a loop that is stable by the model can be \
    unstable. Correct the model (plant.mass_asymmetry, plant.operating_point_m) before a loop is closed, and choose a controller \
    for these signs.";

/// Result of the comparison of signs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SignAgreement {
    /// All signs are equal.
    Agree,
    /// A sign differs with 95 % confidence.
    Differ,
    /// A mode of the model was not found, or the sign of its residue is not certain; no known sign differs.
    Incomplete,
}

/// Signs of the residues of the modes that the model has in the measured band, lowest frequency first.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SignCheck {
    /// Measured; `?` for a sign that is not certain.
    pub measured: String,
    /// By the model.
    pub model: String,
    /// Whether they agree.
    pub agreement: SignAgreement,
}

impl SignCheck {
    /// Compares measured modes with the modes of a model in a band. Each mode of the model belongs to one measured mode: in
    /// rising order, with the smallest sum of |ln(f measured / f model)|. A sign is certain if the 95 % interval of the residue does
    /// not contain zero.
    pub fn of(measured: &[FittedMode], model: &ModalModel, band_hz: (f64, f64)) -> SignCheck {
        let expected = visible(model, band_hz);
        let limit_hz = HIGHEST * expected.last().map_or(0.0, |(hz, _)| *hz);
        let found: Vec<(f64, char)> = measured
            .iter()
            .map(|mode| (mode.frequency_hz().value, mode.certain_sign()))
            .filter(|(hz, _)| *hz > 0.0 && *hz <= limit_hz)
            .collect();
        let pairs = matched(&frequencies(&expected), &frequencies(&found));
        let signs: String = match &pairs {
            Some(pairs) => pairs.iter().map(|k| found[*k].1).collect(),
            None => found.iter().map(|(_, sign)| *sign).collect(),
        };
        let model: String = expected.iter().map(|(_, sign)| *sign).collect();
        SignCheck {
            agreement: agreement(pairs.is_some(), &signs, &model),
            measured: signs,
            model,
        }
    }

    /// Whether a sign differs.
    pub fn differ(&self) -> bool {
        self.agreement == SignAgreement::Differ
    }
}

fn agreement(is_matched: bool, measured: &str, model: &str) -> SignAgreement {
    let pairs = || measured.chars().zip(model.chars());
    if !is_matched {
        SignAgreement::Incomplete
    } else if pairs().any(|(a, b)| a != '?' && a != b) {
        SignAgreement::Differ
    } else if measured.contains('?') {
        SignAgreement::Incomplete
    } else {
        SignAgreement::Agree
    }
}

/// Frequency in hertz and sign of the modes of a model in a band that a measurement shows.
fn visible(model: &ModalModel, (from_hz, to_hz): (f64, f64)) -> Vec<(f64, char)> {
    let modes = model.modes.iter().zip(model.signs());
    modes
        .filter(|(_, sign)| *sign != Sign::Hidden)
        .map(|(mode, sign)| (mode.omega_rad_s / TAU, sign.symbol()))
        .filter(|(hz, _)| *hz > 0.0 && (from_hz..=to_hz).contains(hz))
        .collect()
}

fn frequencies(modes: &[(f64, char)]) -> Vec<f64> {
    modes.iter().map(|(hz, _)| *hz).collect()
}

/// The index of a found frequency for each expected one, both rising; `None` if there are too few. Dynamic programming: `best[i]` is
/// the cheapest assignment of the first `i` expected frequencies to the found ones so far.
fn matched(expected_hz: &[f64], found_hz: &[f64]) -> Option<Vec<usize>> {
    let mut best: Vec<Option<(f64, Vec<usize>)>> = vec![None; expected_hz.len() + 1];
    best[0] = Some((0.0, Vec::new()));
    for (k, found) in found_hz.iter().enumerate() {
        for i in (0..expected_hz.len()).rev() {
            let Some((cost, chosen)) = &best[i] else {
                continue;
            };
            let cost = cost + (found / expected_hz[i]).ln().abs();
            if best[i + 1].as_ref().is_none_or(|(other, _)| cost < *other) {
                let chosen = chosen.iter().copied().chain([k]).collect();
                best[i + 1] = Some((cost, chosen));
            }
        }
    }
    best.pop().flatten().map(|(_, chosen)| chosen)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_expected_mode_belongs_to_the_nearest_one_in_rising_order() {
        assert_eq!(
            matched(&[10.0, 80.0], &[10.1, 50.0, 81.0]),
            Some(vec![0, 2])
        );
        assert_eq!(
            matched(&[80.0, 82.0], &[80.5, 81.0, 300.0]),
            Some(vec![0, 1])
        );
        assert_eq!(matched(&[80.0, 82.0], &[81.0]), None);
        assert_eq!(matched(&[], &[81.0]), Some(vec![]));
    }

    #[test]
    fn an_uncertain_sign_neither_agrees_nor_differs() {
        use SignAgreement::{Agree, Differ, Incomplete};
        assert_eq!(agreement(true, "+-+", "+-+"), Agree);
        assert_eq!(agreement(true, "++-", "+-+"), Differ);
        assert_eq!(agreement(true, "+?+", "+-+"), Incomplete);
        assert_eq!(agreement(true, "?+-", "+-+"), Differ);
        assert_eq!(agreement(false, "+-", "+-+"), Incomplete);
    }
}
