//! Modal fit: number of modes, frequencies, damping ratios, residues and their covariance, from a measured response.
//!
//! ```text
//! FRF data --search--> orders 1, 2, ... --prune--> needed modes --residual as noise--> refine --> modes, R, tau, covariance
//!     ^--- without a datum that alone shows a mode
//! ```
//!
//! The model is that of the plant, G(s) = R + sum of r_k/(s^2 + 2 zeta_k w_k s + w_k^2) (Eq. 3-2) with real residues, observed
//! through hold, amplifier and delays ([`MeasurementChain`]). Therefore every parameter is one of the mechanics, there are no
//! computational poles, and no polynomials are expanded.
//!
//! Damping that is not proportional makes the residues complex ([`Residues`]). They are fitted to data only if such a sum with real
//! residues does not describe them.
//!
//! The noise is that of the estimator first, and then the residual of the fit around each datum: where the model does not
//! describe the data, the standard deviations grow accordingly.

mod above_band;
mod candidates;
mod clusters;
mod determined_delay;
mod error;
mod lone_lines;
mod measurement_chain;
mod merge;
mod modal_fit;
mod mode_lists;
mod normal_equations;
mod one_more_mode;
mod parameters;
mod peaks;
mod prune;
mod refine;
mod residual_noise;
mod search;
mod sensitivity;
mod solution;

use core::ops::ControlFlow;

use determined_delay::with_determined_delay;
use error::report;
pub use error::{FitError, Progress};
use lone_lines::{UsedData, lone_data};
pub use measurement_chain::{InputPath, MeasurementChain};
pub use modal_fit::{COMPLEX_SIGN, FittedMode, ModalFit, ModeGroup, UncertainPole};
pub use mode_lists::ModeLists;
pub use one_more_mode::OneMoreMode;
pub use parameters::{ModalParameters, Parameter, Residues};
pub(crate) use search::CoarseFit;
pub use search::ModelOrder;

use crate::FrfDatum;
use crate::chi2_limits::MAX_CHI2_PER_FREEDOM;
pub use crate::{Estimate, SIGMAS_95};
pub use merge::merged;
pub(crate) use prune::sigmas_of_residues;
use prune::{pruned, without_least_certain};
use refine::refine;
use residual_noise::with_residual_noise;
pub(crate) use sensitivity::{mechanics_derivative, mechanics_slope};
use solution::{Problem, Solution};

/// Modes that are left out, because the data do not determine them, must not increase chi^2 by this factor.
const MUCH_WORSE: f64 = 1.5;
/// Progress at the end of the search; the rest is the final fit.
const SEARCH_PROGRESS: f64 = 0.8;

/// Fits as many modes to a response as are significant.
///
/// ```
/// use bench_identify::FrfDatum;
/// use bench_identify::modal::{MeasurementChain, fit};
/// use nalgebra::Complex;
///
/// // G = 0.5/(s^2 + 2 zeta w s + w^2) with w = 2 pi 30 Hz, zeta = 0.01, from 5 to 200 Hz.
/// let w = std::f64::consts::TAU * 30.0;
/// let datum = |k: u32| {
///     let frequency_hz = 5.0 * (f64::from(k) * 2e-3).exp();
///     let s = Complex::new(0.0, std::f64::consts::TAU * frequency_hz);
///     let response = (s * s + s * (2.0 * 0.01 * w) + w * w).inv() * 0.5;
///     FrfDatum { frequency_hz, spread_hz: 0.0, response, variance: 1e-18 }
/// };
/// let data: Vec<FrfDatum> = (0..1844).map(datum).collect();
/// let modes = fit(&data, &MeasurementChain::Direct)?.modes();
/// assert_eq!(modes.len(), 1);
/// assert!((modes[0].frequency_hz().value - 30.0).abs() < 1e-3);
/// # Ok::<(), bench_identify::modal::FitError>(())
/// ```
pub fn fit(data: &[FrfDatum], chain: &MeasurementChain) -> Result<ModalFit, FitError> {
    fit_with_progress(data, chain, &mut |_| ControlFlow::Continue(()))
}

/// As [`fit`], with a receiver of its progress, which can cancel it.
pub fn fit_with_progress(
    data: &[FrfDatum],
    chain: &MeasurementChain,
    progress: &mut Progress<'_>,
) -> Result<ModalFit, FitError> {
    fit_up_to(data, chain, &Residues::Real, search::MAX_MODES, progress)
}

/// As [`fit`], with residues of this kind and at most `max_modes` modes: enough to see whether modes describe data.
pub(crate) fn fit_few(
    data: &[FrfDatum],
    chain: &MeasurementChain,
    residues: &Residues,
    max_modes: usize,
) -> Result<ModalFit, FitError> {
    let progress = &mut |_| ControlFlow::Continue(());
    fit_up_to(data, chain, residues, max_modes, progress)
}

/// The modes of all significant orders with real residues, at most `max_modes`, and those with one more mode, whether or not the data
/// determine all of their parameters.
pub(crate) fn rising_orders(
    data: &[FrfDatum],
    chain: &MeasurementChain,
    max_modes: usize,
) -> Result<Vec<ModalParameters>, FitError> {
    let nodes = &chain.nodes(data, 0.0);
    let problem = Problem { chain, data, nodes };
    let progress = &mut |_| ControlFlow::Continue(());
    let found = search::orders(problem, &Residues::Real, max_modes, progress)?;
    Ok(found.parameters())
}

/// As [`rising_orders`], from given modes on.
pub(crate) fn grown_orders(
    data: &[FrfDatum],
    chain: &MeasurementChain,
    start: &ModalParameters,
    max_modes: usize,
) -> Result<Vec<ModalParameters>, FitError> {
    let nodes = &chain.nodes(data, start.delay_s);
    let found = search::grown(Problem { chain, data, nodes }, start, max_modes)?;
    Ok(found.parameters())
}

/// As [`fit_with_progress`], with residues of this kind and at most `max_modes` modes.
fn fit_up_to(
    data: &[FrfDatum],
    chain: &MeasurementChain,
    residues: &Residues,
    max_modes: usize,
    progress: &mut Progress<'_>,
) -> Result<ModalFit, FitError> {
    let [first, .., last] = data else {
        return Err(too_few(data));
    };
    let band_hz = (first.frequency_hz, last.frequency_hz);
    let mut used = UsedData::all(data);
    let mut searched = 0.0_f64;
    loop {
        let data = &used.data;
        let nodes = &chain.nodes(data, 0.0);
        let problem = Problem { chain, data, nodes };
        // A search that is repeated makes no progress until it is farther than the one before.
        let found = search::orders(problem, residues, max_modes, &mut |done| {
            searched = searched.max(SEARCH_PROGRESS * done);
            progress(searched)
        })?;
        let best = found.orders.last().ok_or(no_mode(band_hz))?;
        let lone = lone_data(problem, &best.parameters);
        if used.can_leave_out(&lone) {
            used.leave_out(&lone);
            continue;
        }
        report(progress, SEARCH_PROGRESS)?;
        let fit = final_fit(problem, best.parameters.clone())?;
        let lone = lone_data(problem, &fit.parameters);
        if used.can_leave_out(&lone) {
            used.leave_out(&lone);
            continue;
        }
        report(progress, 1.0)?;
        return Ok(ModalFit {
            orders: found.orders,
            one_more_mode: found.one_more_mode,
            band_hz,
            left_out_hz: used.left_out_hz,
            ..fit
        });
    }
}

fn no_mode((low_hz, high_hz): (f64, f64)) -> FitError {
    FitError::NoMode { low_hz, high_hz }
}

/// At most `max_modes` modes with a relative error of some per cent beside the noise, and how well they describe the data, for a
/// comparison of similar data.
pub(crate) fn coarse_fit(
    data: &[FrfDatum],
    chain: &MeasurementChain,
    max_modes: usize,
) -> Result<CoarseFit, FitError> {
    let nodes = &chain.nodes(data, 0.0);
    search::coarse(Problem { chain, data, nodes }, max_modes)
}

/// The parameters of least chi^2 near given ones.
pub(crate) struct Nearest {
    pub(crate) parameters: ModalParameters,
    pub(crate) chi2: f64,
    pub(crate) chi2_per_freedom: f64,
}

/// The parameters of least chi^2 near given ones, with as many modes. The data are best [`merged`], with the same modes wherever chi^2 is
/// compared.
pub(crate) fn nearest(
    start: &ModalParameters,
    data: &[FrfDatum],
    chain: &MeasurementChain,
) -> Nearest {
    let nodes = &chain.nodes(data, start.delay_s);
    let problem = Problem { chain, data, nodes };
    let solution = refine(problem, start.clone(), 0.0);
    let freedom = (2 * data.len()).saturating_sub(start.free().len()).max(1);
    Nearest {
        chi2: solution.chi2,
        chi2_per_freedom: solution.chi2 / freedom as f64,
        parameters: solution.parameters,
    }
}

fn too_few(data: &[FrfDatum]) -> FitError {
    FitError::TooFew {
        frequencies: data.len(),
    }
}

/// The fit of the needed modes, as many as the data determine with the residual as noise; without orders and band. If they describe the
/// data much worse than all of them, the modes are not determined.
fn final_fit(problem: Problem<'_>, start: ModalParameters) -> Result<ModalFit, FitError> {
    let data = &merged(problem.data, &start);
    if 2 * data.len() <= start.free().len() {
        return Err(too_few(data));
    }
    let chain = problem.chain;
    let nodes = &chain.nodes(data, start.delay_s);
    let problem = Problem { chain, data, nodes };
    let mut parameters = pruned(problem, with_determined_delay(problem, start));
    let with_all = FitError::Undetermined {
        modes: parameters.modes.len(),
    };
    let max_misfit = MAX_CHI2_PER_FREEDOM.max(MUCH_WORSE * misfit_of(problem, &parameters));
    loop {
        match with_covariance(problem, parameters.clone()) {
            Err(FitError::Undetermined { modes }) if modes > 1 => {
                parameters = without_least_certain(problem, parameters);
                if misfit_of(problem, &parameters) > max_misfit {
                    return Err(with_all);
                }
            }
            result => return result,
        }
    }
}

/// The misfit of parameters as they are.
fn misfit_of(problem: Problem<'_>, parameters: &ModalParameters) -> f64 {
    problem.misfit(Solution::new(problem, parameters.clone()).chi2)
}

/// The fit of given modes with its covariance; the residual counts as noise.
fn with_covariance(problem: Problem<'_>, start: ModalParameters) -> Result<ModalFit, FitError> {
    let data = problem.data;
    let free = start.free().len();
    let undetermined = FitError::Undetermined {
        modes: start.modes.len(),
    };
    let by_estimator = Solution::new(problem, start.clone());
    let freedom = 2 * data.len() - free;
    let chi2_per_freedom = by_estimator.chi2 / freedom as f64;
    let fit = |solution: &Solution, problem: Problem<'_>| {
        Some(ModalFit {
            covariance: solution.covariance(problem)?,
            chi2_per_freedom,
            freedom,
            orders: Vec::new(),
            one_more_mode: None,
            parameters: solution.parameters.clone(),
            band_hz: (0.0, 0.0),
            left_out_hz: Vec::new(),
        })
    };
    let Some(first) = fit(&by_estimator, problem) else {
        return Err(undetermined);
    };
    let noisy = &with_residual_noise(problem, &first, &by_estimator.residual);
    let problem = Problem {
        data: noisy,
        ..problem
    };
    // A mode may have moved past its neighbours.
    let refined = refine(problem, start, 0.0).parameters;
    let in_order = Solution::new(problem, refined.by_rising_frequency());
    fit(&in_order, problem).ok_or(undetermined)
}
