//! Uncertain signs of residues, and modes that are not significant, that can change the verdict.
//!
//! A residue of uncertain sign belongs to a mode with little effect on the response, or to one of two modes so close that only the sum
//! of their residues is determined. The residue is shifted to the ends of its interval; all other parameters follow by their
//! covariance:
//!
//! ```text
//! theta' = theta +- q C e_k/sqrt(C_kk)             q: the quantile of the required certainty, 3.1 for one look
//! ```
//!
//! If the number of CNMP pairs stays the same, the sign has no effect on the verdict. Complex residues have no sign.

use super::input::VerdictInput;
use crate::modal::{ModalParameters, OneMoreMode, Parameter};
use bench_plant::PlantError;
use bench_plant::zeros::ZeroKind;

/// The first mode of the verdict, by its index, whose sign is uncertain and changes the number of CNMP pairs.
///
/// # Errors
/// When the zeros of the fit cannot be computed.
pub(super) fn decisive_uncertain_mode(
    input: &VerdictInput<'_>,
) -> Result<Option<usize>, PlantError> {
    if !input.fit.parameters.has_real_residues() {
        return Ok(None);
    }
    let pairs = cnmp_pairs(input, &input.fit.parameters)?;
    let modes = input.fit.modes();
    let is_decisive = |k: &usize| {
        let mode = &modes[*k];
        let votes = input.covers(mode.omega_rad_s.value) && !input.has_certain_sign(mode);
        votes && !is_same_at_both_ends(input, *k, pairs)
    };
    Ok((0..modes.len()).find(is_decisive))
}

/// One more mode than is significant, if its probability is not negligible, and the number of CNMP pairs is another one with it.
///
/// # Errors
/// When the zeros of the fit cannot be computed.
pub(super) fn decisive_mode_more<'a>(
    input: &VerdictInput<'a>,
) -> Result<Option<&'a OneMoreMode>, PlantError> {
    let is_real = input.fit.parameters.has_real_residues();
    let more = input.fit.one_more_mode.as_ref().filter(|_| is_real);
    let Some(more) = more.filter(|more| !input.certainty.allows(more.probability)) else {
        return Ok(None);
    };
    let pairs = cnmp_pairs(input, &input.fit.parameters)?;
    let is_same = cnmp_pairs(input, &more.parameters).is_ok_and(|with_it| with_it == pairs);
    Ok((!is_same).then_some(more))
}

/// Whether the number of pairs is the same at both ends of the interval of a residue. Parameters without zeros are another case.
fn is_same_at_both_ends(input: &VerdictInput<'_>, mode: usize, pairs: usize) -> bool {
    let quantile = input.certainty.quantile();
    [-quantile, quantile].into_iter().all(|sigmas| {
        let shifted = with_shifted_residue(input, mode, sigmas);
        shifted.is_some_and(|parameters| {
            cnmp_pairs(input, &parameters).is_ok_and(|count| count == pairs)
        })
    })
}

/// The parameters with the residue of a mode shifted by a multiple of its standard deviation.
fn with_shifted_residue(
    input: &VerdictInput<'_>,
    mode: usize,
    sigmas: f64,
) -> Option<ModalParameters> {
    let (parameters, covariance) = (&input.fit.parameters, &input.fit.covariance);
    let free = parameters.free();
    let index = free
        .iter()
        .position(|parameter| *parameter == Parameter::Residue(mode))?;
    let sigma = covariance[(index, index)].sqrt();
    let difference: Vec<f64> = (0..free.len())
        .map(|i| sigmas * covariance[(i, index)] / sigma)
        .collect();
    let is_finite = difference.iter().all(|change| change.is_finite());
    is_finite.then(|| parameters.shifted(&difference))
}

/// Number of CNMP pairs in the band of the verdict.
fn cnmp_pairs(input: &VerdictInput<'_>, parameters: &ModalParameters) -> Result<usize, PlantError> {
    let zeros = parameters.sum()?.damped_zeros()?;
    let pairs = zeros.iter().filter(|zero| {
        zero.kind == ZeroKind::Cnmp && zero.s.im > 0.0 && input.covers(zero.s.norm())
    });
    Ok(pairs.count())
}
