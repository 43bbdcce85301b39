//! Modes with complex residues, where real ones do not describe the data.
//!
//! ```text
//! real residues --not the noise, cancelling, or a heavily damped mode--> search and fit with complex residues --accepted?--> modes with r + q s
//! ```
//!
//! Every sum of modes with real residues is one with complex residues, so that the data decide. Complex residues are accepted if
//!
//! 1. they leave noise as the residual, and do not nearly cancel;
//! 2. they need no more modes than real residues that describe the data, and where these leave noise as well, fewer parameters; of a part of
//!    the data 2 N chi^2 + k ln 2N, with N data and k parameters, must be smaller (Bayesian information criterion);
//! 3. real residues and a delay in their place, with as many modes, describe the data significantly worse;
//! 4. they are not those of another kind of output: with r = 0 for all modes it is a velocity.
//!
//! A filter between input and output turns the residues of the stage, each by another angle, and adds its own poles. Modes with the damping
//! of a filter take the place of these. The zeros are then those of the product of stage and filter: of a low-pass filter, which has none
//! in the band, they are those of the stage.
//!
//! The delay of the result is that with the smallest imaginary parts.
//!
//! Samples of an acceleration by a held force are not tested ([`MeasurementChain::shows_rates`]).

use crate::FrfDatum;
use crate::chi2_limits::MAX_CHI2_PER_FREEDOM;
use crate::modal::{
    FitError, FittedMode, MeasurementChain, ModalFit, ModalParameters, Residues, fit_few, merged,
    nearest,
};

/// Largest number of modes with complex residues. More are a sign of something else, and take long.
const MAX_MODES: usize = 8;
/// A mode of a flexure with a damper has less, the pole of a filter more.
const MAX_DAMPING_RATIO: f64 = 0.3;
/// With more parameters, chi^2 must decrease by the square of 5 standard deviations beside the ln 2N of each (Bayesian information criterion).
const CERTAIN_DECREASE: f64 = 25.0;

impl ModalFit {
    /// Whether the residual is noise, and no residues nearly cancel, as those of modes in the place of something else.
    pub(crate) fn is_sum_of_few_modes(&self) -> bool {
        self.leaves_noise() && self.cancelling_modes().is_none()
    }

    /// Whether the modes describe the data, are determined, and none takes the place of something else.
    pub(crate) fn is_of_a_stage(&self) -> bool {
        self.is_sum_of_few_modes()
            && self.undetermined_modes().is_none()
            && self.is_lightly_damped()
    }

    /// Whether no mode has the damping of a filter.
    fn is_lightly_damped(&self) -> bool {
        self.filter_modes().is_empty()
    }

    /// The modes that have the damping of a filter, in the place of one between input and output.
    pub(crate) fn filter_modes(&self) -> Vec<FittedMode> {
        let mut modes = self.modes();
        modes.retain(|mode| mode.damping_ratio.value >= MAX_DAMPING_RATIO);
        modes
    }

    /// The parameters without the modes that have the damping of a filter.
    pub(crate) fn lightly_damped_modes(&self) -> ModalParameters {
        let is_light = |k: &usize| self.parameters.modes[*k].damping_ratio < MAX_DAMPING_RATIO;
        let light: Vec<usize> = (0..self.parameters.modes.len()).filter(is_light).collect();
        self.parameters.selected(&light)
    }

    pub(crate) fn number_of_modes(&self) -> usize {
        self.parameters.modes.len()
    }

    /// Number of parameters that were fitted.
    pub(crate) fn number_of_parameters(&self) -> usize {
        self.parameters.free().len()
    }
}

/// The fit with complex residues, if it describes the data and a fit with real ones does not.
pub(crate) fn fit_complex(
    data: &[FrfDatum],
    chain: &MeasurementChain,
    real: &Result<ModalFit, FitError>,
) -> Option<ModalFit> {
    if real.as_ref().is_ok_and(ModalFit::is_of_a_stage) {
        return None;
    }
    let complex = complex_modes(data, chain, max_modes(real)?)?;
    is_simpler(&complex, real).then_some(complex)
}

/// The fit of a part of the data with complex residues, if it describes them better than one with real ones, even if that is one of a stage.
pub(crate) fn better_complex(
    part: &[FrfDatum],
    chain: &MeasurementChain,
    real: &Result<ModalFit, FitError>,
) -> Option<ModalFit> {
    let complex = complex_modes(part, chain, max_modes(real)?)?;
    let is_better = |real: &ModalFit| is_clearly_better(&complex, real, part.len());
    real.as_ref().map_or(true, is_better).then_some(complex)
}

/// The fit with complex residues and at most a number of modes, if it is accepted.
pub(crate) fn complex_modes(
    data: &[FrfDatum],
    chain: &MeasurementChain,
    max_modes: usize,
) -> Option<ModalFit> {
    if !chain.shows_rates() {
        return None;
    }
    let complex = fit_few(data, chain, &Residues::complex(), max_modes.min(MAX_MODES)).ok()?;
    is_accepted(&complex, data, chain).then_some(complex)
}

/// Largest number of modes with complex residues in place of real ones.
fn max_modes(real: &Result<ModalFit, FitError>) -> Option<usize> {
    match real {
        Ok(fit) if fit.chi2_per_freedom <= MAX_CHI2_PER_FREEDOM => Some(fit.number_of_modes()),
        Ok(_) => Some(MAX_MODES),
        Err(FitError::Undetermined { modes }) => Some(*modes),
        Err(_) => None,
    }
}

/// Whether complex residues have fewer parameters than real ones that leave noise as well.
fn is_simpler(complex: &ModalFit, real: &Result<ModalFit, FitError>) -> bool {
    match real {
        Ok(real) if real.leaves_noise() => {
            complex.number_of_parameters() < real.number_of_parameters()
        }
        _ => true,
    }
}

/// Whether a fit of a part of N data has a smaller Bayesian information criterion 2 N chi^2 + k ln 2N than another fit of them; with more
/// parameters, a clearly smaller one. (Of many data, those of each fit are merged around its own poles, and chi^2 cannot be compared.)
pub(crate) fn is_clearly_better(fit: &ModalFit, other: &ModalFit, part_data: usize) -> bool {
    let values = 2.0 * part_data as f64;
    let [fitted, others] = [fit, other].map(|fit| {
        let parameters = fit.number_of_parameters() as f64;
        (
            parameters,
            values * fit.chi2_per_freedom + parameters * values.ln(),
        )
    });
    let margin = if fitted.0 > others.0 {
        CERTAIN_DECREASE
    } else {
        0.0
    };
    fitted.1 + margin < others.1
}

/// Whether the modes describe the data, and real residues do not.
pub(crate) fn is_accepted(complex: &ModalFit, data: &[FrfDatum], chain: &MeasurementChain) -> bool {
    complex.is_sum_of_few_modes()
        && complex.undetermined_modes().is_none()
        && !complex.modes().iter().all(is_mostly_imaginary)
        && is_better_than_real(&complex.parameters, data, chain)
}

/// Whether the response is rather that of a velocity.
fn is_mostly_imaginary(mode: &FittedMode) -> bool {
    let imaginary = mode.residue_imaginary_per_kg;
    imaginary.is_some_and(|part| part.value.abs() > mode.residue_per_kg.value.abs())
}

/// Whether chi^2 increases significantly with real residues and a free delay, near the same modes.
fn is_better_than_real(
    complex: &ModalParameters,
    data: &[FrfDatum],
    chain: &MeasurementChain,
) -> bool {
    let real = ModalParameters {
        residues: Residues::Real,
        has_fixed_delay: false,
        ..complex.clone()
    };
    let data = &merged(data, complex);
    let [with_real, with_complex] = [&real, complex].map(|start| nearest(start, data, chain));
    let rates = complex.modes.len() as f64;
    let significant = rates * (2.0 * data.len() as f64).ln() + CERTAIN_DECREASE;
    with_real.chi2 - with_complex.chi2 > significant * with_complex.chi2_per_freedom.max(1.0)
}

#[cfg(test)]
mod tests;
