//! Normal equations of weighted complex data with real parameters.

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};

/// J^T W J and J^T W e; real and imaginary parts are separate data points.
pub(super) struct NormalEquations {
    /// J^T W J, lower triangle.
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    /// The current row, weighted.
    re: Vec<f64>,
    im: Vec<f64>,
}

impl NormalEquations {
    pub(super) fn new(parameters: usize) -> Self {
        Self {
            matrix: DMatrix::zeros(parameters, parameters),
            right: DVector::zeros(parameters),
            re: vec![0.0; parameters],
            im: vec![0.0; parameters],
        }
    }

    /// Adds a datum: the derivatives of its model, the residual, and the square root of its weight.
    pub(super) fn add(
        &mut self,
        derivatives: &[Complex<f64>],
        residual: Complex<f64>,
        root_weight: f64,
    ) {
        let rows = self.re.iter_mut().zip(&mut self.im);
        for ((re, im), derivative) in rows.zip(derivatives) {
            (*re, *im) = (derivative.re * root_weight, derivative.im * root_weight);
        }
        self.add_row(residual * root_weight);
    }

    /// Adds the products of the current row.
    fn add_row(&mut self, residual: Complex<f64>) {
        let (re, im) = (&self.re, &self.im);
        // The matrix is stored column by column.
        let columns = self.matrix.as_mut_slice().chunks_exact_mut(re.len());
        for (i, column) in columns.enumerate() {
            self.right[i] += re[i] * residual.re + im[i] * residual.im;
            for ((sum, r), m) in column[i..].iter_mut().zip(&re[i..]).zip(&im[i..]) {
                *sum += re[i] * r + im[i] * m;
            }
        }
    }

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
