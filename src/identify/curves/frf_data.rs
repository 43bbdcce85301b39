//! The record cut into frf_data of neighbouring bins: what a parametric fit takes, where each datum must be independent of
//! the next and no curve may be smoothed.
//!
//! In a block, `H = sum Y conj(R) / sum U conj(R)`, with U itself for the instrument R in open loop, is the mean of H over its
//! bins, weighted with U conj(R), whatever the shape of H, with the variance `S sum |R|^2 / |sum U conj(R)|^2`, S being the
//! power of the noise in a bin, by what rational curves leave around it: an average would take the top of a resonance for
//! noise, and the fit would trust what lies beside it too much. A model is compared with it by its mean at f -+ spread, which
//! has the block's first three moments: an error of the fourth order in width over width of a mode.

use core::ops::RangeInclusive;

use nalgebra::Complex;

use super::bins::Bins;
use super::noise_floor::NoiseFloor;
use super::record::Record;
use crate::identify::{EstimatorSettings, FrfDatum, IdentifyError, Signals, band};

/// Width of a block as a ratio of frequency.
const WIDTH_RATIO: f64 = 0.0005;

/// The frf_data of a record that begins and ends at rest, each a twentieth of a percent of its frequency wide and one bin at least;
/// those without input or without any noise are left out. Frequencies rise. Of the settings, the least half-width counts.
///
/// # Errors
/// Those of [`super::local::estimate`].
pub fn frf_data(
    signals: &Signals,
    band_hz: (f64, f64),
    settings: &EstimatorSettings,
) -> Result<Vec<FrfDatum>, IdentifyError> {
    settings.check()?;
    signals.check()?;
    let bins = band::bins(band_hz, signals.rate_hz, signals.len())?;
    let frf_data = cut(&Record::new(signals), &bins, settings);
    let (low_hz, high_hz) = band_hz;
    if frf_data.is_empty() {
        Err(IdentifyError::NotExcited { low_hz, high_hz })
    } else {
        Ok(frf_data)
    }
}

/// The frf_data between two bins.
pub(super) fn cut(
    of: &impl Bins,
    bins: &RangeInclusive<usize>,
    settings: &EstimatorSettings,
) -> Vec<FrfDatum> {
    let noise = noise_of(settings);
    let floor = NoiseFloor::of(of, (*bins.start() as f64, *bins.end() as f64), &noise);
    let (mut frf_data, mut low) = (Vec::new(), *bins.start());
    while low <= *bins.end() {
        let next = low + (WIDTH_RATIO * low as f64).floor().max(1.0) as usize;
        let high = (next - 1).min(*bins.end());
        let middle = 0.5 * (low + high) as f64;
        frf_data.extend(block(
            of,
            low,
            high,
            floor.power(middle, noise.half_width(middle, of.bin_hz())),
        ));
        low = next;
    }
    frf_data
}

/// The curves whose residual is the noise.
fn noise_of(settings: &EstimatorSettings) -> EstimatorSettings {
    EstimatorSettings {
        min_half_width_bins: settings.min_half_width_bins,
        ..EstimatorSettings::default()
    }
}

fn block(of: &impl Bins, low: usize, high: usize, noise: f64) -> Option<FrfDatum> {
    let sum = |term: &dyn Fn(usize) -> Complex<f64>| (low..=high).map(term).sum::<Complex<f64>>();
    let (drive, weight) = (sum(&|k| of.drive(k)), |k: usize| of.drive(k).norm());
    let all = (low..=high).map(weight).sum::<f64>();
    let moment = |term: &dyn Fn(f64) -> f64| {
        (low..=high)
            .map(|k| weight(k) * term(k as f64))
            .sum::<f64>()
            / all
    };
    let centre = low as f64 + moment(&|k| k - low as f64);
    let block = FrfDatum {
        frequency_hz: centre * of.bin_hz(),
        spread_hz: moment(&|k| (k - centre) * (k - centre)).sqrt() * of.bin_hz(),
        response: sum(&|k| of.cross(k)) / drive,
        variance: noise * (low..=high).map(|k| of.power(k)).sum::<f64>() / drive.norm_sqr(),
    };
    let sound =
        block.variance > 0.0 && block.variance.is_finite() && block.response.norm().is_finite();
    (sound && centre.is_finite()).then_some(block)
}
