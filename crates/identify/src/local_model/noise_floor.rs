//! The power of the noise over frequency, from the residuals of local models.

use super::spectra::Spectra;
use crate::EstimatorSettings;

/// Residuals are averaged with weights this much wider than those of the models.
const WIDTH_RATIO: f64 = 2.0;

/// The residual of one local model.
struct Residual {
    position: f64,
    /// sum w |e|^2
    power: f64,
    /// Expected power for noise of power 1.
    freedom: f64,
}

/// The noise along a band.
pub(super) struct NoiseFloor<'a> {
    settings: &'a EstimatorSettings,
    bin_hz: f64,
    residuals: Vec<Residual>,
}

impl<'a> NoiseFloor<'a> {
    /// The noise between two positions and somewhat beyond, from models one half-width apart.
    pub(super) fn new(
        spectra: &impl Spectra,
        (low, high): (f64, f64),
        settings: &'a EstimatorSettings,
    ) -> Self {
        let mut floor = NoiseFloor {
            settings,
            bin_hz: spectra.bin_hz(),
            residuals: Vec::new(),
        };
        let mut position = (low - floor.reach(low)).max(1.0);
        let end = (high + floor.reach(high)).min(spectra.last_bin() as f64);
        while position <= end {
            position += floor.add_residual(spectra, position);
        }
        floor
    }

    /// Adds the residual of the model at a position; returns the half-width of the model.
    fn add_residual(&mut self, spectra: &impl Spectra, position: f64) -> f64 {
        let half_width = self.settings.half_width(position, self.bin_hz);
        let fit = spectra.fit(position, half_width, self.settings);
        self.residuals.extend(fit.map(|fit| Residual {
            position,
            power: fit.residual_power,
            freedom: fit.freedom,
        }));
        half_width
    }

    /// The distance from a position up to which residuals are averaged.
    fn reach(&self, position: f64) -> f64 {
        WIDTH_RATIO * self.settings.half_width(position, self.bin_hz)
    }

    /// The residuals nearer to a position than `reach`.
    fn near(&self, position: f64, reach: f64) -> &[Residual] {
        let residuals = &self.residuals;
        let first = residuals.partition_point(|residual| residual.position <= position - reach);
        let last = residuals.partition_point(|residual| residual.position < position + reach);
        residuals.get(first..last).unwrap_or_default()
    }

    /// E|N|^2 in a bin around a position.
    pub(super) fn power(&self, position: f64) -> f64 {
        let reach = self.reach(position);
        let (mut power, mut freedom) = (0.0, 0.0);
        for residual in self.near(position, reach) {
            let distance = residual.position - position;
            let weight = libm::cos(core::f64::consts::FRAC_PI_2 * distance / reach).powi(2);
            power += weight * residual.power;
            freedom += weight * residual.freedom;
        }
        power / freedom
    }
}
