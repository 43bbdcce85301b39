//! The fit of the modes of a response, and modes that it cannot determine separately.
//!
//! Of modes that are closer than their widths only certain sums are well determined. A fit can then have two modes of nearly equal
//! frequency with large residues of opposite signs. Their sum describes the response, so that the design uses it as one group; a fit of
//! other data of the same response often has no such modes, and is preferred.

use super::source::{FrfSource, independent};
use bench_identify::FrfDatum;
use bench_identify::modal::{self, FitError, FittedMode, MeasurementChain, ModalFit};

/// A residue with a larger relative standard deviation, of a mode that is closer to another one than their widths, is not determined.
const UNRESOLVED: f64 = 0.3;

/// A selection of the data of a source.
#[derive(Clone, Copy)]
enum Selection {
    /// Every second datum, beginning with this one.
    EverySecond(usize),
    /// The independent points of the FRF.
    Points,
}

/// The selections that are tried after all data, in this order.
const OTHERS: [Selection; 3] = [
    Selection::EverySecond(0),
    Selection::EverySecond(1),
    Selection::Points,
];

impl Selection {
    fn of(self, source: &FrfSource) -> Vec<FrfDatum> {
        match self {
            Selection::EverySecond(first) => {
                let data = source.measured.frf.data.iter();
                data.skip(first).step_by(2).copied().collect()
            }
            Selection::Points => independent(&source.measured.frf),
        }
    }
}

/// The fit with the fewest modes that are not determined: of all data, else of every second one, else of the points of the FRF.
///
/// # Errors
/// That of the fit of all data, if none succeeds.
pub(super) fn best_fit(source: &FrfSource, chain: &MeasurementChain) -> Result<ModalFit, FitError> {
    let mut best = modal::fit(&source.measured.frf.data, chain);
    for selection in OTHERS {
        if best.as_ref().is_ok_and(|fit| unresolved(fit) == 0) {
            break;
        }
        best = better(best, modal::fit(&selection.of(source), chain));
    }
    best
}

/// The fit with fewer modes that are not determined; the first one if both fail.
fn better(
    first: Result<ModalFit, FitError>,
    second: Result<ModalFit, FitError>,
) -> Result<ModalFit, FitError> {
    match (&first, &second) {
        (Ok(a), Ok(b)) if unresolved(b) < unresolved(a) => second,
        (Err(_), Ok(_)) => second,
        _ => first,
    }
}

/// Number of modes that are not determined.
fn unresolved(fit: &ModalFit) -> usize {
    let groups = groups(&fit.modes());
    groups
        .iter()
        .filter(|group| group.len() > 1)
        .map(Vec::len)
        .sum()
}

/// The modes, each alone in its group; modes that are not determined are in one with those that are closer than their widths.
pub(super) fn groups(modes: &[FittedMode]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for k in 0..modes.len() {
        match groups.last_mut() {
            Some(group) if k > 0 && are_close(&modes[k - 1], &modes[k]) => group.push(k),
            _ => groups.push(vec![k]),
        }
    }
    let determined = |group: &Vec<usize>| group.iter().all(|k| is_determined(&modes[*k]));
    let split = groups.into_iter().flat_map(|group| {
        if determined(&group) {
            group.into_iter().map(|k| vec![k]).collect()
        } else {
            vec![group]
        }
    });
    split.collect()
}

/// Whether two modes are closer than the sum of half their widths.
fn are_close(a: &FittedMode, b: &FittedMode) -> bool {
    let half = |mode: &FittedMode| mode.damping_ratio.value * mode.omega_rad_s.value;
    (a.omega_rad_s.value - b.omega_rad_s.value).abs() < half(a) + half(b)
}

fn is_determined(mode: &FittedMode) -> bool {
    mode.residue_per_kg.sigma < UNRESOLVED * mode.residue_per_kg.value.abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_identify::Estimate;

    fn mode(omega_rad_s: f64, residue: f64, sigma: f64) -> FittedMode {
        let exact = |value| Estimate { value, sigma: 0.0 };
        FittedMode {
            omega_rad_s: exact(omega_rad_s),
            damping_ratio: exact(0.005),
            residue_per_kg: Estimate {
                value: residue,
                sigma,
            },
            residue_imaginary_per_kg: None,
            turned_by_one_more: 0.0,
        }
    }

    #[test]
    fn modes_within_their_widths_are_one_group_only_if_a_residue_is_not_determined() {
        let first = mode(184.0, 0.47, 1e-6);
        // The half-widths of both are 8.8 rad/s together.
        let known = [first, mode(1766.0, -0.017, 1e-3), mode(1772.0, 0.035, 1e-3)];
        assert_eq!(groups(&known), [vec![0], vec![1], vec![2]]);
        let unknown = [first, mode(1766.0, 3.6, 52.0), mode(1766.1, -3.6, 52.0)];
        assert_eq!(groups(&unknown), [vec![0], vec![1, 2]]);
        // Alone, a weak mode remains a group of its own.
        let weak = [first, mode(1766.0, 0.01, 0.01), mode(1800.0, 0.035, 1e-3)];
        assert_eq!(groups(&weak), [vec![0], vec![1], vec![2]]);
    }
}
