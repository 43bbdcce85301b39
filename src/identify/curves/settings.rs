//! What a person chooses of the curves.

use crate::identify::error::check_setting;
use crate::identify::{Estimator, IdentifyError, LocalModel, ResolutionPoint};

/// How the default estimator trades resolution for noise.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimatorSettings {
    /// Half-width of the neighbourhood in bins, at least: 2 to 10000.
    pub min_half_width_bins: f64,
    /// Half-width of the neighbourhood as a ratio of frequency, where that is more: 0 to 0.1.
    pub resolution_ratio: f64,
    /// Half-widths over frequency in place of the ratio, if any: frequencies rise.
    pub resolution: Vec<ResolutionPoint>,
    /// So many frequencies, evenly on a logarithmic axis; else bins half of a half-width apart.
    pub frequencies: Option<usize>,
    /// The shape within a neighbourhood.
    pub curve: LocalModel,
    /// Which signal has noise.
    pub estimator: Estimator,
    /// Whether the record begins or ends in motion.
    pub transient: bool,
}

impl Default for EstimatorSettings {
    fn default() -> Self {
        Self {
            min_half_width_bins: 16.0,
            resolution_ratio: 0.0025,
            resolution: Vec::new(),
            frequencies: None,
            curve: LocalModel::default(),
            estimator: Estimator::default(),
            transient: false,
        }
    }
}

impl EstimatorSettings {
    /// Whether the settings are within their bounds.
    pub fn check(&self) -> Result<(), IdentifyError> {
        check_setting("min_half_width_bins", self.min_half_width_bins, 2.0, 1e4)?;
        check_setting("resolution_ratio", self.resolution_ratio, 0.0, 0.1)?;
        check_setting(
            "frequencies",
            self.frequencies.map_or(2.0, |count| count as f64),
            2.0,
            1e6,
        )?;
        let mut above_hz = f64::MIN_POSITIVE;
        for point in &self.resolution {
            check_setting("resolution.frequency_hz", point.frequency_hz, above_hz, 1e5)?;
            check_setting("resolution.half_width_hz", point.half_width_hz, 1e-6, 1e4)?;
            above_hz = point.frequency_hz.next_up();
        }
        Ok(())
    }
}
