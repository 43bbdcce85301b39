//! The noise of a response that came without standard deviations, from its scatter about local models.
//!
//! A response is smooth and its noise is not: around each frequency a model of few parameters is fitted to the neighbouring points, and
//! what remains is noise,
//!
//! ```text
//! E|error of H|^2 = sum |residual|^2 / (points - parameters)
//!
//! parabola    H = b0 + b1 x + b2 x^2                    x: frequency from the centre
//! with pole   H = (b0 + b1 x + b2 x^2) / (1 + a x)      a mode, resolved by the points or not, and the rest of the response
//! ```
//!
//! The model with a pole is fitted with the weights 1/|1 + a x| of the iteration before (C. Sanathanan, J. Koerner, IEEE Trans. Autom.
//! Control 8 (1963) 56), so that its residuals are those of the response. Over 17 points the parabola leaves 28 real degrees of
//! freedom: the standard deviation has a relative deviation of 13 %. Where a model does not describe the response, such as between two
//! modes that are a few points apart, the noise comes out too large. A further model is used only where its estimate is smaller by more
//! than noise explains, so that the smallest of several estimates is not chosen.
//!
//! The noise is of equal power over a neighbourhood, or in the ratio of the response as on a resonance that amplifies it: what makes the
//! residuals more probable.
//!
//! Errors of neighbouring points are correlated if a window couples the lines (Hann, with random excitation: (2/3)^2), or if the
//! response was smoothed. A model follows such errors, and its residuals are too small and correlated themselves. Where they are,
//! every second point is used, or every fourth, and so on, until they are not; so many points are also the resolution of the response.

use std::cmp::Ordering;

use nalgebra::Complex;
use serde::Serialize;

use super::local_model::least_squares;

/// Where the standard deviations of a response come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SigmaSource {
    /// The file or the recording.
    #[default]
    Given,
    /// The scatter of the response, by [`Scatter`].
    Estimated,
}

/// The fewest points of a response whose noise can be estimated: those of the small neighbourhood.
pub const MIN_POINTS: usize = NEAR;
/// Points of a neighbourhood.
const WIDE: usize = 17;
/// Points of a small neighbourhood.
const NEAR: usize = 9;
/// Iterations of the weights of the model with a pole.
const ITERATIONS: usize = 3;

/// Smallest relative standard deviation: rounding to single precision, where rounding has made neighbours equal.
const ROUNDING: f64 = 1.0 / (1 << 24) as f64;

/// The models in the order in which they are tried. The limit is the largest ratio of the estimate to the one before at which the model
/// is used. With noise alone it is passed rarely: the pole takes half of the power of 14 degrees of freedom with a probability of
/// 17 (1/2)^13 = 0.2 %; chi-square over its degrees of freedom is below a fifth with 0.2 % for 12 and 0.4 % for 10 of them.
const MODELS: [Model; 4] = [
    Model {
        points: WIDE,
        curve: Curve::Parabola,
        limit: f64::INFINITY,
    },
    Model {
        points: WIDE,
        curve: Curve::WithPole,
        limit: 0.5,
    },
    Model {
        points: NEAR,
        curve: Curve::Parabola,
        limit: 0.2,
    },
    Model {
        points: NEAR,
        curve: Curve::WithPole,
        limit: 0.2,
    },
];

#[derive(Clone, Copy)]
enum Curve {
    Parabola,
    WithPole,
}

#[derive(Clone, Copy)]
struct Model {
    points: usize,
    curve: Curve,
    limit: f64,
}

/// Distances of the points that are used, in points.
const STRIDES: [usize; 6] = [1, 2, 4, 8, 16, 32];
/// Correlation of neighbouring residuals of the wide parabola above which errors are not independent. That of independent errors is
/// -0.1, because the model has removed their slow part; that of lines under a Hann window is 0.25.
const CORRELATED: f64 = 0.0;
/// The correlation is the lower quartile over so many points to either side: near a mode, which the parabola does not describe, the
/// residuals are correlated as well. The quartile of independent errors is -0.1 - 0.67/(2 14)^(1/2) = -0.23, that under a Hann window
/// 0.12.
const REACH: usize = 128;
/// The distance is the lower quartile over so many points to either side: it changes slowly, and near modes it seems to be larger.
const STRIDE_REACH: usize = 512;

/// The noise of a response.
#[derive(Clone, Debug, PartialEq)]
pub struct Scatter {
    /// E|error|^2 of each point.
    pub variance: Vec<f64>,
    /// Points at least this number of points apart have independent errors, at each point.
    pub correlated_points: Vec<usize>,
}

impl Scatter {
    /// The noise of a response at rising frequencies. `None` with fewer points than [`MIN_POINTS`], or where the response is zero.
    pub fn of(frequency_hz: &[f64], response: &[Complex<f64>]) -> Option<Scatter> {
        let count = frequency_hz.len().min(response.len());
        if count < MIN_POINTS {
            return None;
        }
        let mut estimates: Vec<Vec<PointEstimate>> = Vec::new();
        let mut independent = vec![None; count];
        for (step, stride) in STRIDES.into_iter().enumerate() {
            if step > 0 && count < 2 * stride * WIDE {
                break;
            }
            let at = |k| estimate(frequency_hz, response, k, stride);
            let found: Vec<PointEstimate> = (0..count).map(at).collect();
            for (k, first) in independent.iter_mut().enumerate() {
                let is_independent = low_correlation(&found, k) <= CORRELATED;
                *first = first.or(is_independent.then_some(step));
            }
            estimates.push(found);
            if independent.iter().all(Option::is_some) {
                break;
            }
        }
        let last = estimates.len() - 1;
        let steps: Vec<usize> = independent
            .iter()
            .map(|step| step.unwrap_or(last))
            .collect();
        let points = (0..count).map(|k| {
            let step = lower_quartile(&steps, k, STRIDE_REACH, usize::cmp);
            let least = ROUNDING * response[k].norm();
            (
                estimates[step][k].variance.max(least * least),
                STRIDES[step],
            )
        });
        let (variance, correlated_points): (Vec<f64>, Vec<usize>) = points.unzip();
        let is_noisy = variance.iter().all(|variance| *variance > 0.0);
        is_noisy.then_some(Scatter {
            variance,
            correlated_points,
        })
    }
}

/// The noise at a point by one neighbourhood.
#[derive(Clone, Copy)]
struct PointEstimate {
    variance: f64,
    /// Of neighbouring residuals of the first model: one with more parameters follows correlated errors.
    correlation: f64,
}

/// The lower quartile of the correlation around a point.
fn low_correlation(estimates: &[PointEstimate], k: usize) -> f64 {
    let by_correlation =
        |a: &PointEstimate, b: &PointEstimate| a.correlation.total_cmp(&b.correlation);
    lower_quartile(estimates, k, REACH, by_correlation).correlation
}

/// The lower quartile of some values up to `reach` to either side.
fn lower_quartile<T: Copy>(
    values: &[T],
    k: usize,
    reach: usize,
    order: impl FnMut(&T, &T) -> Ordering,
) -> T {
    let last = (k + reach + 1).min(values.len());
    let mut near = values[k.saturating_sub(reach)..last].to_vec();
    let quarter = near.len() / 4;
    *near.select_nth_unstable_by(quarter, order).1
}

/// The noise at a point by the first model that describes its neighbourhood.
fn estimate(
    frequency_hz: &[f64],
    response: &[Complex<f64>],
    k: usize,
    stride: usize,
) -> PointEstimate {
    let mut best: Option<(Neighbourhood, Curve, Fit)> = None;
    let mut correlation = None;
    for model in MODELS {
        let near = Neighbourhood::of(frequency_hz, response, k, model.points, stride);
        let equal = vec![1.0; near.x.len()];
        let Some(fit) = near.fit(model.curve, equal) else {
            continue;
        };
        correlation.get_or_insert_with(|| fit.correlation());
        let least = best
            .as_ref()
            .map_or(f64::INFINITY, |(_, _, fit)| fit.variance);
        if fit.variance <= model.limit * least {
            best = Some((near, model.curve, fit));
        }
    }
    let variance = best.map(|(near, curve, fit)| near.variance_at_centre(curve, &fit));
    PointEstimate {
        variance: variance.unwrap_or(f64::INFINITY),
        correlation: correlation.unwrap_or_default(),
    }
}

/// A model fitted to a neighbourhood.
struct Fit {
    /// The weights of the points.
    weight: Vec<f64>,
    /// The model.
    model: Vec<Complex<f64>>,
    /// What the weighted least squares leave.
    residual: Vec<Complex<f64>>,
    /// The power of the residuals over the degrees of freedom.
    variance: f64,
}

impl Fit {
    fn new(
        weight: Vec<f64>,
        model: Vec<Complex<f64>>,
        residual: Vec<Complex<f64>>,
        parameters: usize,
    ) -> Option<Fit> {
        let freedom = residual.len().checked_sub(parameters)?;
        let power: f64 = residual.iter().map(|r| r.norm_sqr()).sum();
        let variance = power / freedom as f64;
        variance.is_finite().then_some(Fit {
            weight,
            model,
            residual,
            variance,
        })
    }

    /// Of neighbouring residuals.
    fn correlation(&self) -> f64 {
        let products = self.residual.windows(2).map(|r| (r[1] * r[0].conj()).re);
        let power: f64 = self.residual.iter().map(|r| r.norm_sqr()).sum();
        if power > 0.0 {
            products.sum::<f64>() / power
        } else {
            0.0
        }
    }

    /// -ln of the likelihood of the residuals for each point, with variances in the ratio 1/weight^2.
    fn negative_log_likelihood(&self) -> f64 {
        let logs: f64 = self.weight.iter().map(|weight| weight.ln()).sum();
        self.variance.ln() - 2.0 * logs / self.weight.len() as f64
    }
}

/// Points around a frequency.
struct Neighbourhood {
    /// Frequencies from that of the centre, over the extent.
    x: Vec<f64>,
    response: Vec<Complex<f64>>,
    /// Index of the centre.
    centre: usize,
}

impl Neighbourhood {
    /// At most `points` points around the point k, which is one of them, at a distance of `stride` points.
    fn of(
        frequency_hz: &[f64],
        response: &[Complex<f64>],
        k: usize,
        points: usize,
        stride: usize,
    ) -> Neighbourhood {
        let (below, above) = (k / stride, (response.len() - 1 - k) / stride);
        let points = points.min(below + above + 1);
        let centre = (points / 2)
            .min(below)
            .max(points.saturating_sub(above + 1));
        let at = |i: usize| k + stride * i - stride * centre;
        let extent = frequency_hz[at(points - 1)] - frequency_hz[at(0)];
        let x = (0..points).map(|i| (frequency_hz[at(i)] - frequency_hz[k]) / extent);
        Neighbourhood {
            x: x.collect(),
            response: (0..points).map(|i| response[at(i)]).collect(),
            centre,
        }
    }

    /// The variance by equal errors, or by errors in the ratio of the response if these are more probable.
    fn variance_at_centre(&self, curve: Curve, equal: &Fit) -> f64 {
        let weight = equal.model.iter().map(|model| 1.0 / model.norm());
        match self.fit(curve, weight.collect()) {
            Some(fit) if fit.negative_log_likelihood() < equal.negative_log_likelihood() => {
                fit.variance / fit.weight[self.centre].powi(2)
            }
            _ => equal.variance,
        }
    }

    fn fit(&self, curve: Curve, weight: Vec<f64>) -> Option<Fit> {
        match curve {
            Curve::Parabola => self.parabola(weight),
            Curve::WithPole => self.with_pole(weight),
        }
    }

    fn parabola(&self, weight: Vec<f64>) -> Option<Fit> {
        let columns = self.powers().map(|column| weighted(column, &weight));
        let right = weighted(self.response.clone(), &weight);
        let fit = least_squares::solve(columns.to_vec(), right)?;
        let model = self.polynomial(&fit.solution);
        Fit::new(weight, model, fit.residual, columns.len())
    }

    /// (1 + a x) H - b0 - b1 x - b2 x^2, divided by |1 + a x| of the iteration before.
    fn with_pole(&self, weight: Vec<f64>) -> Option<Fit> {
        let mut pole = Complex::default();
        let (mut model, mut residual) = (Vec::new(), Vec::new());
        for _ in 0..ITERATIONS {
            let denominators = self.x.iter().map(|x| (pole * *x + 1.0).norm());
            let weight = weight.iter().zip(denominators).map(|(w, d)| w / d);
            let weight: Vec<f64> = weight.collect();
            let slope = self.response.iter().zip(&self.x).map(|(h, x)| -h * *x);
            let columns = self.powers().into_iter().chain([slope.collect()]);
            let columns = columns.map(|column| weighted(column, &weight));
            let right = weighted(self.response.clone(), &weight);
            let fit = least_squares::solve(columns.collect(), right)?;
            pole = fit.solution[3];
            let numerator = self.polynomial(&fit.solution[..3]);
            let values = numerator.iter().zip(&self.x);
            model = values.map(|(b, x)| b / (pole * *x + 1.0)).collect();
            residual = fit.residual;
        }
        Fit::new(weight, model, residual, 4)
    }

    /// The sum of powers of x with these coefficients.
    fn polynomial(&self, coefficients: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let value = |x: &f64| {
            let terms = coefficients.iter().rev();
            terms.fold(Complex::default(), |sum, b| sum * *x + b)
        };
        self.x.iter().map(value).collect()
    }

    /// 1, x and x^2.
    fn powers(&self) -> [Vec<Complex<f64>>; 3] {
        [0, 1, 2].map(|power| self.x.iter().map(|x| x.powi(power).into()).collect())
    }
}

fn weighted(column: Vec<Complex<f64>>, weight: &[f64]) -> Vec<Complex<f64>> {
    column.iter().zip(weight).map(|(c, w)| c * *w).collect()
}

#[cfg(test)]
mod tests;
