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
//! The errors of different points must be independent. A window that couples neighbouring lines makes the estimate smaller: a Hann
//! window with random excitation, whose lines have the correlation (2/3)^2, by 11 %.

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
    /// The scatter of the response, by [`variances`].
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

/// E|error|^2 of each point of a response at rising frequencies. `None` with fewer points than [`MIN_POINTS`], or where the response is
/// zero at all of them.
pub fn variances(frequency_hz: &[f64], response: &[Complex<f64>]) -> Option<Vec<f64>> {
    let count = frequency_hz.len().min(response.len());
    if count < MIN_POINTS {
        return None;
    }
    let found = (0..count).map(|k| {
        let least = ROUNDING * response[k].norm();
        variance(frequency_hz, response, k).max(least * least)
    });
    let found: Vec<f64> = found.collect();
    found
        .iter()
        .all(|variance| *variance > 0.0)
        .then_some(found)
}

/// E|error|^2 of a point by the first model that describes its neighbourhood.
fn variance(frequency_hz: &[f64], response: &[Complex<f64>], k: usize) -> f64 {
    let mut best: Option<(Neighbourhood<'_>, Curve, Fit)> = None;
    for model in MODELS {
        let near = Neighbourhood::of(frequency_hz, response, k, model.points);
        let equal = vec![1.0; near.x.len()];
        let Some(fit) = near.fit(model.curve, equal) else {
            continue;
        };
        let least = best
            .as_ref()
            .map_or(f64::INFINITY, |(_, _, fit)| fit.variance);
        if fit.variance <= model.limit * least {
            best = Some((near, model.curve, fit));
        }
    }
    best.map_or(f64::INFINITY, |(near, curve, fit)| {
        near.variance_at_centre(curve, &fit)
    })
}

/// A model fitted to a neighbourhood.
struct Fit {
    /// The weights of the points.
    weight: Vec<f64>,
    /// Response minus model, times the weights.
    residual: Vec<Complex<f64>>,
    /// The power of the residuals over the degrees of freedom.
    variance: f64,
}

impl Fit {
    fn new(weight: Vec<f64>, residual: Vec<Complex<f64>>, parameters: usize) -> Option<Fit> {
        let freedom = residual.len().checked_sub(parameters)?;
        let power: f64 = residual.iter().map(|r| r.norm_sqr()).sum();
        let variance = power / freedom as f64;
        variance.is_finite().then_some(Fit {
            weight,
            residual,
            variance,
        })
    }

    /// -ln of the likelihood of the residuals for each point, with variances in the ratio 1/weight^2.
    fn improbability(&self) -> f64 {
        let logs: f64 = self.weight.iter().map(|weight| weight.ln()).sum();
        self.variance.ln() - 2.0 * logs / self.weight.len() as f64
    }
}

/// Points around a frequency.
struct Neighbourhood<'a> {
    /// Frequencies from that of the centre, over the extent.
    x: Vec<f64>,
    response: &'a [Complex<f64>],
    /// Index of the centre.
    centre: usize,
}

impl<'a> Neighbourhood<'a> {
    fn of(
        frequency_hz: &[f64],
        response: &'a [Complex<f64>],
        k: usize,
        points: usize,
    ) -> Neighbourhood<'a> {
        let points = points.min(response.len());
        let first = k.saturating_sub(points / 2).min(response.len() - points);
        let near = first..first + points;
        let extent = frequency_hz[near.end - 1] - frequency_hz[first];
        let x = frequency_hz[near.clone()].iter();
        Neighbourhood {
            x: x.map(|hz| (hz - frequency_hz[k]) / extent).collect(),
            response: &response[near],
            centre: k - first,
        }
    }

    /// The variance by equal errors, or by errors in the ratio of the response if these are more probable.
    fn variance_at_centre(&self, curve: Curve, equal: &Fit) -> f64 {
        let model = self.response.iter().zip(&equal.residual);
        let weight = model.map(|(h, residual)| 1.0 / (h - residual).norm());
        let relative = self.fit(curve, weight.collect());
        match relative {
            Some(fit) if fit.improbability() < equal.improbability() => {
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
        let right = weighted(self.response.to_vec(), &weight);
        let fit = least_squares::solve(columns.to_vec(), right)?;
        Fit::new(weight, fit.residual, columns.len())
    }

    /// (1 + a x) H - b0 - b1 x - b2 x^2, divided by |1 + a x| of the iteration before.
    fn with_pole(&self, weight: Vec<f64>) -> Option<Fit> {
        let mut pole = Complex::default();
        let mut residual = Vec::new();
        for _ in 0..ITERATIONS {
            let denominators = self.x.iter().map(|x| (pole * *x + 1.0).norm());
            let weight = weight.iter().zip(denominators).map(|(w, d)| w / d);
            let weight: Vec<f64> = weight.collect();
            let slope = self.response.iter().zip(&self.x).map(|(h, x)| -h * *x);
            let columns = self.powers().into_iter().chain([slope.collect()]);
            let columns = columns.map(|column| weighted(column, &weight));
            let right = weighted(self.response.to_vec(), &weight);
            let fit = least_squares::solve(columns.collect(), right)?;
            pole = fit.solution[3];
            residual = fit.residual;
        }
        Fit::new(weight, residual, 4)
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
mod tests {
    use std::f64::consts::TAU;

    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    const SEEDS: u64 = 6;
    /// Frequencies and damping ratios of the modes of the stage.
    const MODES: [(f64, f64, f64); 2] = [(29.3, 0.009, 0.47), (118.0, 0.004, -0.05)];
    const DELAY_S: f64 = 6e-4;

    /// A stage of two modes with residues of both signs, in m/N, with a delay.
    fn stage(hz: f64) -> Complex<f64> {
        let s = Complex::new(0.0, TAU * hz);
        let mode = |(at_hz, zeta, residue): (f64, f64, f64)| {
            let w = TAU * at_hz;
            Complex::from(residue) / (s * s + s * (2.0 * zeta * w) + w * w)
        };
        MODES.into_iter().map(mode).sum::<Complex<f64>>()
            * Complex::from_polar(1.0, -TAU * hz * DELAY_S)
    }

    /// A complex Gaussian number with E|z|^2 = 1.
    fn normal(random: &mut Pcg64Mcg) -> Complex<f64> {
        let mut uniform = || (random.next_u64() as f64 + 0.5) / u64::MAX as f64;
        let (radius, angle) = ((-uniform().ln()).sqrt(), TAU * uniform());
        Complex::from_polar(radius, angle)
    }

    /// Estimated over true standard deviations, over all seeds, with the frequencies.
    fn ratios(grid_hz: &[f64], sigma: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let mut ratios = Vec::new();
        for seed in 0..SEEDS {
            let mut random = Pcg64Mcg::seed_from_u64(seed);
            let measured = |hz: &f64| stage(*hz) + normal(&mut random) * sigma(*hz);
            let response: Vec<_> = grid_hz.iter().map(measured).collect();
            let variances = variances(grid_hz, &response).expect("enough points");
            let found = grid_hz.iter().zip(variances);
            ratios.extend(found.map(|(hz, variance)| (*hz, variance.sqrt() / sigma(*hz))));
        }
        ratios
    }

    /// 800 lines from 0.25 Hz to 200 Hz: mode 1 is two lines wide, mode 2 four.
    fn analyser() -> Vec<f64> {
        (1..=800).map(|k| 0.25 * f64::from(k)).collect()
    }

    fn quantile(ratios: &[(f64, f64)], part: f64) -> f64 {
        let mut sorted: Vec<f64> = ratios.iter().map(|(_, ratio)| *ratio).collect();
        sorted.sort_by(f64::total_cmp);
        sorted[(part * sorted.len() as f64) as usize]
    }

    /// Within so many lines of a mode.
    fn near(ratios: &[(f64, f64)], lines: f64) -> Vec<(f64, f64)> {
        let is_near = |hz: f64| MODES.iter().any(|mode| (hz - mode.0).abs() <= 0.25 * lines);
        ratios
            .iter()
            .copied()
            .filter(|(hz, _)| is_near(*hz))
            .collect()
    }

    /// 400 points from 1 Hz to 200 Hz at a constant ratio of 1.3 %.
    fn stepped() -> Vec<f64> {
        (0..400)
            .map(|k| 200_f64.powf(f64::from(k) / 400.0))
            .collect()
    }

    #[test]
    fn estimate_is_the_standard_deviation_of_the_noise() {
        let at_rest = stage(0.0).norm();
        // From poor to good: one part in 100 to one in 10 000 of the static response.
        for part in [1e-2, 1e-3, 1e-4] {
            for (name, found) in [
                ("equal", ratios(&analyser(), |_| part * at_rest)),
                (
                    "relative",
                    ratios(&analyser(), |hz| part * stage(hz).norm()),
                ),
                ("stepped", ratios(&stepped(), |_| part * at_rest)),
            ] {
                // The median of (chi-square/28)^(1/2) of 28 degrees of freedom is 0.988; where a further model is used it has 26.
                let median = quantile(&found, 0.5);
                assert!((0.95..1.05).contains(&median), "{part} {name}: {median}");
                // Its first percentile is 0.70, that of 10 degrees of freedom 0.51; a tenth is for the choice of the models.
                let small = quantile(&found, 0.01);
                assert!((0.40..0.75).contains(&small), "{part} {name}: {small}");
            }
        }
    }

    #[test]
    fn estimate_near_lightly_damped_modes_may_be_larger_and_is_never_much_smaller() {
        let at_rest = stage(0.0).norm();
        for part in [1e-2, 1e-3, 1e-4] {
            for (name, found) in [
                ("equal", ratios(&analyser(), |_| part * at_rest)),
                (
                    "relative",
                    ratios(&analyser(), |hz| part * stage(hz).norm()),
                ),
            ] {
                let near = near(&found, 3.0);
                let median = quantile(&near, 0.5);
                assert!((0.8..2.0).contains(&median), "{part} {name}: {median}");
                let small = quantile(&near, 0.1);
                assert!((0.45..1.0).contains(&small), "{part} {name}: {small}");
            }
        }
    }

    #[test]
    fn too_few_points_and_zeros_have_no_estimate() {
        let grid = &analyser()[..MIN_POINTS];
        let response: Vec<_> = grid.iter().map(|hz| stage(*hz)).collect();
        assert!(variances(grid, &response).is_some());
        assert!(variances(&grid[1..], &response[1..]).is_none());
        assert!(variances(grid, &[Complex::default(); MIN_POINTS]).is_none());
    }

    #[test]
    fn points_made_equal_by_rounding_are_not_exact() {
        let grid = analyser();
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let noisy = |(k, _): (usize, &f64)| match k {
            ..100 => Complex::from(1.0),
            _ => Complex::from(1.0) + normal(&mut random) * 0.01,
        };
        let response: Vec<_> = grid.iter().enumerate().map(noisy).collect();
        let found = variances(&grid, &response).expect("noise");
        // Single precision: 6e-8.
        assert!(found.iter().all(|variance| *variance > 3e-15), "{found:?}");
    }
}
