//! Errors and progress of a fit.

use core::ops::ControlFlow;

/// Receives the progress of a fit, 0 to 1; `Break` cancels it.
pub type Progress<'a> = dyn FnMut(f64) -> ControlFlow<()> + 'a;

/// Why no modes can be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// No mode is significant.
    #[error(
        "no mode exceeds the noise between {low_hz:.3} and {high_hz:.3} Hz; \
         increase the amplitude or the duration, or check that the probe measures the stage"
    )]
    NoMode {
        /// Lowest frequency.
        low_hz: f64,
        /// Highest frequency.
        high_hz: f64,
    },
    /// Fewer data than parameters.
    #[error(
        "{frequencies} frequencies do not determine a mode; record for longer or widen the band"
    )]
    TooFew {
        /// Number of frequencies.
        frequencies: usize,
    },
    /// The covariance is singular.
    #[error(
        "the response does not determine the parameters of {modes} modes; increase the duration or the amplitude"
    )]
    Undetermined {
        /// Number of modes found.
        modes: usize,
    },
    /// The progress callback cancelled the fit.
    #[error("the fit was cancelled; start it again to complete it")]
    Cancelled,
}

/// Reports progress; an error if the callback cancels.
pub(super) fn report(progress: &mut Progress<'_>, fraction: f64) -> Result<(), FitError> {
    match progress(fraction) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(FitError::Cancelled),
    }
}
