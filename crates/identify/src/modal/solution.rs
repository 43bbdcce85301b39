//! A sum of modes compared with the data.
//!
//! ```text
//! H(f) = R V_0(f) + sum of r_k V(f; w_k, zeta_k)        V: a mode of residue 1 through the measurement chain and a delay tau
//! chi^2 = sum over data of 2 |H_b - H(f_b)|^2 / v_b                      v_b = E|error|^2
//! ```

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};

use super::measurement_chain::{MeasurementChain, NodeResponse, Nodes, log_derivatives};
use super::normal_equations::{NormalEquations, WeightedColumns};
use super::parameters::{ModalParameters, Parameter};
use crate::FrfDatum;
use bench_plant::zeros::ModalTerm;

/// The data of a fit and the chain through which they were measured.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub(super) chain: &'a MeasurementChain,
    pub(super) data: &'a [FrfDatum],
    /// The nodes of the data.
    pub(super) nodes: &'a Nodes,
}

impl Problem<'_> {
    /// The ratio of chi^2 to its expected value, at least 1.
    pub(super) fn misfit(&self, chi2: f64) -> f64 {
        (chi2 / (2 * self.data.len()) as f64).max(1.0)
    }

    /// By how much chi^2 must decrease for three more parameters, chosen as the best of as many places as there are data, to be
    /// significant: 3 ln 2N (Bayesian information criterion), and 2 ln N for the choice.
    pub(super) fn significant_decrease(&self) -> f64 {
        let n = self.data.len() as f64;
        3.0 * (2.0 * n).ln() + 2.0 * n.ln()
    }
}

/// Parameters, and the model that they give at the data.
pub(super) struct Solution {
    pub(super) parameters: ModalParameters,
    /// Each mode with residue 1, with the delay.
    modes: Vec<Vec<Complex<f64>>>,
    /// A constant compliance of 1, with the delay.
    constant: Vec<Complex<f64>>,
    /// The data minus the model.
    pub(super) residual: Vec<Complex<f64>>,
    pub(super) chi2: f64,
}

impl Solution {
    /// The model of given parameters.
    pub(super) fn new(problem: Problem<'_>, parameters: ModalParameters) -> Solution {
        let modes = node_responses(problem, &parameters);
        let mut solution = Solution::components(problem, parameters, &modes);
        solution.compare(problem.data);
        solution
    }

    /// The model with the residues and R of least chi^2, if the data determine them.
    pub(super) fn with_best_residues(
        problem: Problem<'_>,
        parameters: ModalParameters,
    ) -> Solution {
        let modes = node_responses(problem, &parameters);
        Solution::of_modes(problem, parameters, &modes)
    }

    /// As [`Solution::with_best_residues`], with the [`node_responses`] of the modes.
    pub(super) fn of_modes(
        problem: Problem<'_>,
        parameters: ModalParameters,
        modes: &[NodeResponse],
    ) -> Solution {
        let mut solution = Solution::components(problem, parameters, modes);
        if let Some(linear) = solution.best_residues(problem.data) {
            solution.parameters = solution.parameters.with_linear(&linear);
        }
        solution.compare(problem.data);
        solution
    }

    fn components(
        problem: Problem<'_>,
        parameters: ModalParameters,
        modes: &[NodeResponse],
    ) -> Solution {
        let nodes = problem.nodes;
        let delays = nodes.delays(parameters.delay_s);
        Solution {
            modes: modes.iter().map(|mode| nodes.mean(mode, &delays)).collect(),
            constant: nodes.constant(&delays),
            parameters,
            residual: Vec::new(),
            chi2: f64::NAN,
        }
    }

    /// Computes residual and chi^2.
    fn compare(&mut self, data: &[FrfDatum]) {
        self.residual = data
            .iter()
            .enumerate()
            .map(|(b, datum)| self.residual_of(b, datum))
            .collect();
        let squares = self
            .residual
            .iter()
            .zip(data)
            .map(|(e, datum)| 2.0 * e.norm_sqr() / datum.variance);
        self.chi2 = squares.sum();
    }

    fn residual_of(&self, b: usize, datum: &FrfDatum) -> Complex<f64> {
        let terms = self.parameters.modes.iter().zip(&self.modes);
        let sum: Complex<f64> = terms
            .map(|(mode, response)| response[b] * mode.residue_per_kg)
            .sum();
        datum.response - sum - self.constant[b] * self.parameters.remainder_m_per_n
    }

    /// The residues and R of least chi^2. Normal equations suffice: an error of theirs increases chi^2, and the step is rejected.
    fn best_residues(&self, data: &[FrfDatum]) -> Option<DVector<f64>> {
        let mut columns = WeightedColumns::new(data);
        for response in self.modes.iter().chain([&self.constant]) {
            columns.add(response.iter().copied());
        }
        let responses = data.iter().map(|datum| datum.response);
        columns.normal_equations(responses).solve(|_| 0.0)
    }

    /// The normal equations of a step in ln w, ln zeta, r, R and tau, in the order of [`ModalParameters::free`].
    pub(super) fn normal_equations(&self, data: &[FrfDatum]) -> NormalEquations {
        let mut columns = WeightedColumns::new(data);
        for (mode, response) in self.parameters.modes.iter().zip(&self.modes) {
            if mode.omega_rad_s != 0.0 {
                let (by_omega, by_damping) = logarithm_columns(mode, response, data);
                columns.add(by_omega.into_iter());
                columns.add(by_damping.into_iter());
            }
            columns.add(response.iter().copied());
        }
        columns.add(self.constant.iter().copied());
        // Aliases have another phase. Neglecting it changes the step and the covariance by their share of the response, not the
        // minimum.
        let by_delay = self.residual.iter().zip(data).map(|(residual, datum)| {
            (residual - datum.response) * Complex::new(0.0, datum.omega_rad_s())
        });
        columns.add(by_delay);
        columns.normal_equations(self.residual.iter().copied())
    }

    /// The covariance of w (rad/s), zeta, r (1/kg) of each mode, R (m/N) and tau (s), in the order of
    /// [`ModalParameters::free`]; `None` where the data do not determine them.
    pub(super) fn covariance(&self, data: &[FrfDatum]) -> Option<DMatrix<f64>> {
        let free = self.parameters.free();
        let (scale, unit) = self.normal_equations(data).scaled()?;
        let inverse = Cholesky::<f64, Dyn>::new(unit)?.inverse();
        let factors = free.iter().zip(scale.iter());
        let factors: Vec<f64> = factors
            .map(|(parameter, scale)| scale * self.logarithm_scale(*parameter))
            .collect();
        Some(DMatrix::from_fn(free.len(), free.len(), |i, j| {
            inverse[(i, j)] * factors[i] * factors[j]
        }))
    }

    /// The value of a parameter that is fitted by its logarithm; 1 for the others.
    fn logarithm_scale(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Frequency(k) => self.parameters.modes[k].omega_rad_s,
            Parameter::Damping(k) => self.parameters.modes[k].damping_ratio,
            _ => 1.0,
        }
    }
}

/// The response of each mode at the nodes of the data.
pub(super) fn node_responses(
    problem: Problem<'_>,
    parameters: &ModalParameters,
) -> Vec<NodeResponse> {
    let modes = parameters.modes.iter();
    modes.map(|mode| problem.nodes.mode(mode)).collect()
}

/// The derivatives of a mode's response to its ln w and ln zeta.
fn logarithm_columns(
    mode: &ModalTerm,
    response: &[Complex<f64>],
    data: &[FrfDatum],
) -> (Vec<Complex<f64>>, Vec<Complex<f64>>) {
    let derivatives = response.iter().zip(data).map(|(response, datum)| {
        let [by_omega, by_damping] = log_derivatives(mode, datum.omega_rad_s());
        let response = response * mode.residue_per_kg;
        (
            response * by_omega * mode.omega_rad_s,
            response * by_damping * mode.damping_ratio,
        )
    });
    derivatives.unzip()
}
