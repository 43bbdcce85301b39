//! The normal equations of a step to greater likelihood.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The normal equations of a step, scaled to a diagonal of 1.
pub(super) struct Equations {
    /// J' I J/s^2, scaled.
    matrix: DMatrix<f64>,
    /// J' g/s, scaled.
    right: DVector<f64>,
    /// The scale of each parameter.
    scale: DVector<f64>,
    /// g of each reading.
    pub(super) scores: Vec<f64>,
    /// I of each reading.
    pub(super) information: Vec<f64>,
}

impl Equations {
    /// The equations with a column of derivatives for each parameter.
    pub(super) fn new(
        columns: &[Vec<f64>],
        scores: Vec<f64>,
        information: Vec<f64>,
        sigma: f64,
    ) -> Equations {
        let n = columns.len();
        let weighted = weighted(columns, &information, sigma);
        let matrix = weighted.tr_mul(&weighted);
        let right = DVector::from_fn(n, |i, _| {
            let products = columns[i].iter().zip(&scores).map(|(x, g)| x * g);
            products.sum::<f64>() / sigma
        });
        let scale = matrix
            .diagonal()
            .map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
        let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
        Equations {
            matrix: scaled,
            right: right.component_mul(&scale),
            scale,
            scores,
            information,
        }
    }

    /// The step with `damping` added to the diagonal.
    pub(super) fn step(&self, damping: f64) -> Option<DVector<f64>> {
        let mut damped = self.matrix.clone();
        for i in 0..damped.nrows() {
            damped[(i, i)] += damping;
        }
        let step = Cholesky::<f64, Dyn>::new(damped)?.solve(&self.right);
        Some(step.component_mul(&self.scale))
    }

    /// The covariance of the parameters of the step.
    pub(super) fn inverse(&self) -> Option<DMatrix<f64>> {
        let inverse = Cholesky::<f64, Dyn>::new(self.matrix.clone())?.inverse();
        let n = inverse.nrows();
        Some(DMatrix::from_fn(n, n, |i, j| {
            inverse[(i, j)] * self.scale[i] * self.scale[j]
        }))
    }
}

/// sqrt(I) J/s, of the readings that have information.
fn weighted(columns: &[Vec<f64>], information: &[f64], sigma: f64) -> DMatrix<f64> {
    let readings = information.iter().enumerate();
    let informative = readings.filter(|(_, information)| **information > 0.0);
    let weights: Vec<(usize, f64)> = informative
        .map(|(k, information)| (k, information.sqrt() / sigma))
        .collect();
    let elements = columns
        .iter()
        .flat_map(|column| weights.iter().map(|(k, weight)| column[*k] * weight));
    DMatrix::from_iterator(weights.len(), columns.len(), elements)
}
