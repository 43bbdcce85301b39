//! Values of a measured response that no measurement has.

use thiserror::Error;

/// A coherence may exceed 0 to 1 by this much: half a unit of the sixth decimal that other programs write, and the rounding of ratios
/// of sums in single precision (2^-24 each).
const COHERENCE_ROUNDING: f64 = 1e-6;

/// What is wrong with a value, as the end of a message that begins with the value.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ValueDefect {
    /// A standard deviation below zero.
    #[error(
        "is negative, but a standard deviation is above 0; correct it, or leave out the column if it is unknown"
    )]
    NegativeSigma,
    /// A standard deviation of zero.
    #[error(
        "is the standard deviation of an exact value, but a measured response is not exact; leave out the column if it is unknown: it is then estimated from the scatter of the response"
    )]
    ZeroSigma,
    /// A standard deviation that is not finite.
    #[error(
        "is not a finite standard deviation; correct it, or leave out the column if it is unknown"
    )]
    InfiniteSigma,
    /// A magnitude below zero.
    #[error(
        "is negative, but a magnitude is not; correct it, or name the column by what it is, such as `real` or `magnitude_db`"
    )]
    NegativeMagnitude,
    /// A coherence outside 0 to 1.
    #[error(
        "is not a coherence, which is from 0 to 1; correct it, or leave out the column if it is another quantity"
    )]
    Coherence,
}

/// What is wrong with a standard deviation, if anything.
pub fn sigma_defect(sigma: f64) -> Option<ValueDefect> {
    if !sigma.is_finite() {
        Some(ValueDefect::InfiniteSigma)
    } else if sigma < 0.0 {
        Some(ValueDefect::NegativeSigma)
    } else {
        (sigma == 0.0).then_some(ValueDefect::ZeroSigma)
    }
}

/// What is wrong with a magnitude-squared coherence, if anything.
pub fn coherence_defect(coherence: f64) -> Option<ValueDefect> {
    let valid = -COHERENCE_ROUNDING..=1.0 + COHERENCE_ROUNDING;
    (!valid.contains(&coherence)).then_some(ValueDefect::Coherence)
}
