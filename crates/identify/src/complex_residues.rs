//! Modes with complex residues, where real ones do not describe the data.
//!
//! ```text
//! real residues --not the noise, cancelling, or a heavily damped mode--> search and fit with complex residues --accepted?--> modes with r + q s
//! ```
//!
//! Every sum of modes with real residues is one with complex residues, so that the data decide. Complex residues are accepted if
//!
//! 1. they leave noise as the residual, and do not nearly cancel;
//! 2. they need no more modes than real residues that describe the data and, where those leave noise as well, fewer parameters;
//! 3. real residues and a delay in their place, with as many modes, describe the data significantly worse;
//! 4. they are not those of another kind of output: with r = 0 for all modes it is a velocity;
//! 5. no mode is heavily damped: such a mode takes the place of a filter, and the zeros near it are none of the stage.
//!
//! The delay of the result is that with the smallest imaginary parts.
//!
//! An acceleration has no derivative that is observed, and is not tested.

use crate::FrfDatum;
use crate::chi2_limits::MAX_CHI2_PER_FREEDOM;
use crate::modal::{
    FitError, FittedMode, MeasurementChain, ModalFit, ModalParameters, Residues, fit_few, merged,
    nearest,
};

/// Largest number of modes with complex residues. More are a sign of something else, and take long.
const MAX_MODES: usize = 8;
/// A mode of a flexure with a damper has less.
const MAX_DAMPING_RATIO: f64 = 0.3;
/// Beside the ln 2N of each rate (Bayesian information criterion), chi^2 must decrease by the square of 5 standard deviations.
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
        let modes = self.modes();
        let mut dampings = modes.iter().map(|mode| mode.damping_ratio.value);
        dampings.all(|damping| damping < MAX_DAMPING_RATIO)
    }

    /// The parameters without the modes that have the damping of a filter.
    pub(crate) fn lightly_damped_modes(&self) -> ModalParameters {
        let is_light = |k: &usize| self.parameters.modes[*k].damping_ratio < MAX_DAMPING_RATIO;
        let light: Vec<usize> = (0..self.parameters.modes.len()).filter(is_light).collect();
        self.parameters.selected(&light)
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
    chain.derivative()?;
    let max_modes = match real {
        Ok(fit) if fit.is_of_a_stage() => return None,
        Ok(fit) if fit.chi2_per_freedom <= MAX_CHI2_PER_FREEDOM => fit.parameters.modes.len(),
        Ok(_) => MAX_MODES,
        Err(FitError::Undetermined { modes }) => *modes,
        Err(_) => return None,
    };
    let max_modes = max_modes.min(MAX_MODES);
    let complex = fit_few(data, chain, &Residues::complex(), max_modes).ok()?;
    (is_simpler(&complex, real) && is_accepted(&complex, data, chain)).then_some(complex)
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

/// Whether the modes describe the data, and real residues do not.
pub(crate) fn is_accepted(complex: &ModalFit, data: &[FrfDatum], chain: &MeasurementChain) -> bool {
    complex.is_of_a_stage()
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
