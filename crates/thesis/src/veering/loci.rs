//! Curve veering (section 4.1): two eigenvalue loci that approach each other as a setting varies, and diverge again
//! or cross.
//!
//! Modes are followed by their shapes, not by their order: a mode at one value continues as the mode at the next with the
//! largest modal assurance criterion, weighted with the mean M of the two values,
//!
//! ```text
//!  MAC(v, w) = (v^T M w)^2 / ((v^T M v) (w^T M w))         0 to 1; with one M, those of a mode with all others sum to 1
//! ```
//!
//! A step is halved while some mode's MAC is 0.5 or less (another could have more) or two modes change their order: either
//! they cross, or they veer within the step and exchange their shapes, which only smaller steps can distinguish. Where
//! eigenvalues are equal to rounding, any basis of their modes is valid; the one nearest to the step before is taken.

use serde::Serialize;

use super::ModesAt;
use bench_plant::{PlantError, Structure};

/// Steps below this ratio of the range are not halved any more.
const SMALLEST_STEP: f64 = 1e-12;
/// For modes that are equal at the first value, the basis is taken at this ratio of the range.
const FIRST_BASIS_RATIO: f64 = 1e-3;
/// A mode with less than this ratio of the largest residue, at all values, cannot be observed.
const OBSERVED_RATIO: f64 = 1e-9;
/// Steps of the golden section: 0.618^80 is 2e-17.
const GOLDEN_STEPS: usize = 80;

/// The behaviour of two loci where they are closest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Meeting {
    /// The frequencies are equal to rounding: mode crossing.
    #[serde(rename = "crossing")]
    Crossing,
    /// They approach each other and diverge again: curve veering.
    #[serde(rename = "veering")]
    Veering,
    /// They are closest at an end of the range: their behaviour beyond is unknown.
    #[serde(rename = "at the end")]
    AtTheEnd,
}

impl Meeting {
    /// `crossing`, `veering` or `at the end`.
    pub fn name(self) -> &'static str {
        match self {
            Meeting::Crossing => "crossing",
            Meeting::Veering => "veering",
            Meeting::AtTheEnd => "at the end",
        }
    }

    /// The verb for it: the modes `cross`, `veer` or `are closest at an end of the range`.
    pub fn verb(self) -> &'static str {
        match self {
            Meeting::Crossing => "cross",
            Meeting::Veering => "veer",
            Meeting::AtTheEnd => "are closest at an end of the range",
        }
    }
}

/// The modes over a setting, each identified by its position at the first value, in order of frequency.
#[derive(Clone, Debug)]
pub struct Loci<F> {
    at: F,
    smallest_step: f64,
    path: Vec<ModesAt>,
}

impl<E: From<PlantError>, F: FnMut(f64) -> Result<Structure, E>> Loci<F> {
    /// Follows the modes of `at` through `values`, two or more, which rise or fall throughout.
    pub fn follow(values: &[f64], mut at: F) -> Result<Loci<F>, E> {
        let (from, to) = (values[0], values[values.len() - 1]);
        let mut first = ModesAt::of(at(from)?, from)?;
        if (1..first.count()).any(|next| first.are_equal([next - 1, next])) {
            let inside = from + FIRST_BASIS_RATIO * (to - from);
            first = first.following(&ModesAt::of(at(inside)?, inside)?);
        }
        let mut loci = Loci {
            at,
            smallest_step: SMALLEST_STEP * (to - from).abs(),
            path: vec![first],
        };
        for &value in &values[1..] {
            loci.extend(loci.path.len(), value)?;
        }
        Ok(loci)
    }

    /// All values through which the modes were followed, with those between the grid's.
    pub fn path(&self) -> &[ModesAt] {
        &self.path
    }

    /// The modes at one value of the grid; the nearest on the path for any other.
    pub fn near(&self, value: f64) -> &ModesAt {
        let distance = |index: &usize| (self.path[*index].value - value).abs();
        &self.path[self.least(distance)]
    }

    /// The index on the path with the least of some measure, the first of several.
    fn least(&self, measure: impl Fn(&usize) -> f64) -> usize {
        let order = |a: &usize, b: &usize| measure(a).total_cmp(&measure(b));
        (0..self.path.len()).min_by(order).unwrap_or(0)
    }

    /// Inserts the modes at `value` behind those of `index` - 1, with as many values between as are needed. Returns the
    /// index of `value`.
    fn extend(&mut self, index: usize, value: f64) -> Result<usize, E> {
        let modes = ModesAt::of((self.at)(value)?, value)?;
        self.reach(index, modes)
    }

    fn reach(&mut self, index: usize, modes: ModesAt) -> Result<usize, E> {
        let before = &self.path[index - 1];
        let (low, high) = (before.value, modes.value);
        let next = modes.clone().following(before);
        if before.continues_in(&next) || (high - low).abs() <= self.smallest_step {
            self.path.insert(index, next);
            return Ok(index);
        }
        let middle = self.extend(index, 0.5 * (low + high))?;
        self.reach(middle + 1, modes)
    }

    /// All pairs of modes that springs hold at every value.
    fn held_pairs(&self) -> Vec<[usize; 2]> {
        let is_held = |mode: &usize| self.path.iter().all(|at| at.omega_rad_s[*mode] > 0.0);
        let held: Vec<usize> = (0..self.path[0].count()).filter(is_held).collect();
        let above = held.iter().enumerate();
        above
            .flat_map(|(k, &j)| held[..k].iter().map(move |&i| [i, j]))
            .collect()
    }

    /// The two held modes with the smallest |w_i - w_j|/(w_i + w_j) anywhere on the path; `None` of fewer than two modes.
    pub fn closest_pair(&self) -> Option<[usize; 2]> {
        let least = |pair: [usize; 2]| {
            let gaps = self.path.iter().map(|at| at.relative_gap(pair));
            gaps.fold(f64::INFINITY, f64::min)
        };
        let pairs = self.held_pairs().into_iter();
        pairs.min_by(|a, b| least(*a).total_cmp(&least(*b)))
    }

    /// The pairs of held modes that are closest inside the range, not at an end of it: first those of which both modes can
    /// be observed between the plant's actuator and its probe, and of these the smallest relative distance first.
    pub fn meeting_pairs(&self) -> Vec<[usize; 2]> {
        let observed = self.observed();
        let mut pairs = self.held_pairs();
        pairs.retain(|pair| self.is_inside(self.closest(*pair)));
        let key = |pair: &[usize; 2]| {
            let is_hidden = pair.iter().any(|mode| !observed[*mode]);
            let gap = self.path[self.closest(*pair)].relative_gap(*pair);
            (is_hidden, gap)
        };
        pairs.sort_by(|a, b| {
            let (a, b) = (key(a), key(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        pairs
    }

    /// Whether each mode can be observed somewhere on the path: more than `OBSERVED_RATIO` of the largest residue.
    fn observed(&self) -> Vec<bool> {
        let mut largest = vec![0.0f64; self.path[0].count()];
        for at in &self.path {
            let terms = at.terms(&at.structure().force, &at.structure().sensor);
            for (largest, term) in largest.iter_mut().zip(&terms) {
                *largest = largest.max(term.residue_per_kg.abs());
            }
        }
        let most = largest.iter().copied().fold(0.0, f64::max);
        let is_observed = |largest: &f64| *largest > OBSERVED_RATIO * most;
        largest.iter().map(is_observed).collect()
    }

    /// The values where two modes have the closest frequencies (the veering point), by golden section around the closest
    /// values of the path.
    pub fn meeting(&mut self, pair: [usize; 2]) -> Result<(Meeting, ModesAt), E> {
        let closest = self.closest(pair);
        let at = self.path[closest].clone();
        if !self.is_inside(closest) {
            return Ok((Meeting::AtTheEnd, at));
        }
        if at.are_equal(pair) {
            return Ok((Meeting::Crossing, at));
        }
        let ends = [self.path[closest - 1].value, self.path[closest + 1].value];
        self.refine(pair, ends)?;
        let at = self.path[self.closest(pair)].clone();
        let meeting = if at.are_equal(pair) {
            Meeting::Crossing
        } else {
            Meeting::Veering
        };
        Ok((meeting, at))
    }

    fn is_inside(&self, index: usize) -> bool {
        index != 0 && index + 1 != self.path.len()
    }

    fn closest(&self, pair: [usize; 2]) -> usize {
        self.least(|index| self.path[*index].gap_rad_s(pair))
    }

    /// Adds values to the path by golden section for the smallest gap.
    fn refine(&mut self, pair: [usize; 2], [mut low, mut high]: [f64; 2]) -> Result<(), E> {
        let ratio = 0.5 * (5f64.sqrt() - 1.0);
        let mut left = self.gap_at(pair, high - ratio * (high - low))?;
        let mut right = self.gap_at(pair, low + ratio * (high - low))?;
        for _ in 0..GOLDEN_STEPS {
            if left.1 < right.1 {
                (high, right) = (right.0, left);
                left = self.gap_at(pair, high - ratio * (high - low))?;
            } else {
                (low, left) = (left.0, right);
                right = self.gap_at(pair, low + ratio * (high - low))?;
            }
        }
        Ok(())
    }

    /// A value and the gap of two modes there.
    fn gap_at(&mut self, pair: [usize; 2], value: f64) -> Result<(f64, f64), E> {
        Ok((value, self.at(value)?.gap_rad_s(pair)))
    }

    /// The modes at any value of the range, followed from those before it.
    pub fn at(&mut self, value: f64) -> Result<&ModesAt, E> {
        let is_rising = self.path[0].value < self.path[self.path.len() - 1].value;
        let index = self.path.partition_point(|at| {
            if is_rising {
                at.value <= value
            } else {
                at.value >= value
            }
        });
        // The range is that of the path, so that some value comes before.
        let next = index.max(1);
        let index = if self.path[next - 1].value == value {
            next - 1
        } else {
            self.extend(next, value)?
        };
        Ok(&self.path[index])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_base::numeric::linspace;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    fn structure(mass: DMatrix<f64>, stiffness: DMatrix<f64>) -> Result<Structure, PlantError> {
        let n = mass.nrows();
        let ones = DVector::from_fn(n, |i, _| 1.0 + 0.3 * i as f64);
        let (force, sensor, floor) = (ones.clone(), ones.clone(), ones);
        Ok(Structure {
            damping: DMatrix::zeros(n, n),
            mass,
            stiffness,
            force,
            sensor,
            floor,
            free_bodies: 0,
        })
    }

    /// Two unit masses on springs k + d and k - d, joined by c: w^2 = k + c -+ sqrt(d^2 + c^2).
    fn oscillators(coupling: f64) -> impl Fn(f64) -> Result<Structure, PlantError> {
        move |d| {
            let (k, c) = (100.0, coupling);
            structure(
                DMatrix::identity(2, 2),
                DMatrix::from_row_slice(2, 2, &[k + d + c, -c, -c, k - d + c]),
            )
        }
    }

    fn grid(from: f64, to: f64, count: usize) -> Vec<f64> {
        linspace(from, to, count).collect()
    }

    #[test]
    fn coupled_oscillators_veer_by_the_coupling() {
        for coupling in [1.0, 0.1, 1e-3, 1e-6] {
            for (from, to, count) in [(-7.0, 9.0, 5), (9.0, -7.0, 12), (-8.0, 8.0, 101)] {
                let mut loci = Loci::follow(&grid(from, to, count), oscillators(coupling)).unwrap();
                assert_eq!(loci.closest_pair(), Some([0, 1]));
                let (meeting, at) = loci.meeting([0, 1]).unwrap();
                let gap = (100.0 + 2.0 * coupling).sqrt() - 10.0;
                assert_eq!(meeting, Meeting::Veering, "{coupling}");
                // w^2 near 100 is rounded at some 1e-14 in each of a few operations: 1e-14 of w and more of its difference.
                assert!(
                    (at.gap_rad_s([0, 1]) - gap).abs() < 1e-13,
                    "{coupling}: {} for {gap}",
                    at.gap_rad_s([0, 1])
                );
                // The gap is flat to its rounding where d^2/(2 c) < 2e-12.
                assert!(
                    at.value.abs() < 1e-13 + (4e-12 * coupling).sqrt(),
                    "{coupling}: at {}",
                    at.value
                );
                let (first, last) = (&loci.path()[0], &loci.path()[loci.path().len() - 1]);
                // tan(2 angle) = c/d: each shape leaves the axis by c/(2 d) on either side.
                let swapped = (coupling / 7.0f64).atan() / 2.0 + (coupling / 9.0f64).atan() / 2.0;
                let bound = swapped.sin().powi(2) * 1.1 + 1e-12;
                for (i, j) in [(0, 1), (1, 0)] {
                    assert!(
                        first.mac(i, last, j) > 1.0 - bound,
                        "{coupling}: {}",
                        first.mac(i, last, j)
                    );
                    assert!(first.mac(i, last, i) < bound);
                    // Half each at the veering point; d = 1e-3 c there turns the shapes by 5e-4.
                    let tolerance = 0.5 * at.value.abs() / coupling + 1e-6;
                    assert!(
                        at.shares(i)
                            .iter()
                            .all(|share| (share - 0.5).abs() < tolerance)
                    );
                }
            }
        }
    }

    #[test]
    fn separate_oscillators_cross_and_keep_their_shapes() {
        // Grids that step over d = 0, and one with a value there.
        for (from, to, count) in [(-7.0, 9.0, 6), (9.0, -7.0, 40), (-8.0, 8.0, 101)] {
            let mut loci = Loci::follow(&grid(from, to, count), oscillators(0.0)).unwrap();
            let (meeting, at) = loci.meeting([0, 1]).unwrap();
            assert_eq!(meeting, Meeting::Crossing);
            // Equal within 1e-12 of w^2 = 100: 2 |d| < 1e-10.
            assert!(at.value.abs() <= 1e-10, "{}", at.value);
            let (first, last) = (&loci.path()[0], &loci.path()[loci.path().len() - 1]);
            assert!(first.mac(0, last, 0) > 1.0 - 1e-12 && first.mac(0, last, 1) < 1e-12);
            assert!(
                at.shares(0)
                    .iter()
                    .chain(&at.shares(1))
                    .all(|share| share.min(1.0 - share) < 1e-12)
            );
            assert!(
                (first.omega_rad_s[0] < first.omega_rad_s[1])
                    && (last.omega_rad_s[0] > last.omega_rad_s[1])
            );
        }
    }

    #[test]
    fn loci_closest_at_an_end_do_not_meet() {
        let mut loci = Loci::follow(&grid(1.0, 9.0, 9), oscillators(0.1)).unwrap();
        let (meeting, at) = loci.meeting([0, 1]).unwrap();
        assert_eq!((meeting, at.value), (Meeting::AtTheEnd, 1.0));
        // The modes are equal at the first value: the basis is that of the modes at the next value.
        let mut loci = Loci::follow(&grid(0.0, 9.0, 9), oscillators(0.0)).unwrap();
        let (meeting, at) = loci.meeting([0, 1]).unwrap();
        assert_eq!(
            (meeting, at.value, loci.path().len()),
            (Meeting::AtTheEnd, 0.0, 9)
        );
        assert!(at.shares(0)[1] > 1.0 - 1e-12 && at.shares(1)[0] > 1.0 - 1e-12);
    }

    fn symmetric(entries: &[f64]) -> DMatrix<f64> {
        let square = DMatrix::from_row_slice(4, 4, entries);
        &square + square.transpose()
    }

    proptest! {
        #[test]
        fn followed_modes_are_continuous(
            masses in prop::collection::vec(0.5..2.0f64, 4),
            constant in prop::collection::vec(-1.0..1.0f64, 16),
            linear in prop::collection::vec(-4.0..4.0f64, 16),
        ) {
            // Positive definite by Gershgorin: rows of symmetric(..) stay below 8 + 32.
            let mass = DMatrix::from_diagonal(&DVector::from_vec(masses));
            let stiffness = |x: f64| DMatrix::identity(4, 4) * 60.0 + symmetric(&constant) + x * symmetric(&linear);
            let loci = Loci::follow(&grid(-1.0, 1.0, 7), |x| structure(mass.clone(), stiffness(x))).unwrap();
            for step in loci.path().windows(2) {
                for mode in 0..4 {
                    let (v, w) = (step[0].shapes.column(mode), step[1].shapes.column(mode));
                    let product = v.dot(&(&mass * w));
                    prop_assert!(product > 0.5f64.sqrt(), "mode {mode} from {} to {}", step[0].value, step[1].value);
                }
            }
            // Eigenvalues of a random symmetric pencil over one parameter do not cross (von Neumann, Wigner).
            for at in loci.path() {
                prop_assert!(at.omega_rad_s.windows(2).all(|pair| pair[0] <= pair[1]), "{:?}", at.omega_rad_s);
                let squares = at.omega_rad_s.iter().enumerate();
                for (mode, w) in squares {
                    let v = at.shapes.column(mode);
                    let rest = stiffness(at.value) * v - w * w * &mass * v;
                    prop_assert!(rest.amax() < 1e-11, "{rest}");
                }
            }
        }
    }
}
