//! The power of the noise over frequency, from the residuals of local models.

use super::spectra::Spectra;
use crate::identify::EstimatorSettings;

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
pub(super) struct NoiseFloor {
    residuals: Vec<Residual>,
}

impl NoiseFloor {
    /// The noise between two positions and somewhat beyond, from models one half-width apart.
    pub(super) fn new(
        spectra: &impl Spectra,
        (low, high): (f64, f64),
        settings: &EstimatorSettings,
    ) -> Self {
        let reach = |position: f64| WIDTH_RATIO * settings.half_width(position, spectra.bin_hz());
        let mut position = (low - reach(low)).max(1.0);
        let end = (high + reach(high)).min(spectra.last_bin() as f64);
        let mut residuals = Vec::new();
        while position <= end {
            let half_width = settings.half_width(position, spectra.bin_hz());
            let fit = spectra.fit(position, half_width, settings);
            residuals.extend(fit.map(|fit| Residual {
                position,
                power: fit.residual_power,
                freedom: fit.freedom,
            }));
            position += half_width;
        }
        Self { residuals }
    }

    /// E|N|^2 in a bin around a position.
    pub(super) fn power(&self, position: f64, half_width: f64) -> f64 {
        let reach = WIDTH_RATIO * half_width;
        let first = self
            .residuals
            .partition_point(|residual| residual.position <= position - reach);
        let near = self.residuals[first..]
            .iter()
            .take_while(|residual| residual.position < position + reach);
        let (mut power, mut freedom) = (0.0, 0.0);
        for residual in near {
            let distance = residual.position - position;
            let weight = libm::cos(core::f64::consts::FRAC_PI_2 * distance / reach).powi(2);
            power += weight * residual.power;
            freedom += weight * residual.freedom;
        }
        power / freedom
    }
}
