//! What the configuration chooses.

use super::{EstimatorSettings, Frf, IdentifyError, Signals, local, welch};
use crate::config::{IdentifySettings, LocalSettings};

/// The frequency response as configured.
///
/// # Errors
/// Those of the estimator.
pub fn response(
    signals: &Signals,
    band_hz: (f64, f64),
    settings: &IdentifySettings,
) -> Result<Frf, IdentifyError> {
    match settings {
        IdentifySettings::Local(local) => {
            local::estimate(signals, band_hz, &EstimatorSettings::from(local))
        }
        IdentifySettings::Welch {
            segment_s,
            estimator,
        } => welch::estimate(
            signals,
            band_hz,
            libm::round(segment_s * signals.rate_hz) as usize,
            *estimator,
        ),
    }
}

impl From<&LocalSettings> for EstimatorSettings {
    fn from(settings: &LocalSettings) -> Self {
        Self {
            min_half_width_bins: settings.min_half_width_bins as f64,
            resolution_ratio: settings.resolution_ratio,
            resolution: settings.resolution.clone(),
            frequencies: settings.frequencies,
            curve: settings.curve,
            estimator: settings.estimator,
            transient: settings.transient,
        }
    }
}

/// Those of the local estimator, where another is configured its defaults: for what only it can do.
impl From<&IdentifySettings> for EstimatorSettings {
    fn from(settings: &IdentifySettings) -> Self {
        match settings {
            IdentifySettings::Local(local) => Self::from(local),
            IdentifySettings::Welch { .. } => Self::default(),
        }
    }
}
