//! The transient of a record that begins or ends in motion.
//!
//! A transform treats the record as one period of a periodic signal. The state of the plant at the beginning is not the one at the end,
//! and the difference decays during the record: `Y_k = G(f_k) U_k + T(f_k) + N_k`, with G and T smooth over frequency, and with the same
//! poles (R. Pintelon, J. Schoukens, System Identification, 2nd ed., section 6.3.2). Where U is as rough as that of noise, local models
//! of neighbouring bins separate T from G U. It decreases with the length of the record as one over its square root relative to G U.
//!
//! The windows are wide, so that the models have few unknowns for their bins: what is subtracted contains few per cent of the noise.

use nalgebra::Complex;

use super::model;
use super::noise_floor::MORE_POLES;
use super::record_spectra::RecordSpectra;
use super::spectra::{Place, Spectra};
use crate::EstimatorSettings;

/// Half-width of a window in bins.
const HALF_WIDTH: f64 = 48.0;
/// The distance of the windows, in bins.
const STEP: f64 = 12.0;
/// The transient of a window is used up to this ratio of its half-width; it is less certain beyond.
const USED: f64 = 0.5;

/// The spectra without the transient between two positions. Where there is no input the output stays as it is.
pub(super) fn subtracted(spectra: &RecordSpectra, (low, high): (f64, f64)) -> RecordSpectra {
    let first = low.max(1.0) as usize;
    let last = (high as usize).min(spectra.last_bin());
    let settings = EstimatorSettings {
        transient: true,
        ..EstimatorSettings::default()
    };
    let mut mean = WeightedMean::new(first, last);
    let mut position = first as f64;
    while position < last as f64 + STEP {
        mean.add(spectra, position, &settings);
        position += STEP;
    }
    spectra.minus(first, &mean.values())
}

/// The mean of overlapping windows, bin by bin.
struct WeightedMean {
    first: usize,
    sums: Vec<Complex<f64>>,
    weights: Vec<f64>,
}

impl WeightedMean {
    fn new(first: usize, last: usize) -> Self {
        let count = (last + 1).saturating_sub(first);
        Self {
            first,
            sums: vec![Complex::default(); count],
            weights: vec![0.0; count],
        }
    }

    /// Adds the transient around a position, if there is input.
    fn add(&mut self, spectra: &RecordSpectra, position: f64, settings: &EstimatorSettings) {
        let place = Place {
            position,
            half_width: HALF_WIDTH,
        };
        let window = spectra.window(place);
        let Some(fitted) = model::fit(&window, settings, MORE_POLES) else {
            return;
        };
        for (j, transient) in fitted.transient.iter().enumerate() {
            let part = window.x[j] / USED;
            let Some(of_range) = (window.first_bin + j).checked_sub(self.first) else {
                continue;
            };
            if part.abs() >= 1.0 || of_range >= self.sums.len() {
                continue;
            }
            let weight = libm::cos(core::f64::consts::FRAC_PI_2 * part).powi(2);
            self.sums[of_range] += transient.unscale(window.root_weight[j]) * weight;
            self.weights[of_range] += weight;
        }
    }

    /// Zero where no window has a transient.
    fn values(&self) -> Vec<Complex<f64>> {
        let bins = self.sums.iter().zip(&self.weights);
        let mean = |(sum, weight): (&Complex<f64>, &f64)| {
            if *weight > 0.0 {
                sum.unscale(*weight)
            } else {
                Complex::default()
            }
        };
        bins.map(mean).collect()
    }
}
