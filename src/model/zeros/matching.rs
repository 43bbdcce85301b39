//! Which point of one sample goes on as which of the next: by distance on Riemann's sphere, so that one may pass through
//! infinity.

use nalgebra::Complex;

/// A point of the plane; `None` at infinity.
pub(super) type Point = Option<Complex<f64>>;

/// `points`, with as many at infinity as make `count`.
pub(super) fn padded(points: &[Complex<f64>], count: usize) -> Vec<Point> {
    let mut padded: Vec<Point> = points.iter().copied().map(Some).collect();
    padded.resize(count.max(points.len()), None);
    padded
}

/// Distance on the sphere over which `scale` is the equator: 0 to 1.
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
    let mut pairs: Vec<(f64, usize, usize)> = (0..from.len())
        .flat_map(|i| (0..to.len()).map(move |j| (i, j)))
        .map(|(i, j)| (distance(from[i], to[j], scale), i, j))
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut partner, mut taken) = (vec![None; from.len()], vec![false; to.len()]);
    for (_, i, j) in pairs {
        if partner[i].is_none() && !taken[j] {
            partner[i] = Some(to[j]);
            taken[j] = true;
        }
    }
    partner.into_iter().map(Option::flatten).collect()
}

/// Whether nobody moved further than 0.4 of the way to his nearest neighbour; zeros on top of each other have none.
pub(super) fn is_clear(from: &[Point], moved: &[Point], scale: f64) -> bool {
    let together = 1e-6;
    let step = |i: usize| distance(from[i], moved[i], scale);
    let neighbour = |i: usize| {
        let others = (0..from.len())
            .filter(|j| *j != i)
            .map(|j| distance(from[i], from[j], scale));
        others
            .filter(|d| *d > together)
            .fold(f64::INFINITY, f64::min)
    };
    (0..from.len()).all(|i| step(i) <= 0.4 * neighbour(i))
}
