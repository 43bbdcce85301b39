//! Limits of the reduced chi-square of a fit.
//!
//! ```text
//! 1 +- sqrt(2/f)        mean and standard deviation of that of noise with f degrees of freedom and a known variance
//! n/(n - 2)             its mean, if the variance is estimated with n degrees of freedom
//! ```

/// The mean with a variance that is estimated with 12 degrees of freedom, as near a mode.
const NOISE_MEAN: f64 = 1.2;
/// Beyond the mean by more standard deviations the residual is no noise.
const CERTAIN_SIGMAS: f64 = 5.0;
/// With a larger one the modes of a search are not near those of the stage.
pub(crate) const MAX_CHI2_PER_FREEDOM: f64 = 4.0;

/// The largest one of a residual that is noise, of a number of degrees of freedom.
pub(crate) fn noise_limit(freedom: usize) -> f64 {
    NOISE_MEAN + CERTAIN_SIGMAS * (2.0 / freedom.max(1) as f64).sqrt()
}
