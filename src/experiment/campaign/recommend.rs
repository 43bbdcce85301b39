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

use serde::Serialize;

use super::offset::Judgement;
use super::region::Region;

/// How exactly the operator can set both.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tolerances {
    /// Of the asymmetry, a ratio.
    pub asymmetry: f64,
    /// Of the operating point, a ratio of L.
    pub operating_point: f64,
}

/// The recommended asymmetry.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Recommendation {
    /// As intended, without the offset.
    pub asymmetry: f64,
    /// Distance to the nearest point with CNMP zeros, in tolerances; `null` if there is none in the searched range.
    pub distance_tolerances: Option<f64>,
    /// That point: operating point (Y1o/L) and intended asymmetry at which the model, with the offset, begins to have them.
    pub nearest: Option<[f64; 2]>,
    /// Whether it is the first or the last candidate: a larger one may be better.
    pub at_the_end: bool,
}

/// The best of `candidates` (intended asymmetries, rising) for the operating points from `range[0]` to `range[1]` (Y1o/L), with
/// the interval `offset` of the initial asymmetry. A candidate within a tolerance of a detection is excluded. None if every
/// candidate has CNMP zeros somewhere in the range.
pub fn recommend(
    region: &Region,
    range: [f64; 2],
    candidates: &[f64],
    offset: [f64; 2],
    tolerances: Tolerances,
    judgements: &[Judgement],
) -> Option<Recommendation> {
    let ends = [*candidates.first()?, *candidates.last()?];
    let is_detected = |asymmetry: f64| {
        let near = |one: &Judgement| (one.asymmetry - asymmetry).abs() <= tolerances.asymmetry;
        judgements.iter().any(|one| one.detected && near(one))
    };
    let rated = candidates.iter().filter_map(|&asymmetry| {
        let stage = offset.map(|offset| asymmetry + offset);
        let nearest = nearest(region, range, stage, tolerances);
        let is_free = nearest.is_none_or(|nearest| nearest.distance > 0.0);
        (is_free && !is_detected(asymmetry)).then(|| recommendation(asymmetry, nearest, ends))
    });
    rated.max_by(|a, b| {
        let by_distance = distance(a).total_cmp(&distance(b));
        by_distance.then(b.asymmetry.abs().total_cmp(&a.asymmetry.abs()))
    })
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

fn distance(one: &Recommendation) -> f64 {
    one.distance_tolerances.unwrap_or(f64::INFINITY)
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
    let all = rows.flat_map(|(&operating_point, bands)| {
        let away = (range[0] - operating_point)
            .max(operating_point - range[1])
            .max(0.0);
        bands.iter().map(move |band| {
            let (gap, asymmetry, end) = gap(stage, *band);
            let (gap, away) = (
                gap / tolerances.asymmetry,
                away / tolerances.operating_point,
            );
            Nearest {
                distance: libm::hypot(gap, away),
                operating_point,
                asymmetry,
                end,
            }
        })
    });
    all.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// Distance between two intervals, and the ends that are nearest to each other: of the second one, of the first one.
fn gap([low, high]: [f64; 2], [from, to]: [f64; 2]) -> (f64, f64, f64) {
    if high < from {
        (from - high, from, high)
    } else if low > to {
        (low - to, to, low)
    } else {
        (0.0, low.max(from), low.max(from))
    }
}
