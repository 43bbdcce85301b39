//! Spikes and steps, found from the error of a prediction of each output sample by the samples before it and by the input (least
//! squares over the record):
//!
//! ```text
//! y_k = sum a_i y_(k-i) + sum b_j u_(k-j) + e_k           i = 1 .. 8, j = 0 .. 8
//! ```
//!
//! An error above 20 standard deviations of its neighbours (from their median magnitude) begins an outlier. Readings at irregular times have
//! errors in proportion to the speed of the output, and where it is fast their standard deviation counts. A spike counts if its square
//! exceeds 2 % of the energy of the noise over the record: smaller ones have no effect. Samples after a jump of the input, which
//! excites more than the prediction describes, do not count. In a periodic record such defects differ from period to period and count
//! as noise.

mod jitter;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::defect::Defect;
use super::outlier::{MAX_SPIKE, Outlier, Patterns, Place, Shape};
use crate::Signals;
use crate::mean;

/// Samples of the output, and of the input before the present one, in the prediction.
const ORDER: usize = 8;
/// Number of errors on which a spike has an effect.
pub(super) const REACH: usize = ORDER + MAX_SPIKE;
/// Coefficients of the prediction.
const COEFFICIENTS: usize = 2 * ORDER + 1;
/// The coefficients are determined from at most this many samples.
const MAX_EQUATIONS: usize = 100_000;
/// Added to the diagonal of the normal equations, relative to it: they are nearly singular for a slow signal.
const REGULARIZATION: f64 = 1e-12;
/// Number of samples whose errors are compared.
const BLOCK: usize = 2048;
/// Number of samples with about the same speed whose errors are compared.
const CLASS: usize = 256;
/// Errors of the prediction beyond this many standard deviations are no noise.
const DEFECT_SIGMAS: f64 = 20.0;
/// The median magnitude of normally distributed numbers of standard deviation 1.
const NORMAL_MEDIAN: f64 = 0.6745;
/// The input jumps if it changes by more than this multiple of its median change.
const JUMP_RATIO: f64 = 30.0;
/// An input that changes in less than one of so many samples is an impulse.
const IMPULSE_RATIO: usize = 100;
/// The square of a spike is at least this ratio of the energy of the noise.
const MIN_ENERGY_RATIO: f64 = 0.02;
/// A spike or a jump is larger than this number of steps of the output: rounding may add one half at each side of it.
const MIN_STEPS: f64 = 2.0;

/// The errors of the prediction of a record.
pub(super) struct Prediction<'a> {
    signals: &'a Signals,
    patterns: Patterns,
    /// Error of each sample; 0 of the first ones.
    error: Vec<f64>,
    /// Standard deviation of the errors of each block, at least that of rounding.
    sigma: Vec<f64>,
    /// The step of the output.
    step: f64,
}

impl<'a> Prediction<'a> {
    /// The prediction of an output whose values are multiples of `step`; 0 if they are not.
    pub(super) fn new(signals: &'a Signals, step: f64) -> Option<Self> {
        let scale = Scale::new(signals);
        let coefficients = coefficients(signals, &scale)?;
        let row_error = |k: usize| {
            let row = row(signals, &scale, k);
            let predicted: f64 = row
                .iter()
                .zip(coefficients.iter())
                .map(|(x, c)| x * c)
                .sum();
            (signals.output[k] - scale.offset) - predicted * scale.output
        };
        let mut error = vec![0.0; ORDER];
        error.extend((ORDER..signals.len()).map(row_error));
        // Output whose motion is below one step has no errors for a while, and then some of the size of the step.
        let patterns = Patterns::new(&coefficients.as_slice()[..ORDER]);
        let quantisation = step * patterns.gain() / 12.0_f64.sqrt();
        let rounding = f64::EPSILON * scale.output.max(scale.offset.abs());
        let rounding = rounding.max(quantisation);
        let blocks = error.chunks(BLOCK);
        let sigma = blocks
            .map(|block| sigma_by_median(block).max(rounding))
            .collect();
        Some(Self {
            signals,
            patterns,
            error,
            sigma,
            step,
        })
    }

    /// The standard deviation of white noise of the output that gives these errors.
    pub(super) fn noise(&self) -> f64 {
        self.median_sigma() / self.patterns.gain()
    }

    /// The median over the blocks.
    pub(super) fn median_sigma(&self) -> f64 {
        median(self.sigma.clone())
    }

    /// The first spike, the first step, and the first abrupt change.
    pub(super) fn jumps(&self) -> Vec<Defect> {
        let mut found: Vec<Defect> = Vec::new();
        for outlier in self.outliers() {
            let defect = self.defect(outlier);
            let is_new =
                |known: &Defect| std::mem::discriminant(known) != std::mem::discriminant(&defect);
            if found.iter().all(is_new) {
                found.push(defect);
            }
        }
        found
    }

    /// The spikes and steps that have an effect.
    pub(super) fn outliers(&self) -> Vec<Outlier> {
        let mut found = Vec::new();
        let is_above = |k: usize, sigma: f64| self.error[k].abs() > DEFECT_SIGMAS * sigma;
        let exceeds_neighbours = |k: &usize| is_above(*k, self.sigma[k / BLOCK]);
        let Some(first) = (ORDER..self.error.len()).find(exceeds_neighbours) else {
            return found;
        };
        let jumps_of_input = jumps(&self.signals.input);
        let noise = self.noise_by_speed();
        let mut k = first;
        while k < self.error.len() {
            if !is_above(k, noise.sigma[k]) || after_a_jump(&jumps_of_input, k) {
                k += 1;
                continue;
            }
            let outlier = self.patterns.outlier(self.errors_from(k), k);
            found.extend(outlier.filter(|outlier| self.has_effect(outlier, noise.energy)));
            k += REACH;
        }
        found
    }

    /// The noise with the errors in proportion to the speed of the output.
    fn noise_by_speed(&self) -> NoiseBySpeed {
        let output = &self.signals.output;
        let ratio = variance_by_speed(&speed_classes(output, &self.error));
        let sigma = |k: usize| {
            let by_speed = (ratio * speed_squared_before(output, k)).sqrt();
            by_speed.max(self.sigma[k / BLOCK])
        };
        let sigma: Vec<f64> = (0..self.error.len()).map(sigma).collect();
        NoiseBySpeed {
            energy: sigma.iter().map(|sigma| sigma * sigma).sum(),
            sigma,
        }
    }

    /// The heights of a spike or a step that begins at a known sample.
    pub(super) fn heights(&self, place: Place) -> Option<Vec<f64>> {
        let errors = self.errors_from(place.at);
        let fitted = self.patterns.fitted(errors, place.shape);
        fitted.map(|fitted| fitted.heights)
    }

    /// The errors on which a spike has an effect.
    fn errors_from(&self, k: usize) -> &[f64] {
        let end = (k + REACH).min(self.error.len());
        &self.error[k..end]
    }

    /// Whether an outlier matters beside the noise: it exceeds one step of the output, and a short spike has some of the noise's energy. A
    /// jump of less than [`DEFECT_SIGMAS`] of the output that does not explain the errors is none: after a hammer, errors of the prediction
    /// itself exceed the noise.
    fn has_effect(&self, outlier: &Outlier, energy: f64) -> bool {
        let Outlier { place, height, .. } = outlier;
        let exceeds_steps = height.abs() > MIN_STEPS * self.step;
        if place.shape == Shape::Step {
            let is_large = height.abs() > DEFECT_SIGMAS * self.noise();
            return exceeds_steps && (outlier.is_explained || is_large);
        }
        exceeds_steps && height * height > MIN_ENERGY_RATIO * energy
    }

    fn defect(&self, outlier: Outlier) -> Defect {
        let Outlier {
            place,
            height,
            is_explained,
        } = outlier;
        let time_s = place.at as f64 / self.signals.rate_hz;
        match place.shape {
            Shape::Spike { .. } => Defect::Spike { time_s, height },
            Shape::Step if is_explained => Defect::Step { time_s, height },
            Shape::Step => Defect::Abrupt { time_s },
        }
    }
}

/// The noise of the errors of each sample: that of its neighbours, or more where the output is fast.
struct NoiseBySpeed {
    /// Standard deviation of the error of each sample.
    sigma: Vec<f64>,
    /// Sum of its squares.
    energy: f64,
}

/// Scales that make both signals of size 1.
struct Scale {
    offset: f64,
    output: f64,
    input: f64,
}

impl Scale {
    fn new(signals: &Signals) -> Scale {
        let offset = mean::mean(&signals.output);
        let rms = |samples: &[f64], offset: f64| {
            let sum: f64 = samples.iter().map(|x| (x - offset) * (x - offset)).sum();
            (sum / samples.len() as f64).sqrt().max(f64::MIN_POSITIVE)
        };
        Scale {
            offset,
            output: rms(&signals.output, offset),
            input: rms(&signals.input, 0.0),
        }
    }
}

/// The scaled samples from which sample `k` is predicted.
fn row(signals: &Signals, scale: &Scale, k: usize) -> [f64; COEFFICIENTS] {
    std::array::from_fn(|i| {
        if i < ORDER {
            (signals.output[k - 1 - i] - scale.offset) / scale.output
        } else {
            signals.input[k - (i - ORDER)] / scale.input
        }
    })
}

/// The coefficients of the prediction by least squares.
fn coefficients(signals: &Signals, scale: &Scale) -> Option<DVector<f64>> {
    let mut matrix = DMatrix::<f64>::zeros(COEFFICIENTS, COEFFICIENTS);
    let mut right = DVector::<f64>::zeros(COEFFICIENTS);
    let step = (signals.len() / MAX_EQUATIONS).max(1);
    for k in (ORDER..signals.len()).step_by(step) {
        let row = row(signals, scale, k);
        let output = (signals.output[k] - scale.offset) / scale.output;
        for i in 0..COEFFICIENTS {
            for j in 0..=i {
                matrix[(i, j)] += row[i] * row[j];
            }
            right[i] += row[i] * output;
        }
    }
    let trace = matrix.trace();
    for i in 0..COEFFICIENTS {
        matrix[(i, i)] += REGULARIZATION * trace;
    }
    // Cholesky reads the lower triangle alone.
    Some(Cholesky::<f64, Dyn>::new(matrix)?.solve(&right))
}

/// Samples of about the same speed.
struct SpeedClass {
    largest_speed_squared: f64,
    /// The median.
    typical_speed_squared: f64,
    /// Of the errors, from their median magnitude.
    variance: f64,
}

/// Errors in proportion to the speed v of the output have the variance b v^2,
///
/// ```text
/// b = min over the classes of sigma^2/v^2, v the largest speed of the class
/// ```
///
/// With white noise alone, b is that of the fastest class, so that b v^2 is no more than the variance of the noise. Spikes raise the ratio of a
/// class and do not count. 0 without a class.
fn variance_by_speed(classes: &[SpeedClass]) -> f64 {
    let ratios = classes
        .iter()
        .map(|class| class.variance / class.largest_speed_squared);
    ratios.reduce(f64::min).unwrap_or(0.0)
}

/// The samples that move, in classes of rising speed; the slowest samples that fill none are left out.
fn speed_classes(output: &[f64], error: &[f64]) -> Vec<SpeedClass> {
    let every = (error.len() / MAX_EQUATIONS).max(1);
    let samples = (0..error.len()).step_by(every);
    let mut by_speed: Vec<(f64, f64)> = samples
        .map(|k| (speed_squared_before(output, k), error[k]))
        .collect();
    by_speed.sort_unstable_by(|(a, _), (b, _)| a.total_cmp(b));
    let moving = by_speed.partition_point(|(speed_squared, _)| *speed_squared == 0.0);
    let class = |alike: &[(f64, f64)]| {
        let errors: Vec<f64> = alike.iter().map(|(_, error)| *error).collect();
        SpeedClass {
            largest_speed_squared: alike[CLASS - 1].0,
            typical_speed_squared: alike[CLASS / 2].0,
            variance: sigma_by_median(&errors).powi(2),
        }
    };
    let classes = by_speed[moving..].rchunks_exact(CLASS).rev().map(class);
    classes.collect()
}

/// The mean square of the changes of the output before a sample, of as many as the prediction uses: the change to a spike is not one of
/// them.
fn speed_squared_before(output: &[f64], k: usize) -> f64 {
    let change = |k: usize| (output[k] - output[k - 1]).powi(2);
    let first = k.saturating_sub(ORDER).max(1);
    (first..k).map(change).sum::<f64>() / ORDER as f64
}

fn sigma_by_median(errors: &[f64]) -> f64 {
    median(errors.iter().map(|error| error.abs()).collect()) / NORMAL_MEDIAN
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// The indices at which a signal changes by far more than usual, if it seldom does.
fn jumps(samples: &[f64]) -> Vec<usize> {
    let changes: Vec<f64> = samples
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .collect();
    let limit = JUMP_RATIO * median(while_active(&changes).to_vec());
    let jumps = changes
        .iter()
        .enumerate()
        .filter(|(_, change)| **change > limit);
    jumps.map(|(k, _)| k + 1).collect()
}

/// The changes from the first to the last one that is not 0: a record may rest for longer than it is excited. All of a record whose input
/// is an impulse.
fn while_active(changes: &[f64]) -> &[f64] {
    let first = changes.iter().position(|change| *change > 0.0);
    let last = changes.iter().rposition(|change| *change > 0.0);
    let (Some(first), Some(last)) = (first, last) else {
        return changes;
    };
    let active = &changes[first..=last];
    if active.len() * IMPULSE_RATIO < changes.len() {
        changes
    } else {
        active
    }
}

/// Whether one of the jumps lies at most two orders of the prediction before a sample.
fn after_a_jump(jumps: &[usize], k: usize) -> bool {
    let next = jumps.partition_point(|jump| *jump <= k);
    next > 0 && k - jumps[next - 1] <= 2 * ORDER
}
