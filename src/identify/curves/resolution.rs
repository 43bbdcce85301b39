//! Half-widths over frequency, and the frequencies of the result.

use core::ops::RangeInclusive;

use super::settings::EstimatorSettings;

/// Frequencies are so many to a half-width.
const TO_A_HALF_WIDTH: f64 = 2.0;

impl EstimatorSettings {
    /// Half-width of the neighbourhood of a place, both in bins.
    pub(super) fn half_width(&self, place: f64, bin_hz: f64) -> f64 {
        self.asked_half_width(place, bin_hz)
            .max(self.min_half_width_bins)
    }

    /// The same without the least one.
    fn asked_half_width(&self, place: f64, bin_hz: f64) -> f64 {
        if self.resolution.is_empty() {
            return self.resolution_ratio * place;
        }
        let log = |x: f64| libm::log(x);
        let points: Vec<(f64, f64)> = self
            .resolution
            .iter()
            .map(|point| (log(point.frequency_hz), log(point.half_width_hz)))
            .collect();
        libm::exp(interpolated(&points, log(place * bin_hz))) / bin_hz
    }

    /// The places, in bins, at which to report: evenly on a logarithmic axis, or on bins half of a half-width apart.
    pub(super) fn places(
        &self,
        bins: &RangeInclusive<usize>,
        band_hz: (f64, f64),
        bin_hz: f64,
    ) -> Vec<f64> {
        let (first, last) = (*bins.start() as f64, *bins.end() as f64);
        let Some(count) = self.frequencies else {
            let next = |bin: &f64| {
                bin + (self.asked_half_width(*bin, bin_hz) / TO_A_HALF_WIDTH)
                    .round()
                    .max(1.0)
            };
            return core::iter::successors(Some(first), |bin| Some(next(bin)))
                .take_while(|bin| *bin <= last)
                .collect();
        };
        let low = (band_hz.0 / bin_hz).max(first);
        let high = (band_hz.1 / bin_hz).min(last);
        let growth = libm::log(high / low) / (count.max(2) - 1) as f64;
        (0..count)
            .map(|k| (low * libm::exp(growth * k as f64)).clamp(low, high))
            .collect()
    }
}

/// Straight lines through points of rising x, constant outside; of one point at least.
fn interpolated(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.partition_point(|point| point.0 < x);
    let (Some(before), Some(after)) = (points[..after].last(), points.get(after)) else {
        return points[after.min(points.len() - 1)].1;
    };
    before.1 + (x - before.0) / (after.0 - before.0) * (after.1 - before.1)
}
