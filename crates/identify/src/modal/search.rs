//! The number of modes: modes are added one at a time, each where the residual exceeds the noise most, as long as the decrease
//! of chi^2 is significant.
//!
//! The first pass is made from two starts: from no mode, and from one mode at each peak of the response. With the first, a delay of
//! the wrong half turn can take the place of a mode, and modes added later do not lead back. The better result is used.

use core::ops::ControlFlow;

use serde::ser::{Serialize, SerializeStruct, Serializer};

use super::above_band::{mode_above, with_last_mode_above};
use super::candidates::{FREE_BODY, TRIALS, candidates, first_mode_starts};
use super::clusters::cancelling;
use super::error::{FitError, Progress, report};
use super::merge::merged;
use super::one_more_mode::OneMoreMode;
use super::parameters::{ModalParameters, Residues};
use super::peaks::peak_starts;
use super::refine::{moves_all, refine, refine_near};
use super::solution::{Problem, Solution, better};
use crate::FrfDatum;
use crate::chi2_limits::MAX_CHI2_PER_FREEDOM;
use bench_plant::zeros::ModalTerm;

/// Largest number of modes.
pub(super) const MAX_MODES: usize = 24;

/// No data are left out below this number of data, as of the lines of a multisine.
const MIN_DATA: usize = 400;

/// One pass of the search.
struct Pass {
    /// Error as a ratio of H that is added to the noise.
    relative_error: f64,
    /// Every n-th datum is used, if there are many. A mode of 0.2 % damping spans eight data of 0.05 % width.
    every: usize,
    /// See [`refine`].
    tolerance: f64,
    /// Progress of the search at the end of the pass.
    progress: f64,
}

/// The passes, from coarse to fine.
const PASSES: [Pass; 3] = [
    Pass {
        relative_error: 0.03,
        every: 4,
        tolerance: 1e-2,
        progress: 0.2,
    },
    Pass {
        relative_error: 0.003,
        every: 1,
        tolerance: 1e-3,
        progress: 0.5,
    },
    Pass {
        relative_error: 0.0,
        every: 1,
        tolerance: 1e-7,
        progress: 1.0,
    },
];

/// The fit of one model order.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelOrder {
    /// The parameters.
    pub parameters: ModalParameters,
    /// Reduced chi-square with the errors of the pass that found this order.
    pub chi2_per_freedom: f64,
    /// Decrease of chi^2 by the last mode, over the smallest significant decrease.
    pub evidence: f64,
}

/// Frequencies and damping ratios of the modes and reduced chi-square: a row of a stability chart.
impl Serialize for ModelOrder {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let modes = &self.parameters.modes;
        let frequency_hz: Vec<f64> = modes
            .iter()
            .map(|mode| mode.omega_rad_s / (2.0 * std::f64::consts::PI))
            .collect();
        let damping_ratio: Vec<f64> = modes.iter().map(|mode| mode.damping_ratio).collect();
        let mut order = serializer.serialize_struct("ModelOrder", 3)?;
        order.serialize_field("frequency_hz", &frequency_hz)?;
        order.serialize_field("damping_ratio", &damping_ratio)?;
        order.serialize_field("chi2_per_freedom", &self.chi2_per_freedom)?;
        order.end()
    }
}

/// What a search finds.
pub(super) struct Found {
    /// All orders that are significant.
    pub(super) orders: Vec<ModelOrder>,
    /// What the data show beyond the last one.
    pub(super) one_more_mode: Option<OneMoreMode>,
}

impl Found {
    /// The parameters of all orders, and those with one more mode.
    pub(super) fn parameters(self) -> Vec<ModalParameters> {
        let orders = self.orders.into_iter().map(|order| order.parameters);
        let more = self.one_more_mode.map(|more| more.parameters);
        orders.chain(more).collect()
    }
}

/// All orders that are significant, from one mode on to `max_modes`, and the best one with one more mode.
///
/// A relative error is added to the noise: a large one first, then a small one, then none. So modes are found in the order of
/// their effect on the response rather than of the accuracy of the data, and an approximate model of all of them exists before
/// small differences count. The residues are real or complex as `residues`.
pub(super) fn orders(
    problem: Problem<'_>,
    residues: &Residues,
    max_modes: usize,
    progress: &mut Progress<'_>,
) -> Result<Found, FitError> {
    let mut search = Search {
        residues,
        max_modes,
        orders: Vec::new(),
        one_more_mode: None,
        parameters: ModalParameters::without_modes(residues),
        done: 0.0,
        progress,
    };
    let [coarse, finer @ ..] = &PASSES;
    search.run_from_best_start(coarse, problem)?;
    for pass in finer {
        search.run(pass, problem)?;
    }
    Ok(Found {
        orders: search.orders,
        one_more_mode: search.one_more_mode,
    })
}

/// The significant orders from given modes on, to which modes are added.
pub(super) fn grown(
    problem: Problem<'_>,
    start: &ModalParameters,
    max_modes: usize,
) -> Result<Found, FitError> {
    let mut search = Search {
        residues: &Residues::Real,
        max_modes,
        orders: Vec::new(),
        one_more_mode: None,
        parameters: start.clone(),
        done: 0.0,
        progress: &mut |_| ControlFlow::Continue(()),
    };
    let [.., last] = &PASSES;
    search.run(last, problem)?;
    Ok(Found {
        orders: search.orders,
        one_more_mode: search.one_more_mode,
    })
}

/// At most `max_modes` modes by the coarse pass, with chi^2 and the smallest significant decrease for each of them: how well a few modes
/// describe the data, at little cost.
pub(super) fn coarse(problem: Problem<'_>, max_modes: usize) -> Result<CoarseFit, FitError> {
    let mut search = Search {
        residues: &Residues::Real,
        max_modes,
        orders: Vec::new(),
        one_more_mode: None,
        parameters: ModalParameters::default(),
        done: 0.0,
        progress: &mut |_| ControlFlow::Continue(()),
    };
    let cost = search.run_from_best_start(&PASSES[0], problem)?;
    Ok(CoarseFit {
        cost,
        parameters: search.parameters,
    })
}

/// A few modes, fitted with a relative error of some per cent beside the noise.
pub(crate) struct CoarseFit {
    /// chi^2 with this error, and a penalty for each mode.
    pub(crate) cost: f64,
    pub(crate) parameters: ModalParameters,
}

/// The state of the search between two passes.
struct Search<'a, 'p> {
    /// Real or complex.
    residues: &'a Residues,
    /// Largest number of modes.
    max_modes: usize,
    /// The orders found so far.
    orders: Vec<ModelOrder>,
    /// The best mode that is not significant.
    one_more_mode: Option<OneMoreMode>,
    /// Result of the pass before.
    parameters: ModalParameters,
    /// Progress at the end of the pass before.
    done: f64,
    progress: &'a mut Progress<'p>,
}

impl Search<'_, '_> {
    /// A pass from each start: the result with the fewest and most significant modes, and its cost.
    fn run_from_best_start(&mut self, pass: &Pass, problem: Problem<'_>) -> Result<f64, FitError> {
        let data = &pass.data(problem.data, &self.parameters);
        let nodes = &problem.chain.nodes(data, self.parameters.delay_s);
        let chain = problem.chain;
        let starts = peak_starts(Problem { chain, data, nodes }, self.residues);
        let by_one = self.cost_of_run(pass, problem)?;
        let first = (by_one, self.parameters.clone(), self.orders.clone());
        let mut best = first;
        for start in starts {
            self.parameters = start;
            self.orders.clear();
            self.done = 0.0;
            let cost = self.cost_of_run(pass, problem)?;
            if cost + problem.significant_decrease(self.residues) < best.0 {
                best = (cost, self.parameters.clone(), self.orders.clone());
            }
        }
        let cost;
        (cost, self.parameters, self.orders) = best;
        Ok(cost)
    }

    /// Runs a pass: chi^2 of its result, and the smallest significant decrease for each mode.
    fn cost_of_run(&mut self, pass: &Pass, problem: Problem<'_>) -> Result<f64, FitError> {
        let data = &pass.data(problem.data, &ModalParameters::default());
        self.run(pass, problem)?;
        let nodes = &problem.chain.nodes(data, self.parameters.delay_s);
        let chain = problem.chain;
        let problem = Problem { chain, data, nodes };
        let chi2 = Solution::new(problem, self.parameters.clone()).chi2;
        let modes = self.parameters.modes.len() as f64;
        Ok(chi2 + modes * problem.significant_decrease(self.residues))
    }

    /// Adds modes, with the errors of a pass, as long as they are significant.
    fn run(&mut self, pass: &Pass, problem: Problem<'_>) -> Result<(), FitError> {
        let data = &pass.data(problem.data, &self.parameters);
        let chain = problem.chain;
        let mut first_misfit = None;
        for _ in 0..self.max_modes {
            let nodes = &chain.nodes(data, self.parameters.delay_s);
            let problem = Problem { chain, data, nodes };
            let start = std::mem::take(&mut self.parameters);
            let solution = refine(problem, start, pass.tolerance);
            let solution = with_other_pairs(problem, solution, pass.tolerance);
            match first_misfit {
                None if solution.parameters.modes.is_empty() => {}
                None => self.orders.push(order(problem, &solution, f64::INFINITY)),
                Some(_) => self.update_last_order(problem, &solution),
            }
            let first = *first_misfit.get_or_insert(problem.misfit(solution.chi2));
            self.add_modes(pass, problem, first, solution)?;
            if !nodes.have_other_aliases(self.parameters.delay_s) {
                break;
            }
        }
        self.done = pass.progress;
        Ok(())
    }

    /// Replaces the parameters of the last order by those that were refined with nodes of its own delay.
    fn update_last_order(&mut self, problem: Problem<'_>, solution: &Solution) {
        if let Some(last) = self.orders.last_mut() {
            *last = order(problem, solution, last.evidence);
        }
    }

    /// Adds modes to a solution until none is significant, or until its delay has moved so far that the nodes must be computed again.
    fn add_modes(
        &mut self,
        pass: &Pass,
        problem: Problem<'_>,
        first_misfit: f64,
        mut solution: Solution,
    ) -> Result<(), FitError> {
        self.one_more_mode = None;
        while solution.parameters.modes.len() < self.max_modes {
            let fraction = pass_progress(first_misfit, problem.misfit(solution.chi2));
            self.report(pass, fraction)?;
            let next = match with_another_mode(problem, &solution, pass.tolerance) {
                Another::Significant(next) => next,
                Another::Insignificant(mode) => {
                    self.one_more_mode = mode;
                    break;
                }
            };
            let evidence = problem.evidence(&solution, &next);
            self.orders.push(order(problem, &next, evidence));
            solution = next;
            if problem
                .nodes
                .have_other_aliases(solution.parameters.delay_s)
            {
                break;
            }
        }
        self.parameters = solution.parameters;
        Ok(())
    }

    /// Reports the progress of a pass, 0 to 1, as progress of the search.
    fn report(&mut self, pass: &Pass, fraction: f64) -> Result<(), FitError> {
        let done = self.done + (pass.progress - self.done) * fraction;
        report(self.progress, done)
    }
}

/// Progress of a pass, 0 to 1: how far the misfit has fallen towards 1, on a logarithmic scale.
fn pass_progress(first_misfit: f64, misfit: f64) -> f64 {
    if first_misfit > 1.0 {
        (1.0 - misfit.ln() / first_misfit.ln()).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

impl Pass {
    /// The data of the pass, merged once modes are known.
    fn data(&self, data: &[FrfDatum], known: &ModalParameters) -> Vec<FrfDatum> {
        let data = if known.modes.is_empty() {
            data.to_vec()
        } else {
            merged(data, known)
        };
        let every = self.every.min(data.len() / MIN_DATA).max(1);
        data.iter()
            .step_by(every)
            .map(|datum| datum.with_relative_error(self.relative_error))
            .collect()
    }
}

fn order(problem: Problem<'_>, solution: &Solution, evidence: f64) -> ModelOrder {
    let parameters = solution.parameters.clone();
    let freedom = (2 * problem.data.len())
        .saturating_sub(parameters.free().len())
        .max(1);
    ModelOrder {
        parameters,
        chi2_per_freedom: solution.chi2 / freedom as f64,
        evidence,
    }
}

/// One more mode.
enum Another {
    /// A solution that is significantly better.
    Significant(Solution),
    /// The best one, if there are candidates; none is significant.
    Insignificant(Option<OneMoreMode>),
}

/// The first significant candidate, or else the best one.
fn with_another_mode(problem: Problem<'_>, solution: &Solution, tolerance: f64) -> Another {
    let is_significant = |next: &Solution| problem.evidence(solution, next) > 1.0;
    if solution.parameters.modes.is_empty() {
        let first = first_mode(problem, solution, tolerance).filter(is_significant);
        return first.map_or(Another::Insignificant(None), Another::Significant);
    }
    let mut best: Option<OneMoreMode> = None;
    for mode in candidates(problem, solution).into_iter().take(TRIALS) {
        let next = best_with(problem, &solution.parameters, mode, tolerance);
        let next = with_last_mode_above(problem, solution, next, tolerance);
        if is_significant(&next) {
            return Another::Significant(next);
        }
        let near_rad_s = mode_above(problem, &next).unwrap_or(mode.omega_rad_s);
        let next = OneMoreMode::new(problem, solution, next, near_rad_s);
        let is_better = |best: &OneMoreMode| next.probability > best.probability;
        if best.as_ref().is_none_or(is_better) {
            best = Some(next);
        }
    }
    Another::Insignificant(best)
}

/// The best solution of those with a mode added, and, if a mode lies there already, with that one split.
fn best_with(
    problem: Problem<'_>,
    parameters: &ModalParameters,
    mode: ModalTerm,
    tolerance: f64,
) -> Solution {
    let added = parameters.clone().with_mode(mode);
    let near = |start| refine_near(problem, start, mode.omega_rad_s, tolerance);
    let starts = parameters.with_split_mode(mode.omega_rad_s).into_iter();
    let best = starts.map(near).fold(near(added), better);
    if moves_all(&best.parameters) {
        best
    } else {
        refine(problem, best.parameters, tolerance)
    }
}

/// The solution with other pairs in place of those whose residues cancel, if it is better. Two close modes that a coarse pass did not need
/// apart are at the limit of a double pole, from which steps do not lead back.
fn with_other_pairs(problem: Problem<'_>, solution: Solution, tolerance: f64) -> Solution {
    if problem.misfit(solution.chi2) <= MAX_CHI2_PER_FREEDOM {
        return solution;
    }
    let parameters = solution.parameters.clone().by_rising_frequency();
    let pairs = cancelling(&parameters).into_iter();
    let pairs = pairs.filter(|modes| modes.len() == 2);
    let starts = pairs.flat_map(|pair| parameters.with_pair_in_place(pair));
    let other = starts.map(|start| refine(problem, start, tolerance));
    other.fold(solution, better)
}

/// The best solution with one mode, a free body included. All others build on it, so that all candidates are fitted.
fn first_mode(problem: Problem<'_>, solution: &Solution, tolerance: f64) -> Option<Solution> {
    let terms = candidates(problem, solution)
        .into_iter()
        .take(TRIALS)
        .chain([FREE_BODY]);
    let starts = terms.flat_map(|term| first_mode_starts(problem, solution, term));
    let fitted = starts.map(|start| refine(problem, start, tolerance));
    fitted.min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}
