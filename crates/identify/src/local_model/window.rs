//! The bins around a frequency, with their weights.

use nalgebra::Complex;

use super::least_squares::LeastSquares;
use crate::LocalModel;

/// The bins around a position. Their weights are cos^2(pi x/2).
pub(super) struct Window {
    /// Index of its first bin in the spectrum.
    pub(super) first_bin: usize,
    /// Distance from the position over the half-width, -1 to 1.
    pub(super) x: Vec<f64>,
    /// Square roots of the weights.
    pub(super) root_weight: Vec<f64>,
    pub(super) input: Vec<Complex<f64>>,
    pub(super) output: Vec<Complex<f64>>,
}

/// The response in the middle of a window.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalFit {
    pub(super) response: Complex<f64>,
    /// E|error of H|^2 for noise of power 1 in a bin.
    pub(super) noise_gain: f64,
    /// sum w |Y - H U|^2
    pub(super) residual_power: f64,
    /// Expected residual power for noise of power 1 in a bin.
    pub(super) freedom: f64,
    /// Equivalent noise bandwidth, in bins, of the weights that combine the ratios Y/U to H.
    pub(super) bandwidth_bins: f64,
    /// The ratio of the output's power that the model explains.
    pub(super) coherence: f64,
    /// Whether there is input in the middle, or on both sides of it.
    pub(super) encloses_input: bool,
}

/// A local model with the linear solution that it was found by.
pub(super) struct FittedModel {
    pub(super) fit: LocalFit,
    /// The last linear step; the residual is that of the model.
    pub(super) linear: LeastSquares,
    /// The transient of each bin times the root of its weight; empty for a model without one.
    pub(super) transient: Vec<Complex<f64>>,
}

impl LocalFit {
    /// Fisher's F of this model against a simpler one: the power that its additional parameters explain over that of the remaining
    /// noise.
    pub(super) fn f_statistic(&self, simple: &LocalFit) -> f64 {
        let explained =
            (simple.residual_power - self.residual_power) / (simple.freedom - self.freedom);
        // 0/0 where the simpler model explains everything: f64::max returns the 0.
        (explained * self.freedom / self.residual_power).max(0.0)
    }
}

impl Window {
    /// Number of bins.
    pub(super) fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is input in the middle, or on both sides of it: no estimate beyond the outermost excited bin.
    pub(super) fn encloses_input(&self) -> bool {
        self.excited_x().any(|x| x <= 0.0) && self.excited_x().any(|x| x >= 0.0)
    }

    /// Number of bins that have input.
    pub(super) fn excited(&self) -> usize {
        self.excited_x().count()
    }

    /// The distances of the bins that have input.
    fn excited_x(&self) -> impl Iterator<Item = f64> {
        let excited = self.x.iter().zip(&self.input);
        excited.filter(|(_, u)| u.norm_sqr() > 0.0).map(|(x, _)| *x)
    }

    /// The ratio of the output's power that the model explains; 0 without output.
    pub(super) fn coherence(&self, residual_power: f64) -> f64 {
        let output = self.output.iter().zip(&self.root_weight);
        let power: f64 = output.map(|(y, root)| y.norm_sqr() * root * root).sum();
        if power > 0.0 {
            1.0 - residual_power / power
        } else {
            0.0
        }
    }

    /// The highest degree for which more than twice as many bins are excited as there are unknowns.
    pub(super) fn degree(&self, model: LocalModel, transient: bool) -> usize {
        let max_degree = if model == LocalModel::Constant { 0 } else { 2 };
        let excited = self.excited();
        let polynomials = if transient { 2 } else { 1 };
        (1..=max_degree)
            .rev()
            .find(|degree| excited > 2 * (degree + 1) * polynomials)
            .unwrap_or(0)
    }

    /// The weighted columns root x^i `factor`, i = 0 ..= degree.
    pub(super) fn powers(
        &self,
        degree: usize,
        factor: impl Fn(usize) -> Complex<f64>,
    ) -> Vec<Vec<Complex<f64>>> {
        let mut column: Vec<Complex<f64>> = self
            .root_weight
            .iter()
            .enumerate()
            .map(|(j, root)| factor(j) * root)
            .collect();
        let mut columns = vec![column.clone()];
        for _ in 0..degree {
            column
                .iter_mut()
                .zip(&self.x)
                .for_each(|(entry, x)| *entry *= x);
            columns.push(column.clone());
        }
        columns
    }

    /// The columns of B U/A, and of T/A, with `inverse` = 1/A.
    pub(super) fn numerators(
        &self,
        degree: usize,
        transient: bool,
        inverse: &[Complex<f64>],
    ) -> Vec<Vec<Complex<f64>>> {
        let mut columns = self.powers(degree, |j| self.input[j] * inverse[j]);
        if transient {
            columns.extend(self.powers(degree, |j| inverse[j]));
        }
        columns
    }

    /// sum over the bins of weight times `term`.
    pub(super) fn weighted_sum(&self, term: impl Fn(usize) -> f64) -> f64 {
        self.root_weight
            .iter()
            .enumerate()
            .map(|(j, root)| root * root * term(j))
            .sum()
    }

    /// The response in the middle, from the solution of a linear model.
    pub(super) fn local_fit(&self, solution: &LeastSquares) -> LocalFit {
        let residual_power = solution.residual.iter().map(|e| e.norm_sqr()).sum();
        LocalFit {
            response: solution.solution[0],
            noise_gain: self.weighted_sum(|j| solution.gradient[j].norm_sqr()),
            residual_power,
            coherence: self.coherence(residual_power),
            encloses_input: self.encloses_input(),
            freedom: self.weighted_sum(|j| 1.0 - solution.leverage[j]),
            bandwidth_bins: 1.0
                / self.weighted_sum(|j| (solution.gradient[j] * self.input[j]).norm_sqr()),
        }
    }
}
