//! What the configuration chooses.

use super::{BlockSettings, EstimatorSettings, Frf, IdentifyError, Signals, local, welch};
use crate::config::{IdentifySettings, LocalSettings};

/// Noise between neighbouring bins is averaged over so much less where it weighs the blocks of a fit, which has no curves.
const BLOCKS_NARROWER: f64 = 4.0;

/// The frequency response as configured.
///
/// # Errors
/// Those of the estimator.
pub fn response(signals: &Signals, band_hz: (f64, f64), settings: &IdentifySettings) -> Result<Frf, IdentifyError> {
    match settings {
        IdentifySettings::Local(local) => local::estimate(signals, band_hz, &EstimatorSettings::from(local)),
        IdentifySettings::Welch { segment_s, estimator } => {
            welch::estimate(signals, band_hz, libm::round(segment_s * signals.rate_hz) as usize, *estimator)
        }
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

impl From<&IdentifySettings> for BlockSettings {
    fn from(settings: &IdentifySettings) -> Self {
        match settings {
            IdentifySettings::Local(local) => {
                let min_half_width_bins = (local.min_half_width_bins as f64 / BLOCKS_NARROWER).max(2.0);
                Self { min_half_width_bins, ..Self::default() }
            }
            IdentifySettings::Welch { .. } => Self::default(),
        }
    }
}
