//! The choice of two modes.

use super::{Loci, Meeting};
use bench_plant::{PlantError, Structure};

/// The reason why there is no pair of close modes, or no veering point, with the remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct PairError(String);

const TOO_FEW: &str = "fewer than two modes of this plant have a frequency above zero, so there is no pair to follow; choose another plant";
const NO_MEETING: &str =
    "no two modes veer or cross inside the range; move --from or --to, or vary another setting";

/// Indices of two modes, from 0: those with the numbers `asked`, from 1, or the closest pair.
pub fn close_pair<E, F>(asked: &[usize], loci: &Loci<F>) -> Result<[usize; 2], PairError>
where
    E: From<PlantError>,
    F: FnMut(f64) -> Result<Structure, E>,
{
    let modes = 1..=loci.path()[0].omega_rad_s.len();
    match asked {
        [] => loci.closest_pair().ok_or_else(|| PairError(TOO_FEW.into())),
        [i, j] if i != j && modes.contains(i) && modes.contains(j) => {
            Ok([i.min(j) - 1, i.max(j) - 1])
        }
        _ => Err(PairError(format!(
            "--modes {asked:?} is not a pair of modes; give two different modes, I,J, from 1 to {}",
            modes.end()
        ))),
    }
}

/// The two requested modes, or the first pair that meets inside the range.
pub fn meeting_pair<E, F>(asked: &[usize], loci: &Loci<F>) -> Result<[usize; 2], PairError>
where
    E: From<PlantError>,
    F: FnMut(f64) -> Result<Structure, E>,
{
    if !asked.is_empty() || loci.path()[0].omega_rad_s.len() < 2 {
        return close_pair(asked, loci);
    }
    let pairs = loci.meeting_pairs();
    let pair = pairs.first().copied();
    pair.ok_or_else(|| PairError(NO_MEETING.into()))
}

/// Refuses a range without a veering point.
pub fn require_meeting(meeting: Meeting, value: f64, [i, j]: [usize; 2]) -> Result<(), PairError> {
    if meeting != Meeting::AtTheEnd {
        return Ok(());
    }
    Err(PairError(format!(
        "modes {} and {} neither veer nor cross in the range: they are closest at its end, {value}; move --from or --to beyond it, or name two others with --modes",
        i + 1,
        j + 1
    )))
}
