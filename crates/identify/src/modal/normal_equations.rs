//! Normal equations of weighted complex data with real parameters.

use multiversion::multiversion;
use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn, Matrix2};

use crate::FrfDatum;

/// Number of partial sums of a product, which the processor adds up side by side: so many that compilers make a loop of vectors of them.
const LANES: usize = 16;
/// Number of values of a column of which four products each are added to the partial sums.
const STEP: usize = 4 * LANES;
/// Number of values of each column that are multiplied at a time: those of all columns fit into the cache of a processor.
const BLOCK: usize = 512;

/// The columns of J, each datum weighted with the square root of 2/v: its real and its imaginary part.
pub(super) struct WeightedColumns {
    root_weights: Vec<f64>,
    columns: Vec<Vec<[f64; 2]>>,
}

impl WeightedColumns {
    pub(super) fn new(data: &[FrfDatum]) -> Self {
        let root_weights = data.iter().map(|datum| (2.0 / datum.variance).sqrt());
        Self {
            root_weights: root_weights.collect(),
            columns: Vec::new(),
        }
    }

    /// Adds the derivatives by one parameter.
    pub(super) fn add(&mut self, column: impl Iterator<Item = Complex<f64>>) {
        let column = self.weighted(column);
        self.columns.push(column);
    }

    fn weighted(&self, column: impl Iterator<Item = Complex<f64>>) -> Vec<[f64; 2]> {
        let weighted = column.zip(&self.root_weights);
        weighted
            .map(|(value, root_weight)| [value.re * root_weight, value.im * root_weight])
            .collect()
    }

    /// The normal equations with the residual e.
    pub(super) fn normal_equations(
        &self,
        residual: impl Iterator<Item = Complex<f64>>,
    ) -> NormalEquations {
        let n = self.columns.len();
        let residual = self.weighted(residual);
        let zeros = vec![0.0; 2 * residual.len()];
        let columns = self.columns.iter().chain([&residual]);
        let mut columns: Vec<&[f64]> = columns.map(|column| column.as_flattened()).collect();
        if columns.len() % 2 == 1 {
            columns.push(&zeros);
        }
        let products = products(&columns);
        NormalEquations {
            matrix: products.view((0, 0), (n, n)).into_owned(),
            right: DVector::from_fn(n, |i, _| products[(n, i)]),
        }
    }
}

/// The sums of the products of each two of an even number of columns of the same length, in the lower triangle. The order of the sums is the
/// same on every processor, whether or not it has instructions for more of the [`LANES`] at a time.
#[multiversion(targets("x86_64+avx2"))]
fn products(columns: &[&[f64]]) -> DMatrix<f64> {
    let n = columns.len();
    let length = columns.first().map_or(0, |column| column.len());
    let mut sums = DMatrix::zeros(n, n);
    for start in (0..length).step_by(BLOCK) {
        let block = start..(start + BLOCK).min(length);
        let pair = |i: usize| [0, 1].map(|k| &columns[i + k][block.clone()]);
        for i in (0..n).step_by(2) {
            for j in (i..n).step_by(2) {
                let mut tile = sums.fixed_view_mut::<2, 2>(j, i);
                tile += products_of_pairs(pair(j), pair(i));
            }
        }
    }
    sums
}

/// The sums of the products of each of two columns with each of two others: four products for four values that are read.
#[inline(always)]
fn products_of_pairs(rows: [&[f64]; 2], columns: [&[f64]; 2]) -> Matrix2<f64> {
    let [mut l00, mut l01, mut l10, mut l11] = [[0.0; LANES]; 4];
    for ((a0, a1), (b0, b1)) in steps_of(rows).zip(steps_of(columns)) {
        for lane in 0..LANES {
            l00[lane] += product_in_lane(a0, b0, lane);
            l01[lane] += product_in_lane(a0, b1, lane);
            l10[lane] += product_in_lane(a1, b0, lane);
            l11[lane] += product_in_lane(a1, b1, lane);
        }
    }
    let rest = rows[0].len() - rows[0].len() % STEP;
    let mut sums = Matrix2::zeros();
    for (i, lanes) in [[l00, l01], [l10, l11]].iter().enumerate() {
        for (j, lanes) in lanes.iter().enumerate() {
            let rest = rows[i][rest..].iter().zip(&columns[j][rest..]);
            sums[(i, j)] = sum_of_lanes(*lanes) + rest.map(|(a, b)| a * b).sum::<f64>();
        }
    }
    sums
}

/// The sum of the products of a step that belong to a partial sum.
#[inline(always)]
fn product_in_lane(a: &[f64], b: &[f64], lane: usize) -> f64 {
    let product = |term: usize| a[lane + term * LANES] * b[lane + term * LANES];
    (product(0) + product(1)) + (product(2) + product(3))
}

/// The sum of partial sums, by halves.
#[inline(always)]
fn sum_of_lanes(mut lanes: [f64; LANES]) -> f64 {
    let mut count = LANES;
    while count > 1 {
        count /= 2;
        for lane in 0..count {
            lanes[lane] += lanes[lane + count];
        }
    }
    lanes[0]
}

/// The values of two columns that are multiplied side by side.
#[inline(always)]
fn steps_of([first, second]: [&[f64]; 2]) -> impl Iterator<Item = (&[f64], &[f64])> {
    first.chunks_exact(STEP).zip(second.chunks_exact(STEP))
}

/// J^T W J and J^T W e; real and imaginary parts are separate data points.
pub(super) struct NormalEquations {
    /// J^T W J, lower triangle.
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

impl NormalEquations {
    /// Entry of the symmetric matrix.
    fn entry(&self, i: usize, j: usize) -> f64 {
        self.matrix[(i.max(j), i.min(j))]
    }

    /// 1/sqrt of the diagonal, and the matrix scaled to a diagonal of 1; `None` if a diagonal entry is not finite and positive.
    pub(super) fn scaled(&self) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let diagonal = self.matrix.diagonal();
        if !diagonal.iter().all(|d| d.is_finite() && *d > 0.0) {
            return None;
        }
        let scale = diagonal.map(|d| 1.0 / d.sqrt());
        let n = scale.len();
        let scaled = DMatrix::from_fn(n, n, |i, j| self.entry(i, j) * scale[i] * scale[j]);
        Some((scale, scaled))
    }

    /// The solution with `damping` added to the scaled diagonal.
    pub(super) fn solve(&self, damping: impl Fn(usize) -> f64) -> Option<DVector<f64>> {
        let (scale, mut damped) = self.scaled()?;
        for i in 0..scale.len() {
            damped[(i, i)] += damping(i);
        }
        let solution = Cholesky::<f64, Dyn>::new(damped)?.solve(&self.right.component_mul(&scale));
        Some(solution.component_mul(&scale))
    }

    /// The decrease of the sum of squares by a step, if the model were linear: 2 b x - x A x.
    pub(super) fn predicted_decrease(&self, step: &DVector<f64>) -> f64 {
        (0..step.len())
            .map(|i| step[i] * (2.0 * self.right[i] - self.row_times(i, step)))
            .sum()
    }

    /// Row `i` of the matrix times a vector.
    fn row_times(&self, i: usize, vector: &DVector<f64>) -> f64 {
        let products = vector.iter().enumerate();
        products.map(|(j, x)| self.entry(i, j) * x).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums of up to 1100 products of numbers below 1, in any order, differ by less than 1100 x 1100 x 1e-16.
    #[test]
    fn products_are_those_of_the_matrices() {
        for (count, length) in [
            (2, 0),
            (2, 1),
            (4, 7),
            (4, 8),
            (6, 512),
            (8, 513),
            (6, 1100),
        ] {
            let value = |k: usize, i: usize| ((31 * k + 17 * i + k * i) % 97) as f64 / 97.0 - 0.4;
            let matrix = DMatrix::from_fn(length, count, value);
            let columns: Vec<&[f64]> = (0..count)
                .map(|i| &matrix.as_slice()[i * length..(i + 1) * length])
                .collect();
            let (found, expected) = (products(&columns), matrix.tr_mul(&matrix));
            for i in 0..count {
                for j in 0..=i {
                    let error = (found[(i, j)] - expected[(i, j)]).abs();
                    assert!(error < 1.3e-10, "{count} {length}: {error}");
                }
            }
        }
    }

    /// One sum after the other, in the order of the documentation.
    fn product_one_by_one(a: &[f64], b: &[f64]) -> f64 {
        let blocks = a.chunks(BLOCK).zip(b.chunks(BLOCK));
        blocks.fold(0.0, |sum, (a, b)| {
            let whole = a.len() - a.len() % STEP;
            let of_lane = |lane: usize| {
                let steps = a[..whole].chunks(STEP).zip(b[..whole].chunks(STEP));
                steps.fold(0.0, |sum, (a, b)| {
                    let term = |k: usize| a[lane + k * LANES] * b[lane + k * LANES];
                    sum + ((term(0) + term(1)) + (term(2) + term(3)))
                })
            };
            let mut lanes: Vec<f64> = (0..LANES).map(of_lane).collect();
            while lanes.len() > 1 {
                let (low, high) = lanes.split_at(lanes.len() / 2);
                lanes = low.iter().zip(high).map(|(low, high)| low + high).collect();
            }
            let rest = a[whole..].iter().zip(&b[whole..]);
            sum + (lanes[0] + rest.map(|(a, b)| a * b).sum::<f64>())
        })
    }

    #[test]
    fn products_have_the_same_bits_whatever_instructions_compute_them() {
        for length in [5, 64, 200, 512, 1100] {
            let value = |k: usize, i: usize| 1.0 / (1.0 + (31 * k + 17 * i + k * i) as f64);
            let columns: Vec<Vec<f64>> = (0..4)
                .map(|i| (0..length).map(|k| value(k, i)).collect())
                .collect();
            let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            let found = products(&columns);
            for i in 0..4 {
                for j in 0..=i {
                    let expected = product_one_by_one(columns[i], columns[j]);
                    assert_eq!(found[(i, j)], expected, "{length} {i} {j}");
                }
            }
        }
    }

    #[test]
    fn odd_and_even_numbers_of_parameters_have_the_same_equations() {
        let datum = |k: usize| FrfDatum {
            frequency_hz: k as f64,
            spread_hz: 0.0,
            response: Complex::new(0.0, 0.0),
            variance: 2.0,
        };
        let data: Vec<FrfDatum> = (0..21).map(datum).collect();
        let column = |i: usize| (0..21).map(move |k| Complex::new((k % (i + 2)) as f64, i as f64));
        let equations = |count: usize| {
            let mut columns = WeightedColumns::new(&data);
            (0..count).for_each(|i| columns.add(column(i)));
            columns.normal_equations(column(9))
        };
        let larger = equations(5);
        for count in 1..5 {
            let smaller = equations(count);
            assert_eq!(smaller.right.len(), count);
            for i in 0..count {
                let dot = |a: usize, b: usize| -> f64 {
                    let products = column(a).zip(column(b));
                    products.map(|(a, b)| a.re * b.re + a.im * b.im).sum()
                };
                assert_eq!(smaller.right[i], dot(i, 9));
                assert_eq!(larger.right[i], dot(i, 9));
                for j in 0..count {
                    assert_eq!(smaller.entry(i, j), dot(i, j));
                    assert_eq!(larger.entry(i, j), dot(i, j));
                }
            }
        }
    }
}
