//! Samples of the zeros, followed from value to value and bisected where their kinds change.

use super::census::{LocusPlane, Sample};
use super::changes::{KindChange, change};
use super::matching::{Point, assigned, is_clear, padded};
use crate::zeros::kinds::{Zero, is_real};

/// Halvings of a grid step until the assignment is clear.
const DEPTH: u32 = 12;
/// Steps of the golden section.
const GOLDEN_STEPS: usize = 48;
/// A quantity may vanish between samples if its extremum there is below this ratio of the middle sample.
const VANISHING_RATIO: f64 = 0.67;

pub(super) struct Follower<F> {
    plane: LocusPlane,
    zeros: F,
    /// Number of samples between those of the grid that may still be computed to follow tracks.
    left: usize,
}

impl<E, F: FnMut(f64) -> Result<Vec<Zero>, E>> Follower<F> {
    pub fn new(plane: LocusPlane, zeros: F, values: usize) -> Follower<F> {
        Follower {
            plane,
            zeros,
            left: 40 * values + 2000,
        }
    }

    pub fn sample(&mut self, value: f64) -> Result<Sample, E> {
        let zeros = (self.zeros)(value)?;
        Ok(Sample {
            value,
            points: self.plane.points(&zeros),
            census: self.plane.census(&zeros),
        })
    }

    /// One list of points for each zero.
    pub fn tracks(&mut self, samples: &[Sample]) -> Result<Vec<Vec<Point>>, E> {
        let Some(first) = samples.first() else {
            return Ok(Vec::new());
        };
        let counts = samples.iter().map(|sample| sample.points.len());
        let mut now = padded(&first.points, counts.max().unwrap_or(0));
        let mut tracks: Vec<Vec<Point>> = now.iter().map(|point| vec![*point]).collect();
        let scale = median_magnitude(samples);
        for pair in samples.windows(2) {
            now = self.moved(&now, pair[0].value, &pair[1], scale, DEPTH)?;
            for (track, point) in tracks.iter_mut().zip(&now) {
                track.push(*point);
            }
        }
        Ok(tracks)
    }

    /// For each of the points `from` at the value `at`, the point of the sample `to` that continues it.
    fn moved(
        &mut self,
        from: &[Point],
        at: f64,
        to: &Sample,
        scale: f64,
        depth: u32,
    ) -> Result<Vec<Point>, E> {
        let there = padded(&to.points, from.len());
        let moved = assigned(from, &there, scale);
        if depth == 0 || self.left == 0 || is_clear(from, &moved, scale) {
            return Ok(moved);
        }
        self.left -= 1;
        let middle = self.sample(0.5 * (at + to.value))?;
        let half = self.moved(from, at, &middle, scale, depth - 1)?;
        self.moved(&half, middle.value, to, scale, depth - 1)
    }

    /// All changes of kind, by rising value.
    pub fn all_changes(
        &mut self,
        samples: &[Sample],
        tracks: &[Vec<Point>],
    ) -> Result<Vec<KindChange>, E> {
        let mut found = Vec::new();
        for pair in samples.windows(2) {
            self.changes(&pair[0], &pair[1], &mut found)?;
        }
        for (index, triple) in samples.windows(3).enumerate() {
            let near = approaching(tracks, index);
            self.hidden_changes(triple, &near, &mut found)?;
        }
        found.sort_by(|a, b| a.value.total_cmp(&b.value));
        Ok(found)
    }

    /// The changes of kind between two samples, as far as the kinds at both differ.
    fn changes(
        &mut self,
        from: &Sample,
        to: &Sample,
        found: &mut Vec<KindChange>,
    ) -> Result<(), E> {
        let mut from = from.clone();
        // Each change alters one pair or quartet: there are no more changes between two samples than zeros.
        for _ in 0..=2 * to.points.len() {
            if from.census == to.census {
                break;
            }
            let (low, high) = self.bisected(from, to.clone())?;
            found.push(change(self.plane, &low, &high));
            from = high;
        }
        Ok(())
    }

    /// The two nearest values with the kinds of `low`, and with others.
    fn bisected(&mut self, mut low: Sample, mut high: Sample) -> Result<(Sample, Sample), E> {
        loop {
            let middle = 0.5 * (low.value + high.value);
            let width = (high.value - low.value).abs();
            let size = low.value.abs().max(high.value.abs());
            if width <= 4.0 * f64::EPSILON * size || middle == low.value {
                return Ok((low, high));
            }
            let sample = self.sample(middle)?;
            if sample.census == low.census {
                low = sample;
            } else {
                high = sample;
            }
        }
    }

    /// Changes to other kinds and back between three samples of the same kinds, where a pair of points is `near`.
    fn hidden_changes(
        &mut self,
        triple: &[Sample],
        near: &[[Point; 2]],
        found: &mut Vec<KindChange>,
    ) -> Result<(), E> {
        let [a, b, c] = triple else { return Ok(()) };
        if a.census != b.census || b.census != c.census {
            return Ok(());
        }
        for pair in near {
            if let Some(other) = self.nearest_approach(triple, *pair)? {
                self.changes(a, &other, found)?;
                self.changes(&other, c, found)?;
            }
        }
        Ok(())
    }

    /// Searches the least distance of two zeros by golden section. Returns a sample of other kinds if it meets one.
    fn nearest_approach(
        &mut self,
        triple: &[Sample],
        pair: [Point; 2],
    ) -> Result<Option<Sample>, E> {
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        let (mut low, mut high) = (triple[0].value, triple[2].value);
        for _ in 0..GOLDEN_STEPS {
            let span = golden * (high - low);
            let (left, right) = (self.sample(high - span)?, self.sample(low + span)?);
            for sample in [&left, &right] {
                if sample.census != triple[1].census {
                    return Ok(Some(sample.clone()));
                }
            }
            if gap(&left, pair) < gap(&right, pair) {
                high = right.value;
            } else {
                low = left.value;
            }
        }
        Ok(None)
    }
}

/// The pairs of tracks that may meet between the three samples from `index` on: their points in the middle sample.
fn approaching(tracks: &[Vec<Point>], index: usize) -> Vec<[Point; 2]> {
    let mut pairs = Vec::new();
    for (i, first) in tracks.iter().enumerate() {
        for second in &tracks[i + 1..] {
            if may_meet(&first[index..index + 3], &second[index..index + 3]) {
                pairs.push([first[index + 1], second[index + 1]]);
            }
        }
    }
    pairs
}

fn median_magnitude(samples: &[Sample]) -> f64 {
    let points = samples.iter().flat_map(|sample| &sample.points);
    let mut sizes: Vec<f64> = points.map(|point| point.norm()).collect();
    sizes.sort_by(f64::total_cmp);
    let median = sizes.get(sizes.len() / 2).copied();
    median.filter(|size| *size > 0.0).unwrap_or(1.0)
}

/// Distance between the continuations of two points in a sample; infinite where they cannot meet.
fn gap(sample: &Sample, pair: [Point; 2]) -> f64 {
    let places = assigned(&pair, &padded(&sample.points, sample.points.len()), 1.0);
    signed_gap(places[0], places[1]).map_or(f64::INFINITY, f64::abs)
}

/// (a - b)^2 in units of the mean square: above 0 for two on the real axis, below for a conjugate pair; `None` for others.
fn signed_gap(a: Point, b: Point) -> Option<f64> {
    let (a, b) = (a?, b?);
    let difference = (a - b) * (a - b) / (0.5 * (a.norm_sqr() + b.norm_sqr()));
    let are_real = is_real(a) && is_real(b);
    let are_conjugate = (a - b.conj()).norm() <= 1e-6 * a.norm();
    ((are_real || are_conjugate) && difference.re.is_finite()).then_some(difference.re)
}

/// Whether two tracks may meet between three samples: the gap has an extremum towards zero, and the parabola through the
/// three reaches zero or falls below two thirds of the middle.
fn may_meet(first: &[Point], second: &[Point]) -> bool {
    let gap = |k: usize| signed_gap(first[k], second[k]);
    let (Some(a), Some(b), Some(c)) = (gap(0), gap(1), gap(2)) else {
        return false;
    };
    let is_least = b.abs() <= a.abs() && b.abs() <= c.abs() && a * b > 0.0 && b * c > 0.0;
    let (slope, bend) = (0.5 * (c - a), 0.5 * (a + c) - b);
    let extremum = if bend == 0.0 {
        b
    } else {
        b - 0.25 * slope * slope / bend
    };
    is_least && extremum / b < VANISHING_RATIO
}
