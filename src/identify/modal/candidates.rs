//! Start values for another mode.

use nalgebra::Complex;

use super::parameters::ModalParameters;
use super::solution::{Problem, Solution};
use crate::identify::FrfDatum;
use crate::model::zeros::ModalTerm;

/// Damping ratios of a candidate.
const DAMPING_RATIOS: [f64; 4] = [0.002, 0.006, 0.02, 0.06];
/// The band is divided into this many parts, each with one candidate frequency.
const BAND_PARTS: usize = 48;
/// Of the candidate frequencies, only the ones of largest residual are used.
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
    let nodes = problem.chain.nodes(*delay_s, problem.data);
    let evaluated = |term: ModalTerm| {
        let response = problem
            .chain
            .mode(term.omega_rad_s, term.damping_ratio, &nodes);
        let (decrease, residue_per_kg) = projection(solution, problem.data, &response, 0.0);
        (
            decrease,
            ModalTerm {
                residue_per_kg,
                ..term
            },
        )
    };
    let mut found: Vec<(f64, ModalTerm)> = Vec::new();
    for index in largest_residuals(solution, problem.data) {
        let omega_rad_s = problem.data[index].omega_rad_s();
        let term = |damping_ratio| ModalTerm {
            omega_rad_s,
            damping_ratio,
            residue_per_kg: 0.0,
        };
        let tried = DAMPING_RATIOS.map(|damping_ratio| evaluated(term(damping_ratio)));
        found.extend(tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)));
    }
    if modes.iter().all(|mode| mode.omega_rad_s > 0.0) {
        found.push(evaluated(FREE_BODY));
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, term)| term).collect()
}

/// Start values for a first mode: the delays that decrease chi^2 most, each with its best residue.
pub(super) fn first_mode_starts(
    problem: Problem<'_>,
    solution: &Solution,
    term: ModalTerm,
) -> Vec<ModalParameters> {
    let nodes = problem.chain.nodes(0.0, problem.data);
    let response = problem
        .chain
        .mode(term.omega_rad_s, term.damping_ratio, &nodes);
    let start = |delay_s: f64| {
        let (decrease, residue_per_kg) = projection(solution, problem.data, &response, delay_s);
        let modes = vec![ModalTerm {
            residue_per_kg,
            ..term
        }];
        (
            decrease,
            ModalParameters {
                modes,
                delay_s,
                ..ModalParameters::default()
            },
        )
    };
    let mut starts: Vec<(f64, ModalParameters)> = delays_s(problem.data, term).map(start).collect();
    starts.sort_by(|a, b| b.0.total_cmp(&a.0));
    starts
        .into_iter()
        .take(TRIALS)
        .map(|(_, start)| start)
        .collect()
}

/// Delays in seconds from minus a quarter to plus half a period of a mode.
fn delays_s(data: &[FrfDatum], term: ModalTerm) -> impl Iterator<Item = f64> {
    let step_s = data
        .last()
        .map_or(0.0, |last| 1.0 / (DELAYS_PER_PERIOD * last.frequency_hz));
    let half_period_s = std::f64::consts::PI / term.omega_rad_s.max(data[0].omega_rad_s());
    let steps = (half_period_s / step_s).min(MAX_DELAYS).ceil() as i32;
    (-steps / 2..=steps).map(move |k| f64::from(k) * step_s)
}

/// The data with the largest excess over the noise in each part of the band, the largest first.
fn largest_residuals(solution: &Solution, data: &[FrfDatum]) -> Vec<usize> {
    let without_model = solution.parameters.modes.is_empty();
    let excess = |b: &usize| match without_model {
        // Without a model, the largest velocity.
        true => (data[*b].response * data[*b].frequency_hz).norm_sqr(),
        false => solution.residual[*b].norm_sqr() / data[*b].variance,
    };
    let size = data.len().div_ceil(BAND_PARTS);
    let parts = (0..data.len())
        .step_by(size)
        .map(|low| low..(low + size).min(data.len()));
    let mut largest: Vec<usize> = parts
        .filter_map(|part| part.max_by(|a, b| excess(a).total_cmp(&excess(b))))
        .collect();
    largest.sort_by(|a, b| excess(b).total_cmp(&excess(a)));
    largest.truncate(MAX_FREQUENCIES);
    largest
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
