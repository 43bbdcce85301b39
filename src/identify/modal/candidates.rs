//! Start values for another mode.

use nalgebra::Complex;

use super::measurement_chain::Nodes;
use super::parameters::ModalParameters;
use super::solution::{Problem, Solution};
use crate::identify::FrfDatum;
use crate::model::zeros::ModalTerm;

/// Damping ratios of a candidate.
const DAMPING_RATIOS: [f64; 4] = [0.002, 0.006, 0.02, 0.06];
/// The band is divided into this many parts, each with one candidate frequency.
const BAND_PARTS: usize = 48;
/// Largest number of candidate frequencies: those with the largest residuals are used.
const MAX_FREQUENCIES: usize = 6;
/// Number of candidates that are fitted, the best first.
pub(super) const TRIALS: usize = 3;
/// A free body.
pub(super) const FREE_BODY: ModalTerm = ModalTerm {
    omega_rad_s: 0.0,
    damping_ratio: 0.0,
    residue_per_kg: 0.0,
};
/// Delays tried with the first mode, per period of the highest frequency, over half a period of the mode.
const DELAYS_PER_PERIOD: f64 = 6.0;
/// Largest number of these delays.
const MAX_DELAYS: f64 = 2000.0;

/// Modes that would decrease chi^2, the best first, one for each candidate frequency, and a free body if there is none.
pub(super) fn candidates(problem: Problem<'_>, solution: &Solution) -> Vec<ModalTerm> {
    let ModalParameters { modes, delay_s, .. } = &solution.parameters;
    let trials = Trials {
        problem,
        solution,
        nodes: problem.chain.nodes(*delay_s, problem.data),
    };
    let mut ranked: Vec<(f64, ModalTerm)> = largest_residuals(solution, problem.data)
        .into_iter()
        .filter_map(|index| trials.best_damping(problem.data[index].omega_rad_s()))
        .collect();
    if modes.iter().all(|mode| mode.omega_rad_s > 0.0) {
        ranked.push(trials.with_best_residue(FREE_BODY));
    }
    best_first(ranked)
}

/// Modes added to a solution on trial.
struct Trials<'a> {
    problem: Problem<'a>,
    solution: &'a Solution,
    nodes: Nodes,
}

impl Trials<'_> {
    /// The mode at a frequency with the damping ratio that decreases chi^2 most, and that decrease.
    fn best_damping(&self, omega_rad_s: f64) -> Option<(f64, ModalTerm)> {
        let trials = DAMPING_RATIOS.map(|damping_ratio| {
            self.with_best_residue(ModalTerm {
                omega_rad_s,
                damping_ratio,
                residue_per_kg: 0.0,
            })
        });
        trials.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// A mode with its best residue, and the decrease of chi^2.
    fn with_best_residue(&self, term: ModalTerm) -> (f64, ModalTerm) {
        let chain = self.problem.chain;
        let response = chain.mode(term.omega_rad_s, term.damping_ratio, &self.nodes);
        let (decrease, residue_per_kg) =
            projection(self.solution, self.problem.data, &response, 0.0);
        let term = ModalTerm {
            residue_per_kg,
            ..term
        };
        (decrease, term)
    }
}

/// Start values without their decreases of chi^2, the largest decrease first.
fn best_first<T>(mut ranked: Vec<(f64, T)>) -> Vec<T> {
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    ranked.into_iter().map(|(_, start)| start).collect()
}

/// Start values for a first mode: the delays that decrease chi^2 most, each with its best residue.
pub(super) fn first_mode_starts(
    problem: Problem<'_>,
    solution: &Solution,
    term: ModalTerm,
) -> Vec<ModalParameters> {
    let Problem { chain, data } = problem;
    let nodes = chain.nodes(0.0, data);
    let response = chain.mode(term.omega_rad_s, term.damping_ratio, &nodes);
    let starts = delays_s(data, term).map(|delay_s| {
        let (decrease, residue_per_kg) = projection(solution, data, &response, delay_s);
        let term = ModalTerm {
            residue_per_kg,
            ..term
        };
        (decrease, ModalParameters::one_mode(term, delay_s))
    });
    let mut starts = best_first(starts.collect());
    starts.truncate(TRIALS);
    starts
}

/// Delays in seconds from minus a quarter to plus half a period of a mode.
pub(super) fn delays_s(data: &[FrfDatum], term: ModalTerm) -> impl Iterator<Item = f64> {
    let step_s = data
        .last()
        .map_or(0.0, |last| 1.0 / (DELAYS_PER_PERIOD * last.frequency_hz));
    let half_period_s = std::f64::consts::PI / term.omega_rad_s.max(data[0].omega_rad_s());
    let steps = (half_period_s / step_s).min(MAX_DELAYS).ceil() as i32;
    (-steps / 2..=steps).map(move |k| f64::from(k) * step_s)
}

/// The data with the largest excess over the noise in each part of the band, the largest first.
fn largest_residuals(solution: &Solution, data: &[FrfDatum]) -> Vec<usize> {
    let excess = excess_over_noise(solution, data);
    let size = data.len().div_ceil(BAND_PARTS);
    let parts = (0..data.len())
        .step_by(size)
        .map(|low| low..(low + size).min(data.len()));
    let mut largest: Vec<usize> = parts
        .filter_map(|part| part.max_by(|a, b| excess[*a].total_cmp(&excess[*b])))
        .collect();
    largest.sort_by(|a, b| excess[*b].total_cmp(&excess[*a]));
    largest.truncate(MAX_FREQUENCIES);
    largest
}

/// The power of the residual over that of the noise for each datum; without a model, the squared velocity.
fn excess_over_noise(solution: &Solution, data: &[FrfDatum]) -> Vec<f64> {
    if solution.parameters.modes.is_empty() {
        let velocities = data.iter().map(|datum| datum.response * datum.frequency_hz);
        return velocities.map(|velocity| velocity.norm_sqr()).collect();
    }
    let residuals = solution.residual.iter().zip(data);
    residuals
        .map(|(residual, datum)| residual.norm_sqr() / datum.variance)
        .collect()
}

/// The decrease of chi^2 by a response with a delay of `delay_s` and its best real factor, and that factor.
fn projection(
    solution: &Solution,
    data: &[FrfDatum],
    response: &[Complex<f64>],
    delay_s: f64,
) -> (f64, f64) {
    let (mut product, mut square) = (0.0, 0.0);
    for ((response, residual), datum) in response.iter().zip(&solution.residual).zip(data) {
        let delayed = response * Complex::from_polar(1.0, -datum.omega_rad_s() * delay_s);
        product += 2.0 / datum.variance * (delayed.conj() * residual).re;
        square += 2.0 / datum.variance * delayed.norm_sqr();
    }
    (product * product / square, product / square)
}
