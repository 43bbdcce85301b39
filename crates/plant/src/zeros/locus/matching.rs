//! Assignment of the points of one sample to those of the next, by distance on Riemann's sphere, so that a point may pass
//! through infinity.

use nalgebra::Complex;

use bench_base::numeric::assign;

/// A point of the plane; `None` at infinity.
pub(super) type Point = Option<Complex<f64>>;

/// Points closer than this count as one.
const COINCIDENT: f64 = 1e-6;
/// An assignment is clear if no point moved further than this ratio of the distance to its nearest neighbour.
const CLEAR_RATIO: f64 = 0.4;

/// `points`, filled up to `count` with points at infinity.
pub(super) fn padded(points: &[Complex<f64>], count: usize) -> Vec<Point> {
    let mut padded: Vec<Point> = points.iter().copied().map(Some).collect();
    padded.resize(count.max(points.len()), None);
    padded
}

/// Distance on the sphere whose equator is `scale`: 0 to 1.
fn distance(a: Point, b: Point, scale: f64) -> f64 {
    let height = |z: Complex<f64>| (1.0 + (z / scale).norm_sqr()).sqrt();
    match (a, b) {
        (None, None) => 0.0,
        (Some(z), None) | (None, Some(z)) => 1.0 / height(z),
        (Some(a), Some(b)) => ((a - b) / scale).norm() / (height(a) * height(b)),
    }
}

/// For each of `from` its partner in `to`: the nearest pairs first.
pub(super) fn assigned(from: &[Point], to: &[Point], scale: f64) -> Vec<Point> {
    let partners = assign(from.len(), to.len(), |i, j| distance(from[i], to[j], scale));
    partners
        .into_iter()
        .map(|partner| partner.and_then(|j| to[j]))
        .collect()
}

/// Whether all points stayed well within the distance to their neighbours. Coincident points are not neighbours.
pub(super) fn is_clear(from: &[Point], moved: &[Point], scale: f64) -> bool {
    (0..from.len()).all(|i| {
        let step = distance(from[i], moved[i], scale);
        step <= CLEAR_RATIO * neighbour_distance(from, i, scale)
    })
}

fn neighbour_distance(points: &[Point], i: usize, scale: f64) -> f64 {
    let others = (0..points.len()).filter(|j| *j != i);
    others
        .map(|j| distance(points[i], points[j], scale))
        .filter(|d| *d > COINCIDENT)
        .fold(f64::INFINITY, f64::min)
}
