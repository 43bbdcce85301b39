//! All modes of a plant at one value of a setting, comparable with those at another value.

use nalgebra::{DMatrix, DVector};

use super::CloseModes;
use bench_base::numeric::assign;
use bench_plant::zeros::ModalTerm;
use bench_plant::{ModalModel, Mode, PlantError, Structure};

/// Eigenvalues have an error of some 1e-15 of the largest: two that differ by less than this ratio of it are equal.
const EQUAL_RATIO: f64 = 1e-12;
/// Rounding error of a modal gain that is caused by another mode, times ten.
const ROUNDED_GAIN: f64 = 1e-14;
/// A MAC above this value identifies a mode uniquely.
const CLEAR_MAC: f64 = 0.5;

/// All modes at one value of the setting. An index denotes the same mode at every value.
#[derive(Clone, Debug, PartialEq)]
pub struct ModesAt {
    /// The value of the setting.
    pub value: f64,
    /// Undamped natural frequencies.
    pub omega_rad_s: Vec<f64>,
    /// Shapes of unit modal mass, one per column, degrees of freedom x modes; signs are continuous from value to
    /// value.
    pub(super) shapes: DMatrix<f64>,
    structure: Structure,
}

impl ModesAt {
    pub(super) fn of(structure: Structure, value: f64) -> Result<ModesAt, PlantError> {
        let modal = ModalModel::of(&structure)?;
        let unit_mass = |mode: &Mode| {
            let modal_mass = mode.shape.dot(&(&structure.mass * &mode.shape));
            &mode.shape / modal_mass.sqrt()
        };
        let columns: Vec<_> = modal.modes.iter().map(unit_mass).collect();
        Ok(ModesAt {
            value,
            omega_rad_s: modal.modes.iter().map(|mode| mode.omega_rad_s).collect(),
            shapes: DMatrix::from_columns(&columns),
            structure,
        })
    }

    /// The plant at this value.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// Number of modes.
    pub(super) fn count(&self) -> usize {
        self.omega_rad_s.len()
    }

    /// row^T v for the shape v of unit modal mass, in 1/sqrt(kg): the displacement row^T z of the mode, and its modal force
    /// per newton along the row.
    pub fn gain(&self, mode: usize, row: &DVector<f64>) -> f64 {
        row.dot(&self.shapes.column(mode))
    }

    /// v^T M w of a mode here with a mode there, both of unit modal mass: the cosine between them, with its sign.
    pub fn cosine(&self, mode: usize, there: &ModesAt, other: usize) -> f64 {
        let mass = self.mean_mass(there);
        self.shapes
            .column(mode)
            .dot(&(mass * there.shapes.column(other)))
    }

    fn mean_mass(&self, there: &ModesAt) -> DMatrix<f64> {
        0.5 * (&self.structure.mass + &there.structure.mass)
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

    /// The undamped modes between a force along `force` and a displacement along `sensor` (Eq. 4-15), each at its index. A
    /// gain that is rounding is 0: a mode that cannot be observed has no sign.
    pub fn terms(&self, force: &DVector<f64>, sensor: &DVector<f64>) -> Vec<ModalTerm> {
        let residues = self.gains(force).into_iter().zip(self.gains(sensor));
        let frequencies = self.omega_rad_s.iter();
        frequencies
            .zip(residues)
            .map(|(w, (force, sensor))| ModalTerm::undamped(*w, force * sensor))
            .collect()
    }

    /// Two modes with the remainder of all `terms`; `None` where the modes cross.
    pub(super) fn close_modes(&self, terms: &[ModalTerm], pair: [usize; 2]) -> Option<CloseModes> {
        if self.are_equal(pair) {
            None
        } else {
            CloseModes::of(terms, pair)
        }
    }

    /// Gains of all modes; 0 where they are rounding.
    pub(super) fn gains(&self, row: &DVector<f64>) -> Vec<f64> {
        let gains: Vec<f64> = (0..self.count()).map(|mode| self.gain(mode, row)).collect();
        let rounded = |i: usize| {
            if gains[i].abs() <= self.rounding(&gains, i) {
                0.0
            } else {
                gains[i]
            }
        };
        (0..gains.len()).map(rounded).collect()
    }

    /// Rounding error of a modal gain: each shape contains other shapes with a relative amplitude of about 1e-15
    /// w_max^2/|w_i^2 - w_j^2|.
    fn rounding(&self, gains: &[f64], i: usize) -> f64 {
        let largest = self.largest_square();
        let parts = gains.iter().enumerate().map(|(j, gain)| {
            let (wi, wj) = (self.omega_rad_s[i], self.omega_rad_s[j]);
            let leak = if i == j {
                1.0
            } else {
                largest / ((wi - wj) * (wi + wj)).abs()
            };
            gain.abs() * leak
        });
        ROUNDED_GAIN * parts.sum::<f64>()
    }

    fn largest_square(&self) -> f64 {
        let squares = self.omega_rad_s.iter().map(|w| w * w);
        squares.fold(0.0, f64::max)
    }

    /// The shape of a mode over the degrees of freedom, of unit length.
    pub fn shape(&self, mode: usize) -> Vec<f64> {
        let shape = self.shapes.column(mode).normalize();
        shape.iter().copied().collect()
    }

    /// The share of each degree of freedom in a shape: the squares of its elements at unit length. They sum to 1; a share
    /// near 1 is a mode localised there.
    pub fn shares(&self, mode: usize) -> Vec<f64> {
        self.shape(mode).into_iter().map(|x| x * x).collect()
    }

    /// MAC of a mode here with a mode there.
    pub fn mac(&self, mode: usize, there: &ModesAt, other: usize) -> f64 {
        let mass = self.mean_mass(there);
        let (v, w) = (self.shapes.column(mode), there.shapes.column(other));
        let product = v.dot(&(&mass * w));
        product * product / (v.dot(&(&mass * v)) * w.dot(&(&mass * w)))
    }

    /// |w_i - w_j| in rad/s.
    pub fn gap_rad_s(&self, [i, j]: [usize; 2]) -> f64 {
        (self.omega_rad_s[i] - self.omega_rad_s[j]).abs()
    }

    /// |w_i - w_j|/(w_i + w_j).
    pub fn relative_gap(&self, pair: [usize; 2]) -> f64 {
        let [i, j] = pair;
        self.gap_rad_s(pair) / (self.omega_rad_s[i] + self.omega_rad_s[j])
    }

    /// Mean frequency of two modes in rad/s.
    pub fn mean_rad_s(&self, [i, j]: [usize; 2]) -> f64 {
        0.5 * (self.omega_rad_s[i] + self.omega_rad_s[j])
    }

    /// Whether the eigenvalues w^2 of two modes are equal to rounding.
    pub fn are_equal(&self, [i, j]: [usize; 2]) -> bool {
        let square = |mode: usize| self.omega_rad_s[mode] * self.omega_rad_s[mode];
        (square(i) - square(j)).abs() <= EQUAL_RATIO * self.largest_square()
    }

    /// These modes in the order and with the signs of those before.
    pub(super) fn following(mut self, before: &ModesAt) -> ModesAt {
        self.align_equal_modes(before);
        let places = continuations(before, &self);
        let mass = before.mean_mass(&self);
        let mut shapes = self.shapes.select_columns(&places);
        for (index, mut shape) in shapes.column_iter_mut().enumerate() {
            if before.shapes.column(index).dot(&(&mass * &shape)) < 0.0 {
                shape *= -1.0;
            }
        }
        let omega_rad_s = places
            .iter()
            .map(|place| self.omega_rad_s[*place])
            .collect();
        ModesAt {
            omega_rad_s,
            shapes,
            ..self
        }
    }

    /// Turns the basis of each group of equal modes (in order of frequency, as computed) to the nearest modes before.
    fn align_equal_modes(&mut self, before: &ModesAt) {
        let mut first = 0;
        while first < self.count() {
            let equal =
                (first + 1..self.count()).take_while(|next| self.are_equal([next - 1, *next]));
            let count = 1 + equal.count();
            if count > 1 {
                self.align(before, first, count);
            }
            first += count;
        }
    }

    /// With C = P^T M G of the k modes P that overlap most with the group G and C = U S W^T, the basis G W U^T.
    fn align(&mut self, before: &ModesAt, first: usize, count: usize) {
        let group = self.shapes.columns(first, count).into_owned();
        let overlap = before.shapes.transpose() * &self.structure.mass * &group;
        let rows = largest_rows(&overlap, count);
        let svd = overlap.select_rows(&rows).svd(true, true);
        if let (Some(u), Some(w_t)) = (svd.u, svd.v_t) {
            let aligned = group * (u * w_t).transpose();
            self.shapes.columns_mut(first, count).copy_from(&aligned);
        }
    }

    /// Whether each mode has a clear continuation in `next` by its shape, and no two modes change their order.
    pub(super) fn continues_in(&self, next: &ModesAt) -> bool {
        let n = self.count();
        let keeps_order = |i: usize, j: usize| self.order(i, j) * next.order(i, j) >= 0.0;
        (0..n).all(|mode| self.mac(mode, next, mode) > CLEAR_MAC)
            && (0..n).all(|i| (0..i).all(|j| keeps_order(i, j)))
    }

    /// 1 or -1 as mode i is faster or slower than mode j; 0 where they are equal.
    fn order(&self, i: usize, j: usize) -> f64 {
        if self.are_equal([i, j]) {
            0.0
        } else {
            (self.omega_rad_s[i] - self.omega_rad_s[j]).signum()
        }
    }
}

/// The indices of the rows of the largest norm.
fn largest_rows(matrix: &DMatrix<f64>, count: usize) -> Vec<usize> {
    let size = |i: usize| matrix.row(i).norm_squared();
    let mut order: Vec<usize> = (0..matrix.nrows()).collect();
    order.sort_by(|&i, &j| size(j).total_cmp(&size(i)));
    order.truncate(count);
    order
}

/// For each mode before the index of its continuation: the most similar pairs first.
fn continuations(before: &ModesAt, after: &ModesAt) -> Vec<usize> {
    let n = before.count();
    let continuations = assign(n, n, |i, j| -before.mac(i, after, j));
    let places = continuations.into_iter().enumerate();
    places.map(|(i, place)| place.unwrap_or(i)).collect()
}
