//! Normal equations of weighted complex data with real parameters.

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};

use crate::FrfDatum;

/// Number of partial sums of a product, which the processor adds up side by side.
const LANES: usize = 8;

/// The columns of J, each datum weighted with the square root of 2/v: real and imaginary parts, one after the other.
pub(super) struct WeightedColumns {
    root_weights: Vec<f64>,
    columns: Vec<Vec<f64>>,
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

    fn weighted(&self, column: impl Iterator<Item = Complex<f64>>) -> Vec<f64> {
        let mut weighted = Vec::with_capacity(2 * self.root_weights.len());
        for (value, root_weight) in column.zip(&self.root_weights) {
            weighted.extend([value.re * root_weight, value.im * root_weight]);
        }
        weighted
    }

    /// The normal equations with the residual e.
    pub(super) fn normal_equations(
        &self,
        residual: impl Iterator<Item = Complex<f64>>,
    ) -> NormalEquations {
        let (columns, residual) = (&self.columns, self.weighted(residual));
        let right = columns.iter().map(|column| product(column, &residual));
        let mut matrix = DMatrix::zeros(columns.len(), columns.len());
        for (i, column) in columns.iter().enumerate() {
            for (j, other) in columns.iter().enumerate().skip(i) {
                matrix[(j, i)] = product(column, other);
            }
        }
        NormalEquations {
            right: DVector::from_iterator(columns.len(), right),
            matrix,
        }
    }
}

/// The sum of the products of two columns, in an order that is the same on every processor.
fn product(a: &[f64], b: &[f64]) -> f64 {
    let (a_blocks, b_blocks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest = a_blocks.remainder().iter().zip(b_blocks.remainder());
    let mut sums = [0.0; LANES];
    for (a, b) in a_blocks.zip(b_blocks) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest.map(|(a, b)| a * b).sum::<f64>()
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
