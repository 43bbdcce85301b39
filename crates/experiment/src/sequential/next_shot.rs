//! Band and length of the next shot.

use super::information::InformationByFrequency;
use super::shot::Shot;
use bench_identify::verdict::DecisiveQuantity;

/// Lengths of a shot as multiples of that of the first one.
const LENGTHS: [f64; 10] = [0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6];
/// The predicted certainty is this multiple of the required one: values and their noise differ from those of the fit.
const RESERVE: f64 = 1.25;
/// Smallest product of length and bandwidth of a sweep: below it, much of its energy lies outside its band.
const MIN_TIME_BANDWIDTH: f64 = 10.0;

/// What the information by frequency recommends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NextShot {
    /// The shortest shot that is predicted to decide, or the best one of the greatest length.
    Take(Shot),
    /// Even several of the longest shots are not predicted to decide: the necessary motion in seconds.
    Needs(f64),
}

/// A band with its predicted certainty over the required one.
struct Candidate {
    shot: Shot,
    certainty: f64,
}

/// Plans the next shot; `None` if nothing can be predicted. `left_s` is the motion that is still allowed, and `unit_s` the length of
/// the first shot.
pub(super) fn next_shot(
    information: &InformationByFrequency,
    quantities: &[DecisiveQuantity],
    unit_s: f64,
    left_s: f64,
) -> Option<NextShot> {
    let lengths = LENGTHS.map(|length| length * unit_s).into_iter();
    let mut best: Option<Candidate> = None;
    for duration_s in lengths.filter(|duration_s| *duration_s <= left_s) {
        let candidate = best_band(information, quantities, duration_s);
        best = candidate.or(best);
        let decides = best.as_ref().is_some_and(|best| best.certainty >= RESERVE);
        if decides {
            break;
        }
    }
    let best = best?;
    // The certainty grows with the square root of the time.
    let needs_s = best.shot.duration_s * (RESERVE / best.certainty).powi(2);
    Some(if needs_s <= left_s {
        NextShot::Take(best.shot)
    } else {
        NextShot::Needs(needs_s)
    })
}

/// The band with the greatest predicted certainty for a length.
fn best_band(
    information: &InformationByFrequency,
    quantities: &[DecisiveQuantity],
    duration_s: f64,
) -> Option<Candidate> {
    let candidates = information.bands().filter_map(|band| {
        let shot = information.shot(band, duration_s);
        let is_narrow = (shot.high_hz - shot.low_hz) * duration_s < MIN_TIME_BANDWIDTH;
        if is_narrow {
            return None;
        }
        let covariance = information.covariance_after(band, duration_s)?;
        let certainties = quantities.iter().map(|quantity| {
            let sigma = information.sigma(&covariance, &quantity.gradient);
            quantity.value.abs() / (quantity.quantile * sigma)
        });
        let certainty = certainties.fold(f64::INFINITY, f64::min);
        Some(Candidate { shot, certainty }).filter(|candidate| candidate.certainty.is_normal())
    });
    candidates.max_by(|a, b| a.certainty.total_cmp(&b.certainty))
}
