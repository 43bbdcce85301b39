//! Normal equations of weighted complex data that real parameters explain.

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};

/// J^T W J and J^T W e, real and imaginary parts as data of their own.
pub(super) struct Normal {
    square: DMatrix<f64>,
    pub(super) right: DVector<f64>,
    /// Of the row at hand, weighted.
    re: Vec<f64>,
    im: Vec<f64>,
}

impl Normal {
    pub(super) fn of_size(n: usize) -> Self {
        Self {
            square: DMatrix::zeros(n, n),
            right: DVector::zeros(n),
            re: vec![0.0; n],
            im: vec![0.0; n],
        }
    }

    /// A datum: the slopes of the model there, what it has beyond the model, and the square root of its weight.
    pub(super) fn add(&mut self, slopes: &[Complex<f64>], left: Complex<f64>, root: f64) {
        let Self {
            square,
            right,
            re,
            im,
        } = self;
        for ((re, im), slope) in re.iter_mut().zip(&mut *im).zip(slopes) {
            (*re, *im) = (slope.re * root, slope.im * root);
        }
        let left = left * root;
        // Columns lie together: the lower triangle, column by column.
        for (i, column) in square
            .as_mut_slice()
            .chunks_exact_mut(slopes.len())
            .enumerate()
        {
            right[i] += re[i] * left.re + im[i] * left.im;
            let others = re[i..].iter().zip(&im[i..]);
            column[i..]
                .iter_mut()
                .zip(others)
                .for_each(|(sum, (r, m))| *sum += re[i] * r + im[i] * m);
        }
    }

    /// 1/sqrt of the diagonal, and J^T W J with a diagonal of 1; none if it is not what it should be.
    pub(super) fn scaled(&self) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let diagonal = self.square.diagonal();
        if !diagonal.iter().all(|d| d.is_finite() && *d > 0.0) {
            return None;
        }
        let scale = diagonal.map(|d| 1.0 / d.sqrt());
        let below = |i: usize, j: usize| self.square[(i.max(j), i.min(j))];
        let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
            below(i, j) * scale[i] * scale[j]
        });
        Some((scale, scaled))
    }

    /// (A + diag of what `damping` says)^-1 b, in coordinates of a unit diagonal.
    pub(super) fn solve(&self, damping: impl Fn(usize) -> f64) -> Option<DVector<f64>> {
        let (scale, mut ridge) = self.scaled()?;
        for i in 0..scale.len() {
            ridge[(i, i)] += damping(i);
        }
        let solved = Cholesky::<f64, Dyn>::new(ridge)?.solve(&self.right.component_mul(&scale));
        Some(solved.component_mul(&scale))
    }

    /// By how much a step would lower the squares if the model were linear: 2 b x - x A x.
    pub(super) fn promised(&self, step: &DVector<f64>) -> f64 {
        let n = step.len();
        let row = |i: usize| {
            (0..n)
                .map(|j| self.square[(i.max(j), i.min(j))] * step[j])
                .sum::<f64>()
        };
        (0..n)
            .map(|i| step[i] * (2.0 * self.right[i] - row(i)))
            .sum()
    }
}
