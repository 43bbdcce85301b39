//! Start values for another mode.

use nalgebra::Complex;

use super::measurement_chain::{Delays, unit_phasor};
use super::parameters::ModalParameters;
use super::solution::{Problem, Solution};
use crate::FrfDatum;
use bench_plant::zeros::ModalTerm;

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
        delays: problem.nodes.delays(*delay_s),
    };
    let mut ranked: Vec<(f64, ModalTerm)> = largest_residuals(problem, solution)
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
    delays: Delays,
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
        let Problem { data, nodes, .. } = self.problem;
        let response = nodes.mean(&nodes.mode(&term), &self.delays);
        let (decrease, residue_per_kg) = Projection::new(self.solution, data, &response).result();
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
    let Problem { data, nodes, .. } = problem;
    let response = nodes.mean(&nodes.mode(&term), &nodes.delays(0.0));
    let mut projection = Projection::new(solution, data, &response);
    let delays_s: Vec<f64> = delays_s(data, term).collect();
    let (first, step) = (delays_s[0], delay_step_s(data));
    projection.delay(&phasors(data, first));
    let step = phasors(data, step);
    let mut starts = Vec::with_capacity(delays_s.len());
    for delay_s in delays_s {
        let (decrease, residue_per_kg) = projection.result();
        let term = ModalTerm {
            residue_per_kg,
            ..term
        };
        let start = ModalParameters {
            delay_s,
            ..solution.parameters.clone()
        };
        starts.push((decrease, start.with_mode(term)));
        projection.delay(&step);
    }
    let mut starts = best_first(starts);
    starts.truncate(TRIALS);
    starts
}

/// Delays in seconds from minus a quarter to plus half a period of a mode.
pub(super) fn delays_s(data: &[FrfDatum], term: ModalTerm) -> impl Iterator<Item = f64> {
    let step_s = delay_step_s(data);
    let half_period_s = std::f64::consts::PI / term.omega_rad_s.max(data[0].omega_rad_s());
    let steps = (half_period_s / step_s).min(MAX_DELAYS).ceil() as i32;
    (-steps / 2..=steps).map(move |k| f64::from(k) * step_s)
}

fn delay_step_s(data: &[FrfDatum]) -> f64 {
    let last = data.last();
    last.map_or(0.0, |last| 1.0 / (DELAYS_PER_PERIOD * last.frequency_hz))
}

/// The data with the largest excess over the noise in each part of the band, the largest first.
fn largest_residuals(problem: Problem<'_>, solution: &Solution) -> Vec<usize> {
    let data = problem.data;
    let excess = excess_over_noise(problem, solution);
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
fn excess_over_noise(problem: Problem<'_>, solution: &Solution) -> Vec<f64> {
    let Problem { chain, data, .. } = problem;
    if solution.parameters.modes.is_empty() {
        let velocities = data.iter().map(|datum| chain.velocity(datum));
        return velocities.map(|velocity| velocity * velocity).collect();
    }
    let residuals = solution.residual.iter().zip(data);
    residuals
        .map(|(residual, datum)| residual.norm_sqr() / datum.variance)
        .collect()
}

/// A response of a free real factor beside the residual of a solution.
struct Projection {
    /// 2/v conj(h) e of each datum, with h the response and e the residual.
    products: Vec<Complex<f64>>,
    /// Sum of 2/v |h|^2.
    square: f64,
}

impl Projection {
    fn new(solution: &Solution, data: &[FrfDatum], response: &[Complex<f64>]) -> Projection {
        let (mut products, mut square) = (Vec::with_capacity(data.len()), 0.0);
        for ((h, residual), datum) in response.iter().zip(&solution.residual).zip(data) {
            let weight = 2.0 / datum.variance;
            products.push(h.conj() * residual * weight);
            square += h.norm_sqr() * weight;
        }
        Projection { products, square }
    }

    /// Delays the response by the delay of `phasors`. This changes the products only.
    fn delay(&mut self, phasors: &[Complex<f64>]) {
        for (product, phasor) in self.products.iter_mut().zip(phasors) {
            *product *= phasor;
        }
    }

    /// The decrease of chi^2 by the response with its best factor, and that factor.
    fn result(&self) -> (f64, f64) {
        let product: f64 = self.products.iter().map(|product| product.re).sum();
        (product * product / self.square, product / self.square)
    }
}

/// exp(j w tau) of each datum: the conjugate of a delay.
fn phasors(data: &[FrfDatum], delay_s: f64) -> Vec<Complex<f64>> {
    let angles = data.iter().map(|datum| datum.omega_rad_s() * delay_s);
    angles.map(unit_phasor).collect()
}
