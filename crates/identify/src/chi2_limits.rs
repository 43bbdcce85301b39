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
/// With a larger one the fit does not describe the stage.
pub(crate) const MAX_CHI2_PER_FREEDOM: f64 = 4.0;

/// The largest one of a residual that is noise, of a number of degrees of freedom.
pub(crate) fn noise_limit(freedom: usize) -> f64 {
    let limit = NOISE_MEAN + CERTAIN_SIGMAS * (2.0 / freedom.max(1) as f64).sqrt();
    limit.min(MAX_CHI2_PER_FREEDOM)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five standard deviations are 0.11 of 4,000 degrees of freedom, and 1 of 50.
    #[test]
    fn limit_of_noise_follows_from_the_degrees_of_freedom() {
        for (freedom, limit) in [(4000, 1.3118), (50, 2.2), (2, 4.0), (0, 4.0)] {
            assert!((noise_limit(freedom) - limit).abs() < 1e-4, "{freedom}");
        }
    }
}
