//! Migration of zeros as one number varies: followed by continuity, with the points where their kinds change.
//!
//! Without damping the zeros are followed as u = s^2: real u below 0 are MMP pairs, above 0 RMP-RNMP pairs, complex ones
//! quartets. With damping they are followed as s. Distances are those on Riemann's sphere, so that a zero may pass through
//! infinity. Between two values of the grid the step is halved where it is unclear who moved where; where the kinds differ
//! the change is bisected; where two real zeros come near and part again, the least distance between them is sought, so
//! that a band of complex zeros narrower than the grid is found.

use nalgebra::Complex;

use super::matching::{Point, assigned, is_clear, padded};
use super::{Zero, ZeroCounts, ZeroKind};

/// Which zeros are followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LocusPlane {
    /// Zeros of the undamped plant, by u = s^2: one track a pair, two a quartet.
    Undamped,
    /// Zeros of the damped plant, each by itself.
    Damped,
}

/// How the kinds change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crossing {
    /// Two pairs meet on the imaginary axis, or a damped zero passes through it.
    ImaginaryAxis,
    /// Two zeros meet on the real axis.
    RealAxis,
    /// A pair passes through the origin.
    Origin,
    /// A pair passes through infinity.
    Infinity,
}

impl Crossing {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Crossing::ImaginaryAxis => "imaginary axis",
            Crossing::RealAxis => "real axis",
            Crossing::Origin => "origin",
            Crossing::Infinity => "infinity",
        }
    }
}

/// A value at which the kinds of the zeros change.
#[derive(Clone, Debug, PartialEq)]
pub struct KindChange {
    /// The value, bisected to some 1e-14 of itself.
    pub value: f64,
    /// Where.
    pub crossing: Crossing,
    /// The zero in rad/s, of a conjugate pair the upper one, of mirror images without damping the right one; infinite
    /// where it passes through infinity.
    pub s: Complex<f64>,
    /// The kinds below the value.
    pub before: String,
    /// The kinds above the value.
    pub after: String,
}

/// The zeros over the values of a setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Locus {
    /// The values.
    pub values: Vec<f64>,
    /// Where each zero is at each value; `None` at infinity. Without damping one of each pair s, -s, without a jump: the
    /// zero above the origin on the imaginary axis, of a quartet two that mirror each other.
    pub tracks: Vec<Vec<Option<Complex<f64>>>>,
    /// Where kinds change, in the order of the values.
    pub changes: Vec<KindChange>,
}

impl Locus {
    /// Follows the zeros that `zeros` gives at a value. `values` are two at least, in one order.
    pub fn follow<E>(
        plane: LocusPlane,
        values: &[f64],
        zeros: impl FnMut(f64) -> Result<Vec<Zero>, E>,
    ) -> Result<Locus, E> {
        let mut follower = Follower {
            plane,
            zeros,
            left: 40 * values.len() + 2000,
        };
        let samples = values
            .iter()
            .map(|value| follower.sample(*value))
            .collect::<Result<Vec<_>, E>>()?;
        let tracks = follower.tracks(&samples)?;
        let mut changes = Vec::new();
        for pair in samples.windows(2) {
            follower.changes(&pair[0], &pair[1], &mut changes)?;
        }
        for (index, triple) in samples.windows(3).enumerate() {
            follower.hidden(triple, &tracks, index, &mut changes)?;
        }
        let rising = values.first() <= values.last();
        changes.sort_by(|a, b| {
            if rising {
                a.value.total_cmp(&b.value)
            } else {
                b.value.total_cmp(&a.value)
            }
        });
        let tracks = tracks.iter().map(|track| plane.places(track)).collect();
        Ok(Locus {
            values: values.to_vec(),
            tracks,
            changes,
        })
    }
}

/// Above this ratio of imaginary part to magnitude a zero is off the real axis (two equal real ones come out of the
/// eigenvalue iteration apart by the square root of the rounding, 1.5e-8).
const COMPLEX_RATIO: f64 = 1e-7;

impl LocusPlane {
    fn points(self, zeros: &[Zero]) -> Vec<Complex<f64>> {
        let one_of_a_pair = |zero: &&Zero| match zero.kind {
            ZeroKind::Mmp => zero.s.im > 0.0,
            kind => matches!(kind, ZeroKind::Rnmp | ZeroKind::Cnmp),
        };
        match self {
            LocusPlane::Undamped => zeros.iter().filter(one_of_a_pair).map(square).collect(),
            LocusPlane::Damped => zeros.iter().map(|zero| zero.s).collect(),
        }
    }

    /// The zeros s of a track, each of the two roots that is nearer to the one before, first the right or upper one.
    fn places(self, track: &[Point]) -> Vec<Option<Complex<f64>>> {
        let mut last: Option<Complex<f64>> = None;
        let nearer = |point: &Point| {
            let root = self.root((*point)?);
            let turn = self == LocusPlane::Undamped
                && last.is_some_and(|last| (last + root).norm() < (last - root).norm());
            last = Some(if turn { -root } else { root });
            last
        };
        track.iter().map(nearer).collect()
    }

    fn root(self, point: Complex<f64>) -> Complex<f64> {
        match self {
            LocusPlane::Damped => point,
            LocusPlane::Undamped if point.im == 0.0 && point.re < 0.0 => {
                Complex::new(0.0, (-point.re).sqrt())
            }
            LocusPlane::Undamped => point.sqrt(),
        }
    }

    fn census(self, zeros: &[Zero]) -> Census {
        match self {
            LocusPlane::Undamped => Census::Undamped(ZeroCounts::of(zeros)),
            LocusPlane::Damped => {
                let count = |real: bool, right: bool| {
                    zeros
                        .iter()
                        .filter(|z| is_real(z.s) == real && (z.s.re > 0.0) == right)
                        .count()
                };
                Census::Damped {
                    complex_left: count(false, false) / 2,
                    complex_right: count(false, true) / 2,
                    real_left: count(true, false),
                    real_right: count(true, true),
                }
            }
        }
    }
}

/// s^2, exactly real on the axes.
fn square(zero: &Zero) -> Complex<f64> {
    match zero.kind {
        ZeroKind::Mmp => Complex::new(-zero.s.im * zero.s.im, 0.0),
        ZeroKind::Rnmp => Complex::new(zero.s.re * zero.s.re, 0.0),
        _ => zero.s * zero.s,
    }
}

fn is_real(s: Complex<f64>) -> bool {
    s.im.abs() <= COMPLEX_RATIO * s.norm()
}

/// How many zeros there are of which kind; complex ones by conjugate pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Census {
    Undamped(ZeroCounts),
    Damped {
        complex_left: usize,
        complex_right: usize,
        real_left: usize,
        real_right: usize,
    },
}

impl std::fmt::Display for Census {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Census::Undamped(kinds) => kinds.fmt(f),
            Census::Damped {
                complex_left,
                complex_right,
                real_left,
                real_right,
            } => {
                let parts = [
                    (complex_left, "MMP or CMP"),
                    (complex_right, "CNMP"),
                    (real_left, "RMP"),
                    (real_right, "RNMP"),
                ];
                let parts = parts.iter().filter(|(count, _)| **count > 0);
                f.write_str(
                    &parts
                        .map(|(count, name)| format!("{count} x {name}"))
                        .collect::<Vec<_>>()
                        .join(" + "),
                )
            }
        }
    }
}

/// The zeros at one value.
#[derive(Clone, Debug)]
struct Sample {
    value: f64,
    points: Vec<Complex<f64>>,
    census: Census,
}

/// Halvings of a grid step until it is clear who moved where.
const DEPTH: u32 = 12;

struct Follower<F> {
    plane: LocusPlane,
    zeros: F,
    /// Samples that may still be taken beyond the grid to follow tracks.
    left: usize,
}

impl<E, F: FnMut(f64) -> Result<Vec<Zero>, E>> Follower<F> {
    fn sample(&mut self, value: f64) -> Result<Sample, E> {
        let zeros = (self.zeros)(value)?;
        Ok(Sample {
            value,
            points: self.plane.points(&zeros),
            census: self.plane.census(&zeros),
        })
    }

    /// One list of places a zero.
    fn tracks(&mut self, samples: &[Sample]) -> Result<Vec<Vec<Point>>, E> {
        let count = samples
            .iter()
            .map(|sample| sample.points.len())
            .max()
            .unwrap_or(0);
        let Some(first) = samples.first() else {
            return Ok(Vec::new());
        };
        let mut now = padded(&first.points, count);
        let mut tracks: Vec<Vec<Point>> = now.iter().map(|point| vec![*point]).collect();
        let scale = typical(samples);
        for pair in samples.windows(2) {
            now = self.moved(&now, pair[0].value, &pair[1], scale, DEPTH)?;
            tracks
                .iter_mut()
                .zip(&now)
                .for_each(|(track, point)| track.push(*point));
        }
        Ok(tracks)
    }

    /// Where each of the points `from`, at the value `at`, is in the sample `to`.
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

    /// All changes of kind between two samples, as far as the kinds at both differ.
    fn changes(
        &mut self,
        from: &Sample,
        to: &Sample,
        found: &mut Vec<KindChange>,
    ) -> Result<(), E> {
        let mut from = from.clone();
        // Each change alters one pair or quartet; more than there are zeros cannot stand between two samples.
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
            if width <= 4.0 * f64::EPSILON * low.value.abs().max(high.value.abs())
                || middle == low.value
            {
                return Ok((low, high));
            }
            let sample = self.sample(middle)?;
            if sample.census == low.census {
                low = sample
            } else {
                high = sample
            }
        }
    }

    /// Changes there and back between three samples of the same kinds.
    fn hidden(
        &mut self,
        triple: &[Sample],
        tracks: &[Vec<Point>],
        index: usize,
        found: &mut Vec<KindChange>,
    ) -> Result<(), E> {
        let [a, b, c] = triple else { return Ok(()) };
        if a.census != b.census || b.census != c.census {
            return Ok(());
        }
        for (i, first) in tracks.iter().enumerate() {
            for second in &tracks[i + 1..] {
                let gap = |k: usize| signed_gap(first[index + k], second[index + k]);
                let (Some(ga), Some(gb), Some(gc)) = (gap(0), gap(1), gap(2)) else {
                    continue;
                };
                if !may_vanish(ga, gb, gc) {
                    continue;
                }
                if let Some(other) =
                    self.nearest_approach(a, b, c, (first[index + 1], second[index + 1]))?
                {
                    self.changes(a, &other, found)?;
                    self.changes(&other, c, found)?;
                }
            }
        }
        Ok(())
    }

    /// Seeks the least distance of two zeros by golden section; a sample of other kinds, if one is met on the way.
    fn nearest_approach(
        &mut self,
        a: &Sample,
        b: &Sample,
        c: &Sample,
        pair: (Point, Point),
    ) -> Result<Option<Sample>, E> {
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        let (mut low, mut high) = (a.value, c.value);
        let gap = |sample: &Sample| {
            let places = assigned(
                &[pair.0, pair.1],
                &padded(&sample.points, sample.points.len()),
                1.0,
            );
            signed_gap(places[0], places[1]).map_or(f64::INFINITY, f64::abs)
        };
        for _ in 0..48 {
            let probes = [high - golden * (high - low), low + golden * (high - low)];
            let [left, right] = [self.sample(probes[0])?, self.sample(probes[1])?];
            if let Some(other) = [&left, &right]
                .into_iter()
                .find(|sample| sample.census != b.census)
            {
                return Ok(Some(other.clone()));
            }
            if gap(&left) < gap(&right) {
                high = probes[1]
            } else {
                low = probes[0]
            }
        }
        Ok(None)
    }
}

/// The median magnitude.
fn typical(samples: &[Sample]) -> f64 {
    let mut sizes: Vec<f64> = samples
        .iter()
        .flat_map(|sample| sample.points.iter().map(|point| point.norm()))
        .collect();
    sizes.sort_by(f64::total_cmp);
    sizes
        .get(sizes.len() / 2)
        .copied()
        .filter(|size| *size > 0.0)
        .unwrap_or(1.0)
}

/// (a - b)^2 in units of the mean square: above 0 for two on the real axis, below for a conjugate pair; `None` for others.
fn signed_gap(a: Point, b: Point) -> Option<f64> {
    let (a, b) = (a?, b?);
    let difference = (a - b) * (a - b) / (0.5 * (a.norm_sqr() + b.norm_sqr()));
    let one_matrix = is_real(a) && is_real(b) || (a - b.conj()).norm() <= 1e-6 * a.norm();
    (one_matrix && difference.re.is_finite()).then_some(difference.re)
}

/// Whether a quantity with an extremum towards zero between three samples may reach it there: the parabola through them
/// does, or leaves less than a third of the middle.
fn may_vanish(a: f64, b: f64, c: f64) -> bool {
    let towards = b.abs() <= a.abs() && b.abs() <= c.abs() && a * b > 0.0 && b * c > 0.0;
    let (slope, bend) = (0.5 * (c - a), 0.5 * (a + c) - b);
    let extremum = if bend == 0.0 {
        b
    } else {
        b - 0.25 * slope * slope / bend
    };
    towards && extremum / b < 0.67
}

/// What changes between two samples that are next to each other.
fn change(plane: LocusPlane, low: &Sample, high: &Sample) -> KindChange {
    let (crossing, point) = match (low.census, high.census) {
        (Census::Undamped(a), Census::Undamped(b)) if a.quartets != b.quartets => {
            let at = meeting(if a.quartets > b.quartets { low } else { high });
            (
                if at.re > 0.0 {
                    Crossing::RealAxis
                } else {
                    Crossing::ImaginaryAxis
                },
                at,
            )
        }
        (
            Census::Damped {
                real_left: al,
                real_right: ar,
                complex_right: a,
                ..
            },
            Census::Damped {
                real_left: bl,
                real_right: br,
                complex_right: b,
                ..
            },
        ) => match (al + ar).cmp(&(bl + br)) {
            std::cmp::Ordering::Equal if a != b => (Crossing::ImaginaryAxis, on_axis(low)),
            std::cmp::Ordering::Equal => through(low),
            // The complex pair is on the side with fewer real zeros. (Through infinity one real zero comes or goes.)
            less => (
                Crossing::RealAxis,
                meeting(if less.is_lt() { low } else { high }),
            ),
        },
        _ => through(low),
    };
    let s = plane.root(point);
    KindChange {
        value: 0.5 * (low.value + high.value),
        crossing,
        s: Complex::new(s.re, s.im.abs()),
        before: low.census.to_string(),
        after: high.census.to_string(),
    }
}

/// The real part of the complex zero nearest to the real axis.
fn meeting(sample: &Sample) -> Complex<f64> {
    let off = |z: &Complex<f64>| z.im.abs() / z.norm();
    let complex = sample.points.iter().filter(|z| !is_real(**z));
    let nearest = complex.min_by(|a, b| off(a).total_cmp(&off(b)));
    Complex::new(nearest.map_or(f64::NAN, |z| z.re), 0.0)
}

/// The complex zero nearest to the imaginary axis.
fn on_axis(sample: &Sample) -> Complex<f64> {
    let off = |z: &Complex<f64>| z.re.abs() / z.norm();
    let complex = sample.points.iter().filter(|z| !is_real(**z));
    let nearest = complex.min_by(|a, b| off(a).total_cmp(&off(b)));
    Complex::new(0.0, nearest.map_or(f64::NAN, |z| z.im))
}

/// Origin or infinity, whichever has a zero nearer.
fn through(sample: &Sample) -> (Crossing, Complex<f64>) {
    let mut sizes: Vec<f64> = sample.points.iter().map(|z| z.norm()).collect();
    sizes.sort_by(f64::total_cmp);
    let middle = sizes.get(sizes.len() / 2).copied().unwrap_or(1.0);
    let (least, most) = (
        sizes.first().copied().unwrap_or(0.0),
        sizes.last().copied().unwrap_or(f64::INFINITY),
    );
    if least * most < middle * middle && least < middle {
        (Crossing::Origin, Complex::new(0.0, 0.0))
    } else {
        (Crossing::Infinity, Complex::new(f64::INFINITY, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::plant::PlantError;
    use crate::model::zeros::{ModalSum, ModalTerm};

    fn grid(from: f64, to: f64, count: usize) -> Vec<f64> {
        (0..count)
            .map(|i| from + (to - from) * i as f64 / (count - 1) as f64)
            .collect()
    }

    fn section_3_2_4(a0: f64) -> Result<Vec<Zero>, PlantError> {
        let terms = vec![
            ModalTerm::undamped(0.0, 1.0),
            ModalTerm::undamped(10.0, -a0),
            ModalTerm::undamped(11.0, a0),
        ];
        ModalSum::new(terms, 0.0)?.undamped_zeros()
    }

    #[test]
    fn the_zeros_of_section_3_2_4_meet_at_1_21_and_21() {
        for count in [4, 50, 1001] {
            let locus = Locus::follow(
                LocusPlane::Undamped,
                &grid(1e-3, 30.0, count),
                section_3_2_4,
            )
            .unwrap();
            let [first, second] = locus.changes.as_slice() else {
                panic!("{:?}", locus.changes)
            };
            assert_eq!(
                (first.crossing, second.crossing),
                (Crossing::ImaginaryAxis, Crossing::RealAxis)
            );
            // Two zeros count as one below 1e-7 of their size: 1e-14 in the value, and rounding.
            assert!(
                (first.value * 21.0 - 1.0).abs() < 1e-11
                    && (second.value / 21.0 - 1.0).abs() < 1e-11
            );
            assert_eq!(
                [&first.before, &first.after, &second.before, &second.after],
                ["dual MMP", "CMP-CNMP", "CMP-CNMP", "dual RMP-RNMP"]
            );
            // N = x^2 + (221 - 21 a0) x + 12100: the double root is -+ 110.
            for change in [first, second] {
                assert!((change.s.norm_sqr() - 110.0).abs() < 1e-4, "{change:?}");
            }
        }
    }

    #[test]
    fn a_band_of_complex_zeros_narrower_than_the_grid_is_found() {
        // x^2 + (221 - 21 a0) x + 12100 with a0 = 1/21 + 1e-6 - (v - 0.5137)^2: complex within 1e-3 of v = 0.5137 only.
        let bump = |v: f64| section_3_2_4(1.0 / 21.0 + 1e-6 - (v - 0.5137) * (v - 0.5137) * 0.05);
        let locus = Locus::follow(LocusPlane::Undamped, &grid(0.0, 1.0, 24), bump).unwrap();
        let half_width = (1e-6f64 / 0.05).sqrt();
        let values: Vec<f64> = locus.changes.iter().map(|change| change.value).collect();
        assert_eq!(values.len(), 2, "{:?}", locus.changes);
        for (value, expected) in values
            .iter()
            .zip([0.5137 - half_width, 0.5137 + half_width])
        {
            assert!((value - expected).abs() < 1e-9, "{value} for {expected}");
        }
    }

    #[test]
    fn a_pair_goes_through_infinity_and_is_followed_there() {
        // Fig 3-2: aR = 1, av from 0 to -3; the pair on the imaginary axis goes to infinity at av = -1 and comes back on the
        // real one. x = -wv^2/(1 + av).
        let zeros = |av: f64| {
            ModalSum::new(
                vec![ModalTerm::undamped(0.0, 1.0), ModalTerm::undamped(3.0, av)],
                0.0,
            )?
            .undamped_zeros()
        };
        let locus =
            Locus::follow::<PlantError>(LocusPlane::Undamped, &grid(-0.01, -3.0, 60), zeros)
                .unwrap();
        let [change] = locus.changes.as_slice() else {
            panic!("{:?}", locus.changes)
        };
        assert_eq!(change.crossing, Crossing::Infinity);
        assert!((change.value + 1.0).abs() < 1e-11, "{change:?}");
        assert_eq!(locus.tracks.len(), 1);
        for (value, s) in locus.values.iter().zip(&locus.tracks[0]) {
            let square = s.unwrap() * s.unwrap();
            assert!(
                (square * (1.0 + value) + 9.0).norm() < 1e-9,
                "{square} at {value}"
            );
        }
    }

    #[test]
    fn damped_zeros_cross_the_imaginary_axis_one_by_one() {
        // Eq. (3-15) below the touching damping of wu = 0.9, wv = 1.1, ratio 2.
        let mode = |omega_rad_s, residue_per_kg| ModalTerm {
            omega_rad_s,
            damping_ratio: 0.2,
            residue_per_kg,
        };
        let zeros = |av: f64| {
            ModalSum::new(
                vec![
                    ModalTerm::undamped(0.0, 1.0),
                    mode(0.9, -2.0 * av),
                    mode(1.1, av),
                ],
                0.0,
            )?
            .damped_zeros()
        };
        let locus =
            Locus::follow::<PlantError>(LocusPlane::Damped, &grid(0.01, 0.9, 90), zeros).unwrap();
        let crossings: Vec<Crossing> = locus.changes.iter().map(|change| change.crossing).collect();
        assert_eq!(
            crossings,
            [Crossing::ImaginaryAxis, Crossing::ImaginaryAxis],
            "{:?}",
            locus.changes
        );
        for change in &locus.changes {
            let on_axis = zeros(change.value).unwrap();
            assert!(
                on_axis.iter().any(|z| (z.s - change.s).norm() < 1e-9),
                "{change:?}: {on_axis:?}"
            );
        }
    }
}
