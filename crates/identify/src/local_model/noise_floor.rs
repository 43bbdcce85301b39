//! The power of the noise over frequency, from the residuals of local models.
//!
//! A model with one pole cannot follow two modes and a zero between them, and its residual then contains their response. Where a residual
//! exceeds those around it, models with more poles are tried, so that modes close together do not count as noise.

use super::spectra::{Place, Spectra};
use crate::EstimatorSettings;

/// Residuals are averaged with weights this much wider than those of the models.
const WIDTH_RATIO: f64 = 2.0;
/// A residual this much above the median of those around it is fitted again. Its 20 degrees of freedom make this four sigmas.
const OUTLIER_RATIO: f64 = 2.0;
/// Number of residuals to either side that an outlier is compared with. A pair of modes raises those of two neighbours.
const COMPARED: usize = 6;
/// Poles of the models, and of those that are tried where the residual is large.
const POLES: usize = 1;
const MORE_POLES: usize = 3;

/// The residual of one local model.
struct Residual {
    place: Place,
    /// sum w |e|^2
    power: f64,
    /// Expected power for noise of power 1.
    freedom: f64,
}

impl Residual {
    fn new(
        spectra: &impl Spectra,
        place: Place,
        settings: &EstimatorSettings,
        poles: usize,
    ) -> Option<Residual> {
        let fit = spectra.fit(place, settings, poles)?;
        Some(Residual {
            place,
            power: fit.residual_power,
            freedom: fit.freedom,
        })
    }

    /// The power of the noise in a bin.
    fn density(&self) -> f64 {
        self.power / self.freedom
    }
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
            let half_width = settings.half_width(position, floor.bin_hz);
            let place = Place {
                position,
                half_width,
            };
            let residual = Residual::new(spectra, place, settings, POLES);
            floor.residuals.extend(residual);
            position += half_width;
        }
        floor.refit_outliers(spectra);
        floor
    }

    /// Fits models with more poles where a residual exceeds those around it.
    fn refit_outliers(&mut self, spectra: &impl Spectra) {
        let densities: Vec<f64> = self.residuals.iter().map(Residual::density).collect();
        for (k, residual) in self.residuals.iter_mut().enumerate() {
            let around = k.saturating_sub(COMPARED)..(k + COMPARED + 1).min(densities.len());
            if densities[k] > OUTLIER_RATIO * median(&densities[around]) {
                let refitted = Residual::new(spectra, residual.place, self.settings, MORE_POLES);
                if let Some(refitted) = refitted {
                    *residual = refitted;
                }
            }
        }
    }

    /// The distance from a position up to which residuals are averaged.
    fn reach(&self, position: f64) -> f64 {
        WIDTH_RATIO * self.settings.half_width(position, self.bin_hz)
    }

    /// The residuals nearer to a position than `reach`.
    fn near(&self, position: f64, reach: f64) -> &[Residual] {
        let residuals = &self.residuals;
        let first =
            residuals.partition_point(|residual| residual.place.position <= position - reach);
        let last = residuals.partition_point(|residual| residual.place.position < position + reach);
        residuals.get(first..last).unwrap_or_default()
    }

    /// E|N|^2 in a bin around a position.
    pub(super) fn power(&self, position: f64) -> f64 {
        let reach = self.reach(position);
        let (mut power, mut freedom) = (0.0, 0.0);
        for residual in self.near(position, reach) {
            let distance = residual.place.position - position;
            let weight = libm::cos(core::f64::consts::FRAC_PI_2 * distance / reach).powi(2);
            power += weight * residual.power;
            freedom += weight * residual.freedom;
        }
        power / freedom
    }
}

/// The median of at least one value.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}
