//! A sum of modes compared with the data.
//!
//! ```text
//! H(f) = R V_0(f) + sum of r_k V(f; w_k, zeta_k)        V: a mode of residue 1 through the measurement chain and a delay tau
//!                 + sum of q_k V'(f; w_k, zeta_k)       with complex residues; V': its derivative by time, of numerator s
//! chi^2 = sum over data of 2 |H_b - H(f_b)|^2 / v_b                      v_b = E|error|^2
//! ```

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};

use super::measurement_chain::{Delays, MeasurementChain, NodeResponse, Nodes, log_derivatives};
use super::normal_equations::{NormalEquations, WeightedColumns};
use super::parameters::{ModalParameters, Moving, Parameter, Residues};
use crate::FrfDatum;
use bench_plant::zeros::ModalTerm;

/// Step of a quotient of differences in the pole of a mode, as a ratio of its distance to the data. The quotient deviates from the derivative
/// by about as much, far less than a search needs, and by rounding of 1e-16/1e-4.
const QUOTIENT_STEP: f64 = 1e-4;

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

    /// By how much chi^2 must decrease for the parameters of one more mode, chosen as the best of as many places as there are data, to
    /// be significant: ln 2N for each parameter (Bayesian information criterion), three or, with a complex residue, four, and 2 ln N for
    /// the choice.
    pub(super) fn significant_decrease(&self, residues: &Residues) -> f64 {
        let n = self.data.len() as f64;
        residues.parameters_per_mode() * (2.0 * n).ln() + 2.0 * n.ln()
    }

    /// By how much a preferred solution with as many parameters may exceed the chi^2 of another one: 2 ln N times the misfit, by which the best
    /// of as many places as there are data gains by noise.
    pub(super) fn choice_decrease(&self, chi2: f64) -> f64 {
        2.0 * (self.data.len() as f64).ln() * self.misfit(chi2)
    }

    /// The decrease of chi^2 by the last mode of `next`, over the smallest significant one.
    pub(super) fn evidence(&self, solution: &Solution, next: &Solution) -> f64 {
        let misfit = self.misfit(next.chi2);
        let significant = self.significant_decrease(&next.parameters.residues);
        (solution.chi2 - next.chi2) / (significant * misfit)
    }
}

/// Parameters, and the model that they give at the data.
pub(super) struct Solution {
    pub(super) parameters: ModalParameters,
    /// Each mode with residue 1, with the delay.
    modes: Vec<Vec<Complex<f64>>>,
    /// Each mode with rate 1 s/kg, with the delay; none if residues are real.
    rates: Vec<Vec<Complex<f64>>>,
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
        modes: &ModeResponses,
    ) -> Solution {
        let mut solution = Solution::components(problem, parameters, modes);
        solution.take_best_residues(problem.data);
        solution
    }

    /// As [`Solution::with_best_residues`], with parameters that differ from those of this solution in the modes with these indices only.
    pub(super) fn with_moved_modes(
        &self,
        problem: Problem<'_>,
        parameters: ModalParameters,
        indices: &[usize],
    ) -> Solution {
        let nodes = problem.nodes;
        let delays = nodes.delays(parameters.delay_s);
        let mut solution = Solution {
            modes: self.modes.clone(),
            rates: self.rates.clone(),
            constant: self.constant.clone(),
            parameters,
            residual: Vec::new(),
            chi2: f64::NAN,
        };
        for k in indices {
            let term = &solution.parameters.modes[*k];
            solution.modes[*k] = nodes.mean(&nodes.mode(term), &delays);
            if let Some(rate) = solution.rates.get_mut(*k) {
                *rate = nodes.mean(&nodes.mode_rate(term), &delays);
            }
        }
        solution.take_best_residues(problem.data);
        solution
    }

    /// Replaces residues and R by those of least chi^2, if the data determine them.
    fn take_best_residues(&mut self, data: &[FrfDatum]) {
        if let Some(linear) = self.best_residues(data) {
            self.parameters = std::mem::take(&mut self.parameters).with_linear(&linear);
        }
        self.compare(data);
    }

    fn components(
        problem: Problem<'_>,
        parameters: ModalParameters,
        modes: &ModeResponses,
    ) -> Solution {
        let nodes = problem.nodes;
        let delays = nodes.delays(parameters.delay_s);
        let means = |responses: &[NodeResponse]| -> Vec<Vec<Complex<f64>>> {
            let means = responses.iter().map(|mode| nodes.mean(mode, &delays));
            means.collect()
        };
        Solution {
            modes: means(&modes.residues),
            rates: means(&modes.rates),
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
        let modes = 0..self.modes.len();
        let sum: Complex<f64> = modes.map(|k| self.of_mode(k, b)).sum();
        datum.response - sum - self.constant[b] * self.parameters.remainder_m_per_n
    }

    /// The response of mode `k` with its residue at datum `b`.
    fn of_mode(&self, k: usize, b: usize) -> Complex<f64> {
        let by_residue = self.modes[k][b] * self.parameters.modes[k].residue_per_kg;
        match self.rates.get(k) {
            None => by_residue,
            Some(rate) => by_residue + rate[b] * self.parameters.rate_s_per_kg(k),
        }
    }

    /// The residues, with their rates, and R of least chi^2, in the order of [`ModalParameters::with_linear`]. Normal equations suffice: an
    /// error of theirs increases chi^2, and the step is rejected.
    fn best_residues(&self, data: &[FrfDatum]) -> Option<DVector<f64>> {
        let mut columns = WeightedColumns::new(data);
        let modes = self.modes.iter().chain(&self.rates);
        for response in modes.chain([&self.constant]) {
            columns.add(response.iter().copied());
        }
        let responses = data.iter().map(|datum| datum.response);
        columns.normal_equations(responses).solve(|_| 0.0)
    }

    /// The normal equations of a step in those of ln w, ln zeta, r, q, R and, unless it is fixed, tau that move, in the order of
    /// [`ModalParameters::free`].
    pub(super) fn normal_equations(
        &self,
        problem: Problem<'_>,
        moving: &Moving,
    ) -> NormalEquations {
        let data = problem.data;
        let delays = problem.nodes.delays(self.parameters.delay_s);
        let mut columns = WeightedColumns::new(data);
        for (k, mode) in self.parameters.modes.iter().enumerate() {
            if mode.omega_rad_s != 0.0 && moving.includes(Parameter::Frequency(k)) {
                let (by_omega, by_damping) = if self.needs_quotients(mode, problem.nodes) {
                    self.logarithm_quotients(k, problem.nodes, &delays)
                } else {
                    self.logarithm_columns(k, data)
                };
                columns.add(by_omega.into_iter());
                columns.add(by_damping.into_iter());
            }
            columns.add(self.modes[k].iter().copied());
            if let Some(rate) = self.rates.get(k) {
                columns.add(rate.iter().copied());
            }
        }
        columns.add(self.constant.iter().copied());
        if self.parameters.has_fixed_delay || !moving.includes(Parameter::Delay) {
            return columns.normal_equations(self.residual.iter().copied());
        }
        // Aliases have another phase. Neglecting it changes the step and the covariance by their share of the response, not the
        // minimum.
        let by_delay = self.residual.iter().zip(data).map(|(residual, datum)| {
            (residual - datum.response) * Complex::new(0.0, datum.omega_rad_s())
        });
        columns.add(by_delay);
        columns.normal_equations(self.residual.iter().copied())
    }

    /// Whether the derivatives of a continuous mode lead astray: of a mode above the data that is seen through samples. With complex
    /// residues such a mode stands for a filter or a lag, which has no frequency to be found.
    fn needs_quotients(&self, mode: &ModalTerm, nodes: &Nodes) -> bool {
        self.rates.is_empty() && nodes.show_aliases_of(mode)
    }

    /// As [`Solution::logarithm_columns`] for a real residue, with the aliases of the mode: quotients of differences.
    fn logarithm_quotients(
        &self,
        k: usize,
        nodes: &Nodes,
        delays: &Delays,
    ) -> (Vec<Complex<f64>>, Vec<Complex<f64>>) {
        let mode = self.parameters.modes[k];
        // Both steps in proportion to the distance of the pole from the data: a step in ln zeta of a light mode changes nothing but rounding.
        let step = QUOTIENT_STEP * nodes.relative_distance(&mode);
        let faster = ModalTerm {
            omega_rad_s: mode.omega_rad_s * (1.0 + step),
            ..mode
        };
        let more_damped = ModalTerm {
            damping_ratio: mode.damping_ratio + step,
            ..mode
        };
        let step_of_logarithm = step / mode.damping_ratio;
        (
            self.difference_quotient(k, &faster, step, nodes, delays),
            self.difference_quotient(k, &more_damped, step_of_logarithm, nodes, delays),
        )
    }

    /// The change of the response of mode `k` with its real residue when it is moved to `moved`, divided by the step.
    fn difference_quotient(
        &self,
        k: usize,
        moved: &ModalTerm,
        step: f64,
        nodes: &Nodes,
        delays: &Delays,
    ) -> Vec<Complex<f64>> {
        let factor = moved.residue_per_kg / step;
        let responses = nodes.mean(&nodes.mode(moved), delays);
        let pairs = responses.iter().zip(&self.modes[k]);
        pairs.map(|(moved, mode)| (moved - mode) * factor).collect()
    }

    /// The derivatives of a mode's response to its ln w and ln zeta.
    fn logarithm_columns(
        &self,
        k: usize,
        data: &[FrfDatum],
    ) -> (Vec<Complex<f64>>, Vec<Complex<f64>>) {
        let mode = &self.parameters.modes[k];
        let derivatives = data.iter().enumerate().map(|(b, datum)| {
            let [by_omega, by_damping] = log_derivatives(mode, datum.omega_rad_s());
            let response = self.of_mode(k, b);
            (
                response * by_omega * mode.omega_rad_s,
                response * by_damping * mode.damping_ratio,
            )
        });
        derivatives.unzip()
    }

    /// The covariance of w (rad/s), zeta, r (1/kg), q (s/kg) if residues are complex, of each mode, R (m/N) and tau (s) unless it is fixed, in the order of
    /// [`ModalParameters::free`]; `None` where the data do not determine them.
    pub(super) fn covariance(&self, problem: Problem<'_>) -> Option<DMatrix<f64>> {
        let free = self.parameters.free();
        let (scale, unit) = self.normal_equations(problem, &Moving::All).scaled()?;
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

/// The solution of smaller chi^2.
pub(super) fn better(a: Solution, b: Solution) -> Solution {
    if b.chi2 < a.chi2 { b } else { a }
}

/// The responses of modes at the nodes of the data.
pub(super) struct ModeResponses {
    /// Each mode with residue 1.
    residues: Vec<NodeResponse>,
    /// Each mode with rate 1 s/kg; none if residues are real.
    rates: Vec<NodeResponse>,
}

/// The response of each mode at the nodes of the data.
pub(super) fn node_responses(problem: Problem<'_>, parameters: &ModalParameters) -> ModeResponses {
    let of = |response: fn(&Nodes, &ModalTerm) -> NodeResponse| -> Vec<NodeResponse> {
        let modes = parameters.modes.iter();
        modes.map(|mode| response(problem.nodes, mode)).collect()
    };
    ModeResponses {
        residues: of(Nodes::mode),
        rates: match &parameters.residues {
            Residues::Real => Vec::new(),
            Residues::Complex(_) => of(Nodes::mode_rate),
        },
    }
}
