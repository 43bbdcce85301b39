//! Curve veering (section 4.1): two eigenvalue loci that approach each other as a setting varies, and part or cross.
//!
//! Modes are followed by their shapes, not by their order: a mode of one value goes on as the mode of the next with the
//! largest modal assurance criterion, weighted with the mean M of the two values,
//!
//! ```text
//!  MAC(v, w) = (v^T M w)^2 / ((v^T M v) (w^T M w))         0 to 1; with one M, those of a mode with all others sum to 1
//! ```
//!
//! A step is halved while some mode's MAC is 0.5 or less (another could have more) or two modes change their order: either
//! they cross, or they veer within the step and exchange their shapes, which only smaller steps tell apart. Where
//! eigenvalues are equal to rounding every basis of their modes is one; the one nearest to the step before is taken.

use nalgebra::{DMatrix, DVector};

use crate::model::plant::{ModalModel, Mode, PlantError, Structure};
use crate::model::zeros::ModalTerm;

/// Eigenvalues come with an error of some 1e-15 of the largest: closer than this ratio of it, two are one.
const EQUAL_RATIO: f64 = 1e-12;
/// Ten times what rounding leaves of one mode's gain in another's.
const ROUNDED_GAIN: f64 = 1e-14;
/// A MAC above this leaves no other partner.
const CLEAR_MAC: f64 = 0.5;
/// Steps below this ratio of the range are halved no more.
const SMALLEST_STEP: f64 = 1e-12;
/// Ratio of the range at which the basis of modes is taken that are equal at the first value.
const FIRST_LOOK: f64 = 1e-3;
/// A mode with less than this of the largest residue, at all values, does not show.
const SHOWN_RATIO: f64 = 1e-9;
/// Steps of the golden section: 0.618^80 is 2e-17.
const GOLDEN_STEPS: usize = 80;

/// All modes at one value of the setting. Columns and entries belong to one mode at every value.
#[derive(Clone, Debug, PartialEq)]
pub struct ModesAt {
    /// The setting.
    pub value: f64,
    /// Undamped natural frequencies.
    pub omega_rad_s: Vec<f64>,
    /// Shapes of unit modal mass, one a column, degrees of freedom x modes; signs go on from value to value.
    shapes: DMatrix<f64>,
    structure: Structure,
}

impl ModesAt {
    fn of(structure: Structure, value: f64) -> Result<ModesAt, PlantError> {
        let modal = ModalModel::of(&structure)?;
        let unit =
            |mode: &Mode| &mode.shape / mode.shape.dot(&(&structure.mass * &mode.shape)).sqrt();
        let columns: Vec<_> = modal.modes.iter().map(unit).collect();
        let omega_rad_s = modal.modes.iter().map(|mode| mode.omega_rad_s).collect();
        Ok(ModesAt {
            value,
            omega_rad_s,
            shapes: DMatrix::from_columns(&columns),
            structure,
        })
    }

    /// The plant at this value.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// row^T v for the shape v of unit modal mass, in 1/sqrt(kg): what a mode gives of a displacement row^T z, and takes of
    /// a force along it.
    pub fn gain(&self, mode: usize, row: &DVector<f64>) -> f64 {
        row.dot(&self.shapes.column(mode))
    }

    /// v^T M w of a mode here with a mode there, both of unit modal mass: the cosine between them, with its sign.
    pub fn cosine(&self, mode: usize, there: &ModesAt, other: usize) -> f64 {
        let mass = 0.5 * (&self.structure.mass + &there.structure.mass);
        self.shapes
            .column(mode)
            .dot(&(mass * there.shapes.column(other)))
    }

    /// Damping ratio v^T C v/(2 w) of a mode; 0 of a free body.
    pub fn damping_ratio(&self, mode: usize) -> f64 {
        let (w, shape) = (self.omega_rad_s[mode], self.shapes.column(mode));
        if w == 0.0 {
            0.0
        } else {
            shape.dot(&(&self.structure.damping * shape)) / (2.0 * w)
        }
    }

    /// The undamped modes as seen between a force along `force` and a displacement along `sensor` (Eq. 4-15), each in its
    /// place. What is rounding of a gain is 0: a mode that does not show has no sign.
    pub fn terms(&self, force: &DVector<f64>, sensor: &DVector<f64>) -> Vec<ModalTerm> {
        let (force, sensor) = (self.gains(force), self.gains(sensor));
        let term = |(mode, w): (usize, &f64)| ModalTerm::undamped(*w, force[mode] * sensor[mode]);
        self.omega_rad_s.iter().enumerate().map(term).collect()
    }

    /// Gains of all modes. A shape has of each other one some 1e-15 of the largest eigenvalue over the distance between the
    /// two: what is not more than ten times that is 0.
    pub(super) fn gains(&self, row: &DVector<f64>) -> Vec<f64> {
        let gains: Vec<f64> = (0..self.omega_rad_s.len())
            .map(|mode| self.gain(mode, row))
            .collect();
        let largest = self
            .omega_rad_s
            .iter()
            .fold(0.0, |largest: f64, w| largest.max(w * w));
        let leak = |i: usize, j: usize| {
            let distance = (self.omega_rad_s[i] - self.omega_rad_s[j])
                * (self.omega_rad_s[i] + self.omega_rad_s[j]);
            if i == j {
                1.0
            } else {
                largest / distance.abs()
            }
        };
        let rounding = |i: usize| {
            ROUNDED_GAIN
                * (0..gains.len())
                    .map(|j| gains[j].abs() * leak(i, j))
                    .sum::<f64>()
        };
        (0..gains.len())
            .map(|i| {
                if gains[i].abs() <= rounding(i) {
                    0.0
                } else {
                    gains[i]
                }
            })
            .collect()
    }

    /// The shape of a mode over the degrees of freedom, of unit length.
    pub fn shape(&self, mode: usize) -> Vec<f64> {
        self.shapes
            .column(mode)
            .normalize()
            .iter()
            .copied()
            .collect()
    }

    /// The share of each degree of freedom in a shape: the squares of its elements at unit length. They sum to 1; a share
    /// near 1 is a mode localised there.
    pub fn shares(&self, mode: usize) -> Vec<f64> {
        self.shape(mode).into_iter().map(|x| x * x).collect()
    }

    /// MAC of a mode here with a mode there.
    pub fn mac(&self, mode: usize, there: &ModesAt, other: usize) -> f64 {
        let (v, w, mass) = (
            self.shapes.column(mode),
            there.shapes.column(other),
            0.5 * (&self.structure.mass + &there.structure.mass),
        );
        let product = v.dot(&(&mass * w));
        product * product / (v.dot(&(&mass * v)) * w.dot(&(&mass * w)))
    }

    /// |w_i - w_j| in rad/s.
    pub fn gap_rad_s(&self, [i, j]: [usize; 2]) -> f64 {
        (self.omega_rad_s[i] - self.omega_rad_s[j]).abs()
    }

    /// Whether the eigenvalues w^2 of two modes are the same but for rounding.
    pub fn are_equal(&self, [i, j]: [usize; 2]) -> bool {
        let square = |w: &f64| w * w;
        let largest = self.omega_rad_s.iter().map(square).fold(0.0, f64::max);
        (square(&self.omega_rad_s[i]) - square(&self.omega_rad_s[j])).abs() <= EQUAL_RATIO * largest
    }

    /// These modes in the places and with the signs of those before.
    fn following(mut self, before: &ModesAt) -> ModesAt {
        self.turn_equal_modes(before);
        let places = partners(before, &self);
        let mass = 0.5 * (&before.structure.mass + &self.structure.mass);
        let mut shapes = self.shapes.select_columns(&places);
        for (index, mut shape) in shapes.column_iter_mut().enumerate() {
            let flip = before.shapes.column(index).dot(&(&mass * &shape)) < 0.0;
            shape *= if flip { -1.0 } else { 1.0 };
        }
        let omega_rad_s = places
            .iter()
            .map(|&place| self.omega_rad_s[place])
            .collect();
        ModesAt {
            omega_rad_s,
            shapes,
            ..self
        }
    }

    /// Turns the basis of each group of equal modes (slowest first, as computed) to the nearest modes before: with
    /// C = P^T M G of the k modes P that reach furthest into the group and C = U S W^T, the basis G W U^T.
    fn turn_equal_modes(&mut self, before: &ModesAt) {
        let n = self.omega_rad_s.len();
        let mut first = 0;
        while first < n {
            let count = 1
                + (first + 1..n)
                    .take_while(|&next| self.are_equal([next - 1, next]))
                    .count();
            if count > 1 {
                self.turn(before, first, count);
            }
            first += count;
        }
    }

    fn turn(&mut self, before: &ModesAt, first: usize, count: usize) {
        let group = self.shapes.columns(first, count).into_owned();
        let reach = before.shapes.transpose() * &self.structure.mass * &group;
        let mut order: Vec<usize> = (0..reach.nrows()).collect();
        order.sort_by(|&i, &j| {
            reach
                .row(j)
                .norm_squared()
                .total_cmp(&reach.row(i).norm_squared())
        });
        order.truncate(count);
        if let (Some(u), Some(w_t)) = {
            let svd = reach.select_rows(&order).svd(true, true);
            (svd.u, svd.v_t)
        } {
            self.shapes
                .columns_mut(first, count)
                .copy_from(&(group * (u * w_t).transpose()));
        }
    }

    /// Whether these modes surely go on as those: each by its shape, and none past another.
    fn leads_to(&self, next: &ModesAt) -> bool {
        let n = self.omega_rad_s.len();
        let similar = (0..n).all(|mode| self.mac(mode, next, mode) > CLEAR_MAC);
        let side = |at: &ModesAt, i: usize, j: usize| match at.are_equal([i, j]) {
            true => 0.0,
            false => (at.omega_rad_s[i] - at.omega_rad_s[j]).signum(),
        };
        similar && (0..n).all(|i| (0..i).all(|j| side(self, i, j) * side(next, i, j) >= 0.0))
    }
}

/// For each mode before its place after: the most similar pairs first.
fn partners(before: &ModesAt, after: &ModesAt) -> Vec<usize> {
    let n = before.omega_rad_s.len();
    let pairs = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let mut pairs: Vec<(f64, usize, usize)> = pairs
        .map(|(i, j)| (before.mac(i, after, j), i, j))
        .collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut place, mut taken) = (vec![None; n], vec![false; n]);
    for (_, i, j) in pairs {
        if place[i].is_none() && !taken[j] {
            place[i] = Some(j);
            taken[j] = true;
        }
    }
    place
        .into_iter()
        .enumerate()
        .map(|(i, place)| place.unwrap_or(i))
        .collect()
}

/// What two loci do where they are closest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meeting {
    /// The frequencies are equal to rounding: mode crossing.
    Crossing,
    /// They approach each other and part: curve veering.
    Veering,
    /// They are closest at an end of the range: what they do beyond is not known.
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
}

/// The modes over a setting, each followed from its place at the first value (slowest first).
#[derive(Clone, Debug)]
pub struct Loci<F> {
    at: F,
    smallest_step: f64,
    path: Vec<ModesAt>,
}

impl<E: From<PlantError>, F: FnMut(f64) -> Result<Structure, E>> Loci<F> {
    /// Follows the modes of `at` through `values`, which rise or fall throughout and are two or more.
    pub fn follow(values: &[f64], mut at: F) -> Result<Loci<F>, E> {
        let (from, to) = (values[0], values[values.len() - 1]);
        let mut first = ModesAt::of(at(from)?, from)?;
        if (1..first.omega_rad_s.len()).any(|next| first.are_equal([next - 1, next])) {
            let inside = from + FIRST_LOOK * (to - from);
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

    /// All values that the modes were followed through, with those between the grid's.
    pub fn path(&self) -> &[ModesAt] {
        &self.path
    }

    /// The modes at one value of the grid; the nearest on the path for any other.
    pub fn near(&self, value: f64) -> &ModesAt {
        let distance = |at: &ModesAt| (at.value - value).abs();
        let nearest = (1..self.path.len()).fold(0, |best, index| {
            if distance(&self.path[index]) < distance(&self.path[best]) {
                index
            } else {
                best
            }
        });
        &self.path[nearest]
    }

    /// Inserts the modes at `value` behind those of `index` - 1, and what it takes between. Gives the place of `value`.
    fn extend(&mut self, index: usize, value: f64) -> Result<usize, E> {
        let modes = ModesAt::of((self.at)(value)?, value)?;
        self.reach(index, modes)
    }

    fn reach(&mut self, index: usize, modes: ModesAt) -> Result<usize, E> {
        let before = &self.path[index - 1];
        let (low, high) = (before.value, modes.value);
        let next = modes.clone().following(before);
        if before.leads_to(&next) || (high - low).abs() <= self.smallest_step {
            self.path.insert(index, next);
            return Ok(index);
        }
        let middle = self.extend(index, 0.5 * (low + high))?;
        self.reach(middle + 1, modes)
    }

    /// The two held modes with the smallest |w_i - w_j|/(w_i + w_j) anywhere on the path; `None` of fewer than two modes.
    pub fn closest_pair(&self) -> Option<[usize; 2]> {
        let n = self.path[0].omega_rad_s.len();
        let held = |i: usize| self.path.iter().all(|at| at.omega_rad_s[i] > 0.0);
        let relative = |[i, j]: [usize; 2]| {
            let ratio =
                |at: &ModesAt| at.gap_rad_s([i, j]) / (at.omega_rad_s[i] + at.omega_rad_s[j]);
            self.path.iter().map(ratio).fold(f64::INFINITY, f64::min)
        };
        let pairs = (0..n)
            .flat_map(|j| (0..j).map(move |i| [i, j]))
            .filter(|pair| pair.iter().all(|&i| held(i)));
        pairs.min_by(|a, b| relative(*a).total_cmp(&relative(*b)))
    }

    /// The pairs of held modes that are closest inside the range, not at an end of it: first those that both show between the
    /// plant's actuator and its probe, and of these the smallest relative distance first.
    pub fn meeting_pairs(&self) -> Vec<[usize; 2]> {
        let shown = self.shown();
        let n = shown.len();
        let inside = |pair: &[usize; 2]| {
            let closest = self.closest(*pair);
            closest != 0 && closest + 1 != self.path.len()
        };
        let pairs = (0..n).flat_map(|j| (0..j).map(move |i| [i, j]));
        let held = |mode: &usize| self.path.iter().all(|at| at.omega_rad_s[*mode] > 0.0);
        let mut pairs: Vec<[usize; 2]> = pairs
            .filter(|pair| pair.iter().all(held))
            .filter(inside)
            .collect();
        let distance = |pair: &[usize; 2]| {
            let at = &self.path[self.closest(*pair)];
            at.gap_rad_s(*pair) / (at.omega_rad_s[pair[0]] + at.omega_rad_s[pair[1]])
        };
        let hidden = |pair: &[usize; 2]| pair.iter().any(|mode| !shown[*mode]);
        pairs.sort_by(|a, b| {
            hidden(a)
                .cmp(&hidden(b))
                .then(distance(a).total_cmp(&distance(b)))
        });
        pairs
    }

    /// Whether each mode shows somewhere on the path: more than `SHOWN_RATIO` of the largest residue.
    fn shown(&self) -> Vec<bool> {
        let n = self.path[0].omega_rad_s.len();
        let mut largest = vec![0.0f64; n];
        for at in &self.path {
            let terms = at.terms(&at.structure.force, &at.structure.sensor);
            largest
                .iter_mut()
                .zip(&terms)
                .for_each(|(largest, term)| *largest = largest.max(term.residue_per_kg.abs()));
        }
        let most = largest.iter().copied().fold(0.0, f64::max);
        largest
            .iter()
            .map(|largest| *largest > SHOWN_RATIO * most)
            .collect()
    }

    /// Where two modes have the closest frequencies (the veering point), by golden section around the closest values of
    /// the path.
    pub fn meeting(&mut self, pair: [usize; 2]) -> Result<(Meeting, ModesAt), E> {
        let closest = self.closest(pair);
        let at = self.path[closest].clone();
        if closest == 0 || closest + 1 == self.path.len() {
            return Ok((Meeting::AtTheEnd, at));
        }
        if at.are_equal(pair) {
            return Ok((Meeting::Crossing, at));
        }
        self.golden(
            pair,
            self.path[closest - 1].value,
            self.path[closest + 1].value,
        )?;
        let at = self.path[self.closest(pair)].clone();
        Ok((
            if at.are_equal(pair) {
                Meeting::Crossing
            } else {
                Meeting::Veering
            },
            at,
        ))
    }

    fn closest(&self, pair: [usize; 2]) -> usize {
        let gap = |index: &usize| self.path[*index].gap_rad_s(pair);
        (0..self.path.len())
            .min_by(|a, b| gap(a).total_cmp(&gap(b)))
            .unwrap_or(0)
    }

    fn golden(&mut self, pair: [usize; 2], mut low: f64, mut high: f64) -> Result<(), E> {
        let ratio = 0.5 * (5f64.sqrt() - 1.0);
        let mut left = self.probe(pair, high - ratio * (high - low))?;
        let mut right = self.probe(pair, low + ratio * (high - low))?;
        for _ in 0..GOLDEN_STEPS {
            if left.1 < right.1 {
                (high, right) = (right.0, left);
                left = self.probe(pair, high - ratio * (high - low))?;
            } else {
                (low, left) = (left.0, right);
                right = self.probe(pair, low + ratio * (high - low))?;
            }
        }
        Ok(())
    }

    /// A value between those of the path, and the gap of two modes there.
    fn probe(&mut self, pair: [usize; 2], value: f64) -> Result<(f64, f64), E> {
        Ok((value, self.at(value)?.gap_rad_s(pair)))
    }

    /// The modes at any value of the range, followed from those before it.
    pub fn at(&mut self, value: f64) -> Result<&ModesAt, E> {
        let rising = self.path[0].value < self.path[self.path.len() - 1].value;
        let index = self.path.partition_point(|at| {
            if rising {
                at.value <= value
            } else {
                at.value >= value
            }
        });
        // The range is that of the path, so that some value comes before.
        let known = self.path[index.max(1) - 1].value == value;
        let index = if known {
            index.max(1) - 1
        } else {
            self.extend(index.max(1), value)?
        };
        Ok(&self.path[index])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
        (0..count)
            .map(|k| from + (to - from) * k as f64 / (count - 1) as f64)
            .collect()
    }

    #[test]
    fn two_coupled_oscillators_veer_by_the_coupling() {
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
    fn two_separate_oscillators_cross_and_keep_their_shapes() {
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
    fn loci_that_are_closest_at_an_end_do_not_meet() {
        let mut loci = Loci::follow(&grid(1.0, 9.0, 9), oscillators(0.1)).unwrap();
        let (meeting, at) = loci.meeting([0, 1]).unwrap();
        assert_eq!((meeting, at.value), (Meeting::AtTheEnd, 1.0));
        // Equal at the first value: of all bases there, the shapes that the modes have beside it.
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
        fn followed_modes_stay_followed(
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
