//! The power of the noise over frequency, from the residuals of local models.
//!
//! A model with one pole cannot follow two modes and a zero between them, and its residual then contains their response. Where a residual
//! exceeds those around it, models with more poles are tried, so that modes close together do not count as noise. A residual below 1 % of
//! the response always counts as noise: models with more poles also follow an error of few readings, as of a late one at a resonance,
//! whose spectrum is smooth.

use super::spectra::{Place, Spectra};
use crate::EstimatorSettings;

/// Residuals are averaged with weights this much wider than those of the models.
const WIDTH_RATIO: f64 = 2.0;
/// Residuals are fitted again from this ratio of the output's power on: 1 % of its amplitude.
const MIN_RELATIVE_POWER: f64 = 1e-4;
/// Residuals this much above the median of those around them are fitted again. Noise with the 12 degrees of freedom of a window exceeds
/// it with a probability below 1e-13, also where the median is 20 % too small.
const OUTLIER_RATIO: f64 = 10.0;
/// Number of residuals to either side that an outlier is compared with. A pair of modes raises those of two neighbours.
const COMPARED: usize = 6;
/// Poles of the models, and of those that are tried where the residual is large.
const POLES: usize = 1;
pub(super) const MORE_POLES: usize = 3;

/// The residual of one local model.
struct Residual {
    place: Place,
    /// sum w |e|^2
    power: f64,
    /// Expected power for noise of power 1.
    freedom: f64,
    /// The power over that of the output.
    relative_power: f64,
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
            relative_power: 1.0 - fit.coherence,
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
            let exceeds_others = densities[k] > OUTLIER_RATIO * median(&densities[around]);
            if exceeds_others && residual.relative_power > MIN_RELATIVE_POWER {
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

#[cfg(test)]
mod tests {
    use nalgebra::Complex;
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::super::record_spectra::RecordSpectra;
    use super::*;

    const BIN_HZ: f64 = 0.05;
    /// The bin of the resonance.
    const RESONANCE: f64 = 600.0;
    const DAMPING_RATIO: f64 = 0.01;
    /// E|N|^2 of the noise that is added to the response.
    const NOISE_POWER: f64 = 1e-6;

    fn resonance(bin: f64, at: f64, damping_ratio: f64) -> Complex<f64> {
        let ratio = bin / at;
        Complex::new(1.0 - ratio * ratio, 2.0 * damping_ratio * ratio).inv()
    }

    /// A resonance, and one of half its damping three bins above it with an amplitude that is given as a ratio of the first; with noise.
    fn with_second_mode(ratio: f64) -> RecordSpectra {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let mut uniform = || random.next_u64() as f64 / u64::MAX as f64 - 0.5;
        // Each part has a variance of half the power; that of `uniform` is 1/12.
        let scale = (6.0 * NOISE_POWER).sqrt();
        let output = (0..2000).map(|bin| {
            let bin = f64::from(bin);
            let second = resonance(bin, RESONANCE + 3.0, 0.5 * DAMPING_RATIO) * (0.5 * ratio);
            let noise = Complex::new(uniform(), uniform()) * scale;
            resonance(bin, RESONANCE, DAMPING_RATIO) + second + noise
        });
        let input = vec![Complex::from(1.0); 2000];
        RecordSpectra::new(input, output.collect(), BIN_HZ)
    }

    /// The power at the resonance.
    fn power_with_second_mode(ratio: f64) -> f64 {
        let settings = EstimatorSettings::default();
        let spectra = with_second_mode(ratio);
        NoiseFloor::new(&spectra, (100.0, 1900.0), &settings).power(RESONANCE)
    }

    #[test]
    fn second_mode_within_a_window_is_no_noise() {
        for ratio in [-1.0, -0.5, 0.5, 1.0] {
            let power = power_with_second_mode(ratio) / NOISE_POWER;
            // With one pole it is 4e6. Windows beside the modes, in which the error is below 1 %, are still fitted with one.
            assert!((0.3..100.0).contains(&power), "{ratio}: {power}");
        }
    }

    #[test]
    fn error_below_one_percent_of_the_response_is_noise() {
        for ratio in [-0.02, 0.02] {
            let power = power_with_second_mode(ratio) / NOISE_POWER;
            // 1 % of the resonance, whose height is 50, would be 2.5e5.
            assert!((10.0..2.5e5).contains(&power), "{ratio}: {power}");
        }
    }

    #[test]
    fn single_mode_leaves_the_noise() {
        let power = power_with_second_mode(0.0) / NOISE_POWER;
        assert!((0.5..2.0).contains(&power), "{power}");
    }
}
