//! What a spike or a step of the output adds to the errors of its prediction from the samples before, with coefficients a_i:
//!
//! ```text
//! spike of one sample of height h     e = h (1, -a_1, -a_2, ...)
//! step of height h                    e = h (1, 1 - a_1, 1 - a_1 - a_2, ...)
//! ```

use nalgebra::{Cholesky, DMatrix, DVector};

/// A spike is at most this many samples long.
pub(super) const MAX_SPIKE: usize = 4;
/// A spike or a step explains errors if at most this ratio of their squares remains. Of the smallest outlier, 20 standard deviations,
/// noise in 11 further samples leaves 3 %.
const MAX_UNEXPLAINED: f64 = 0.1;

/// What is added to the true output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// A height of its own in each of a few samples.
    Spike {
        /// Number of samples.
        samples: usize,
    },
    /// The same height in all samples that follow.
    Step,
}

/// Where a spike or a step begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) at: usize,
    pub(super) shape: Shape,
}

/// A spike or a step that describes errors of a prediction best.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outlier {
    pub(super) place: Place,
    /// The height with the largest magnitude.
    pub(super) height: f64,
    /// Whether little else remains of the errors, as after a force that is not in the input.
    pub(super) is_explained: bool,
}

/// The heights of a shape by least squares.
pub(super) struct Fitted {
    pub(super) heights: Vec<f64>,
    /// Sum of the squares of the errors that remain.
    remainder: f64,
}

/// The effect of spikes and steps on the errors of a prediction.
#[derive(Clone, Debug)]
pub(super) struct Patterns {
    /// That of a spike of one sample: 1, -a_1, -a_2, ...
    single: Vec<f64>,
}

impl Patterns {
    /// With the coefficients of the samples before, the last one first.
    pub(super) fn new(coefficients: &[f64]) -> Patterns {
        let others = coefficients.iter().map(|a| -a);
        Patterns {
            single: std::iter::once(1.0).chain(others).collect(),
        }
    }

    /// The standard deviation of the errors for white noise of 1 in the output: sqrt(1 + sum a_i^2).
    pub(super) fn gain(&self) -> f64 {
        self.single.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// The correlation of two errors this many samples apart, for white noise in the output: sum c_i c_(i + lag)/sum c_i^2.
    pub(super) fn correlation(&self, lag: usize) -> f64 {
        let pairs = self.single.iter().zip(self.single.iter().skip(lag));
        pairs.map(|(a, b)| a * b).sum::<f64>() / self.gain().powi(2)
    }

    /// The spike or the step that describes the errors from sample `at` on: of the spikes the shortest one that explains them.
    pub(super) fn outlier(&self, errors: &[f64], at: usize) -> Option<Outlier> {
        let total: f64 = errors.iter().map(|e| e * e).sum();
        let explains = |fitted: &Fitted| fitted.remainder <= MAX_UNEXPLAINED * total;
        let longest = MAX_SPIKE.min(errors.len());
        let mut spike = (1, self.fitted(errors, Shape::Spike { samples: 1 })?);
        for samples in 2..=longest {
            if !explains(&spike.1) {
                spike = (samples, self.fitted(errors, Shape::Spike { samples })?);
            }
        }
        let (samples, spike) = spike;
        let step = self.fitted(errors, Shape::Step)?;
        let variance = |fitted: &Fitted| {
            fitted.remainder / errors.len().saturating_sub(fitted.heights.len()).max(1) as f64
        };
        let (shape, best) = if variance(&step) < variance(&spike) {
            (Shape::Step, step)
        } else {
            (Shape::Spike { samples }, spike)
        };
        Some(Outlier {
            place: Place { at, shape },
            height: largest(&best.heights),
            is_explained: explains(&best),
        })
    }

    /// The heights of a shape that begins with the first of the errors.
    pub(super) fn fitted(&self, errors: &[f64], shape: Shape) -> Option<Fitted> {
        let columns = match shape {
            Shape::Spike { samples } => samples,
            Shape::Step => 1,
        };
        let matrix = DMatrix::from_fn(errors.len(), columns, |row, column| match shape {
            Shape::Spike { .. } => self.after(row, column),
            Shape::Step => (0..=row).map(|column| self.after(row, column)).sum(),
        });
        let errors = DVector::from_column_slice(errors);
        let right = matrix.tr_mul(&errors);
        let heights = Cholesky::new(matrix.tr_mul(&matrix))?.solve(&right);
        let remainder = (errors - matrix * &heights).norm_squared();
        Some(Fitted {
            heights: heights.as_slice().to_vec(),
            remainder,
        })
    }

    /// The error of a sample after a height of 1 in another one.
    fn after(&self, sample: usize, of: usize) -> f64 {
        let distance = sample.checked_sub(of);
        let error = distance.and_then(|distance| self.single.get(distance));
        error.copied().unwrap_or(0.0)
    }
}

/// The number with the largest magnitude.
fn largest(numbers: &[f64]) -> f64 {
    let by_magnitude = |a: &&f64, b: &&f64| a.abs().total_cmp(&b.abs());
    numbers
        .iter()
        .max_by(by_magnitude)
        .copied()
        .unwrap_or_default()
}
