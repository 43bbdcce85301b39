//! Half-widths of the neighbourhoods over frequency, and the frequencies of the result.

use core::ops::RangeInclusive;

use crate::error::check_setting;
use crate::{EstimatorSettings, IdentifyError};

/// Frequencies of the result per half-width.
const FREQUENCIES_PER_HALF_WIDTH: f64 = 2.0;

impl EstimatorSettings {
    /// Checks that the settings are within their bounds.
    pub fn check(&self) -> Result<(), IdentifyError> {
        check_setting(
            "min_half_width_bins",
            self.min_half_width_bins as f64,
            2.0,
            1e4,
        )?;
        check_setting("resolution_ratio", self.resolution_ratio, 0.0, 0.1)?;
        check_setting(
            "frequencies",
            self.frequencies.map_or(2.0, |count| count as f64),
            2.0,
            1e6,
        )?;
        let mut min_hz = f64::MIN_POSITIVE;
        for point in &self.resolution {
            check_setting("resolution.frequency_hz", point.frequency_hz, min_hz, 1e5)?;
            check_setting("resolution.half_width_hz", point.half_width_hz, 1e-6, 1e4)?;
            min_hz = point.frequency_hz.next_up();
        }
        Ok(())
    }

    /// Half-width of the neighbourhood of a position, both in bins.
    pub(super) fn half_width(&self, position: f64, bin_hz: f64) -> f64 {
        self.requested_half_width(position, bin_hz)
            .max(self.min_half_width_bins as f64)
    }

    /// The half-width without its lower limit.
    fn requested_half_width(&self, position: f64, bin_hz: f64) -> f64 {
        if self.resolution.is_empty() {
            return self.resolution_ratio * position;
        }
        let points: Vec<(f64, f64)> = self
            .resolution
            .iter()
            .map(|point| {
                (
                    libm::log(point.frequency_hz),
                    libm::log(point.half_width_hz),
                )
            })
            .collect();
        libm::exp(interpolated(&points, libm::log(position * bin_hz))) / bin_hz
    }

    /// The positions of the result in bins.
    pub(super) fn positions(
        &self,
        bins: &RangeInclusive<usize>,
        band_hz: (f64, f64),
        bin_hz: f64,
    ) -> Vec<f64> {
        let (first, last) = (*bins.start() as f64, *bins.end() as f64);
        match self.frequencies {
            Some(count) => {
                let low = (band_hz.0 / bin_hz).max(first);
                let high = (band_hz.1 / bin_hz).min(last);
                logarithmic(low, high, count)
            }
            None => self.half_width_steps(first, last, bin_hz),
        }
    }

    /// Bin positions with a spacing of half of the half-width.
    fn half_width_steps(&self, first: f64, last: f64, bin_hz: f64) -> Vec<f64> {
        let mut positions = Vec::new();
        let mut bin = first;
        while bin <= last {
            positions.push(bin);
            let step = self.requested_half_width(bin, bin_hz) / FREQUENCIES_PER_HALF_WIDTH;
            bin += step.round().max(1.0);
        }
        positions
    }
}

/// `count` positions from `low` to `high`, evenly on a logarithmic axis.
fn logarithmic(low: f64, high: f64, count: usize) -> Vec<f64> {
    let growth = libm::log(high / low) / (count.max(2) - 1) as f64;
    (0..count)
        .map(|k| (low * libm::exp(growth * k as f64)).clamp(low, high))
        .collect()
}

/// Linear interpolation between points of rising x, constant outside; there is at least one point.
fn interpolated(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.partition_point(|point| point.0 < x);
    let (Some(before), Some(after)) = (points[..after].last(), points.get(after)) else {
        return points[after.min(points.len() - 1)].1;
    };
    before.1 + (x - before.0) / (after.0 - before.0) * (after.1 - before.1)
}
