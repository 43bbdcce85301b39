//! The points of a response whose errors are independent, for a fit.
//!
//! A window, an average over neighbours or a local model couples the errors of neighbouring points. Points at least a noise bandwidth B
//! apart have nearly independent errors: of N points at a spacing d, as many as N d/B count. For the lines under a Hann window B is 1.5
//! to 2 spacings. Between them no point is averaged: a mean over a resonance would smear it, and has no smaller error.
//!
//! A fit that took all of them, with variances larger by B/d, would be too certain where no neighbours are merged: it estimates the
//! noise from its residual, which does not show the factor.

use crate::scatter::Scatter;
use crate::{Frf, FrfDatum};

/// Rounding of frequencies in a file, as a ratio of the resolution.
const ROUNDING: f64 = 0.01;

/// Each point that is a resolution above the one before; a point without a standard deviation cannot be weighted.
pub(super) fn independent(frf: &Frf) -> Vec<FrfDatum> {
    let resolution_hz = resolutions_hz(frf);
    let mut data: Vec<FrfDatum> = Vec::new();
    let mut next_hz = 0.0;
    for (k, resolution_hz) in resolution_hz.into_iter().enumerate() {
        let (frequency_hz, sigma) = (frf.frequency_hz[k], frf.magnitude_sigma[k]);
        if frequency_hz < next_hz || !sigma.is_normal() {
            continue;
        }
        next_hz = frequency_hz + (1.0 - ROUNDING) * resolution_hz;
        data.push(FrfDatum {
            frequency_hz,
            spread_hz: 0.0,
            response: frf.response[k],
            variance: 2.0 * sigma * sigma,
        });
    }
    data
}

/// The noise bandwidths. If that of a point is its spacing or less, as without a column in the file, that of the scatter counts.
fn resolutions_hz(frf: &Frf) -> Vec<f64> {
    let scatter = Scatter::of(&frf.frequency_hz, &frf.response);
    let resolution = |k: usize| {
        let spacing_hz = spacing_hz(&frf.frequency_hz, k);
        let stated_hz = frf.resolution_hz[k];
        if stated_hz > (1.0 + ROUNDING) * spacing_hz {
            return stated_hz;
        }
        let correlated = scatter
            .as_ref()
            .map_or(1, |found| found.correlated_points[k]);
        correlated as f64 * spacing_hz
    };
    (0..frf.len()).map(resolution).collect()
}

/// The distance to the nearer neighbour; 0 without one.
fn spacing_hz(frequency_hz: &[f64], k: usize) -> f64 {
    let near = &frequency_hz[k.saturating_sub(1)..(k + 2).min(frequency_hz.len())];
    let nearer = near.windows(2).map(|pair| pair[1] - pair[0]);
    nearer.reduce(f64::min).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FrfPoint;
    use nalgebra::Complex;

    /// Points at a spacing of 0.5 Hz.
    fn frf(count: u32, resolution_hz: f64) -> Frf {
        let mut frf = Frf::default();
        frf.extend((1..=count).map(|k| FrfPoint {
            frequency_hz: 0.5 * f64::from(k),
            response: Complex::new(1.0, 0.1 * f64::from(k)),
            coherence: 1.0,
            variance: 2e-6,
            resolution_hz,
        }));
        frf
    }

    #[test]
    fn points_within_a_resolution_count_once() {
        for (resolution_hz, count) in [(0.5, 8), (0.75, 4), (1.0, 4), (2.0, 2), (0.1, 8)] {
            let data = independent(&frf(8, resolution_hz));
            assert_eq!(data.len(), count, "{resolution_hz}");
            assert!(
                data.iter()
                    .all(|datum| (datum.variance / 2e-6 - 1.0).abs() < 1e-12)
            );
        }
    }

    #[test]
    fn point_without_a_standard_deviation_is_left_out() {
        let mut frf = frf(4, 0.5);
        frf.magnitude_sigma[1] = 0.0;
        frf.magnitude_sigma[2] = f64::INFINITY;
        let data = independent(&frf);
        let frequencies: Vec<f64> = data.iter().map(|datum| datum.frequency_hz).collect();
        assert_eq!(frequencies, [0.5, 2.0]);
    }
}
