//! Which asymmetry to put on.
//!
//! Its distance to the border, in tolerances: over all operating points of the range (and somewhat beyond) with a band of
//! asymmetries that has CNMP zeros,
//!
//! ```text
//!  distance = min of sqrt((dD/tolerance of D)^2 + (dY/tolerance of Y)^2)
//! ```
//!
//! dD from the asymmetries that the stage may have (as put on, plus the interval of the offset) to the band, 0 where they meet;
//! dY from the operating range to that operating point, 0 within. Nothing inside of a band is recommended: at the distance of
//! 0 some operating point has CNMP zeros. Recommended is the asymmetry with the greatest distance, of equals the smallest.

use serde::Serialize;

use super::{Region, Said};

/// How exactly a person sets both.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tolerances {
    /// Of the asymmetry, a ratio.
    pub asymmetry: f64,
    /// Of the operating point, a ratio of L.
    pub operating_point: f64,
}

/// The asymmetry to put on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Recommendation {
    /// As intended: the offset comes on top.
    pub asymmetry: f64,
    /// Distance to the nearest point with CNMP zeros, in tolerances; `null` where there is none in reach.
    pub distance_tolerances: Option<f64>,
    /// That point: operating point (Y1o/L) and intended asymmetry at which the model, with the offset, begins to have them.
    pub nearest: Option<[f64; 2]>,
    /// Whether it is the first or the last asymmetry that was tried: farther out may be better still.
    pub at_the_end: bool,
}

/// The best of `candidates` (intended asymmetries, rising) for the operating points from `range[0]` to `range[1]` (Y1o/L),
/// `offset` being the interval of what the stage has beside. Those within a tolerance of a detection are out. None where no
/// candidate is free of CNMP zeros over the whole range.
pub fn recommend(
    region: &Region,
    range: [f64; 2],
    candidates: &[f64],
    offset: [f64; 2],
    tolerances: Tolerances,
    said: &[Said],
) -> Option<Recommendation> {
    let (first, last) = (candidates.first()?, candidates.last()?);
    let seen = |asymmetry: f64| {
        said.iter()
            .any(|one| one.detected && (one.asymmetry - asymmetry).abs() <= tolerances.asymmetry)
    };
    let judged = |&asymmetry: &f64| {
        let near = nearest(
            region,
            range,
            [asymmetry + offset[0], asymmetry + offset[1]],
            tolerances,
        );
        let free = near.is_none_or(|near| near.distance > 0.0) && !seen(asymmetry);
        free.then_some(Recommendation {
            asymmetry,
            distance_tolerances: near.map(|near| near.distance),
            nearest: near.map(|near| {
                [
                    near.operating_point,
                    near.asymmetry - (near.end - asymmetry),
                ]
            }),
            at_the_end: asymmetry == *first || asymmetry == *last,
        })
    };
    let distance = |one: &Recommendation| one.distance_tolerances.unwrap_or(f64::INFINITY);
    let better = |a: &Recommendation, b: &Recommendation| {
        distance(a)
            .total_cmp(&distance(b))
            .then(b.asymmetry.abs().total_cmp(&a.asymmetry.abs()))
    };
    candidates.iter().filter_map(judged).max_by(better)
}

/// The nearest point of the region.
#[derive(Clone, Copy)]
struct Near {
    distance: f64,
    operating_point: f64,
    asymmetry: f64,
    /// The asymmetry of those that the stage may have which is nearest to it.
    end: f64,
}

fn nearest(
    region: &Region,
    range: [f64; 2],
    stage: [f64; 2],
    tolerances: Tolerances,
) -> Option<Near> {
    let of_row = |(row, &operating_point): (usize, &f64)| {
        let away = (range[0] - operating_point)
            .max(operating_point - range[1])
            .max(0.0);
        region.bands[row].iter().map(move |band| {
            let (gap, asymmetry, end) = gap(stage, *band);
            let distance = libm::hypot(
                gap / tolerances.asymmetry,
                away / tolerances.operating_point,
            );
            Near {
                distance,
                operating_point,
                asymmetry,
                end,
            }
        })
    };
    let all = region.operating_points.iter().enumerate().flat_map(of_row);
    all.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// Distance between two intervals, the second one's end there, and the first one's.
fn gap([low, high]: [f64; 2], [from, to]: [f64; 2]) -> (f64, f64, f64) {
    if high < from {
        (from - high, from, high)
    } else if low > to {
        (low - to, to, low)
    } else {
        (0.0, low.max(from), low.max(from))
    }
}
