//! Limits of the reduced chi-square of a fit.

/// Largest one of a residual that is noise: the noise is estimated with an error of some per cent.
pub(crate) const NOISE_CHI2: f64 = 1.5;
/// With a larger one the fit does not describe the stage.
pub(crate) const MAX_CHI2_PER_FREEDOM: f64 = 4.0;
