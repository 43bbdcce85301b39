//! The recommended asymmetry.
//!
//! The distance of an asymmetry from CNMP zeros, in tolerances, is the smallest over all operating points that have a band of
//! asymmetries with CNMP zeros, in the operating range and near it:
//!
//! ```text
//!  distance = min of sqrt((dD/tolerance of D)^2 + (dY/tolerance of Y)^2)
//! ```
//!
//! dD is the distance from the asymmetries that the stage may have (as intended, plus the interval of the offset) to the band,
//! 0 if they overlap; dY is the distance from the operating range to that operating point, 0 within. An asymmetry at the distance
//! 0 has CNMP zeros at some operating point and is not recommended. The recommended asymmetry has the largest distance; of equal
//! ones it is the smallest.

use std::cmp::Ordering;

use serde::Serialize;

use super::offset::Judgement;
use super::region::Region;

/// How exactly the operator can set asymmetry and operating point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tolerances {
    /// Tolerance of the asymmetry, a ratio.
    pub asymmetry: f64,
    /// Tolerance of the operating point, a ratio of L.
    pub operating_point: f64,
}

/// The recommended asymmetry.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Recommendation {
    /// As intended, without the offset.
    pub asymmetry: f64,
    /// Distance to the nearest point with CNMP zeros, in tolerances; `null` if there is none in the searched range.
    pub distance_tolerances: Option<f64>,
    /// That point: operating point (Y1o/L) and intended asymmetry, at the border of the region of the model with the offset.
    pub nearest: Option<[f64; 2]>,
    /// Whether it is the first or the last candidate: a larger one may be better.
    pub at_the_end: bool,
}

/// The best of `candidates` (intended asymmetries, rising) for the operating points from `range[0]` to `range[1]` (Y1o/L), with
/// the interval `offset` of the initial asymmetry. A candidate within a tolerance of a detection is excluded. `None` if every
/// candidate has CNMP zeros somewhere in the range or is excluded.
pub fn recommend(
    region: &Region,
    range: [f64; 2],
    candidates: &[f64],
    offset: [f64; 2],
    tolerances: Tolerances,
    judgements: &[Judgement],
) -> Option<Recommendation> {
    let ends = [*candidates.first()?, *candidates.last()?];
    let free = candidates.iter().filter_map(|&asymmetry| {
        let stage = offset.map(|offset| asymmetry + offset);
        let nearest = nearest(region, range, stage, tolerances);
        let has_zeros = nearest.is_some_and(|nearest| nearest.distance <= 0.0);
        let is_excluded = has_zeros || is_near_detection(judgements, asymmetry, tolerances);
        (!is_excluded).then(|| recommendation(asymmetry, nearest, ends))
    });
    free.max_by(compare)
}

/// Whether CNMP zeros were detected within a tolerance of an asymmetry.
fn is_near_detection(judgements: &[Judgement], asymmetry: f64, tolerances: Tolerances) -> bool {
    let mut detections = judgements.iter().filter(|one| one.detected);
    detections.any(|one| (one.asymmetry - asymmetry).abs() <= tolerances.asymmetry)
}

/// Orders recommendations: a larger distance is better; at equal distance, the smaller |asymmetry|.
fn compare(a: &Recommendation, b: &Recommendation) -> Ordering {
    let distance = |one: &Recommendation| one.distance_tolerances.unwrap_or(f64::INFINITY);
    let by_distance = distance(a).total_cmp(&distance(b));
    by_distance.then(b.asymmetry.abs().total_cmp(&a.asymmetry.abs()))
}

fn recommendation(asymmetry: f64, nearest: Option<Nearest>, ends: [f64; 2]) -> Recommendation {
    Recommendation {
        asymmetry,
        distance_tolerances: nearest.map(|near| near.distance),
        nearest: nearest.map(|near| {
            let border = near.asymmetry - (near.end - asymmetry);
            [near.operating_point, border]
        }),
        at_the_end: ends.contains(&asymmetry),
    }
}

/// The nearest point of the region.
#[derive(Clone, Copy)]
struct Nearest {
    distance: f64,
    operating_point: f64,
    asymmetry: f64,
    /// The asymmetry of the stage that is nearest to it.
    end: f64,
}

fn nearest(
    region: &Region,
    range: [f64; 2],
    stage: [f64; 2],
    tolerances: Tolerances,
) -> Option<Nearest> {
    let rows = region.operating_points.iter().zip(&region.bands);
    let points = rows.flat_map(|(&operating_point, bands)| {
        let outside = (range[0] - operating_point).max(operating_point - range[1]);
        let away = outside.max(0.0) / tolerances.operating_point;
        bands.iter().map(move |band| {
            let (gap, asymmetry, end) = gap(stage, *band);
            Nearest {
                distance: libm::hypot(gap / tolerances.asymmetry, away),
                operating_point,
                asymmetry,
                end,
            }
        })
    });
    points.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// Distance between two intervals, and the ends that are nearest to each other: that of the second interval, then that of the
/// first.
fn gap([low, high]: [f64; 2], [from, to]: [f64; 2]) -> (f64, f64, f64) {
    if high < from {
        (from - high, from, high)
    } else if low > to {
        (low - to, to, low)
    } else {
        (0.0, low.max(from), low.max(from))
    }
}
