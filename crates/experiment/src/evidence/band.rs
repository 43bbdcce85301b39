//! The band that a measured response needs: around the crossings of the loop.

use std::f64::consts::TAU;

use crate::certificate::CertificateError;
use bench_control::{ClosedLoop, Margins};

/// The response must reach from this fraction of the lowest crossing of |L| = 1 ...
const BELOW_CROSSING: f64 = 0.5;
/// ... to this multiple of the highest one: there |L| is 1/2 for a slope of -1.
const ABOVE_CROSSING: f64 = 2.0;
/// Two frequencies with a larger ratio between them leave a gap: at a slope of -1, |L| changes by as much.
const MAX_STEP: f64 = 1.2;
/// Highest frequency of a measurement as a ratio of half its rate.
const HIGHEST: f64 = 0.9;

/// A band in hertz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Band {
    pub from_hz: f64,
    pub to_hz: f64,
}

impl Band {
    /// The band that the loop of the model needs: around its crossings, up to the highest frequency that can be measured. `None`
    /// without a crossing. A probe with its own clock has the period `probe_period_s`.
    pub fn needed(
        model: &ClosedLoop,
        margins: &Margins,
        probe_period_s: Option<f64>,
    ) -> Option<Band> {
        let crossings = margins.crossings.iter();
        let crossings_hz = crossings.map(|crossing| crossing.rad_s / TAU);
        let lowest_hz = crossings_hz.clone().reduce(f64::min)?;
        let highest_hz = crossings_hz.reduce(f64::max)?;
        let nyquist_hz = 0.5 / model.plant().period_s();
        let probe_hz = probe_period_s.map_or(f64::INFINITY, |period_s| 0.5 / period_s);
        Some(Band {
            from_hz: BELOW_CROSSING * lowest_hz,
            to_hz: (ABOVE_CROSSING * highest_hz).min(HIGHEST * nyquist_hz.min(probe_hz)),
        })
    }

    /// The first part of the band without one of these frequencies, as a defect.
    pub fn missing_in(&self, frequency_hz: &[f64]) -> Option<CertificateError> {
        let (from_hz, to_hz) = first_gap(frequency_hz, self.from_hz, self.to_hz)?;
        Some(CertificateError::Band {
            from_hz,
            to_hz,
            needed_from_hz: self.from_hz,
            needed_to_hz: self.to_hz,
        })
    }
}

/// The first part of a band in hertz without a frequency.
fn first_gap(frequency_hz: &[f64], from_hz: f64, to_hz: f64) -> Option<(f64, f64)> {
    let inside = frequency_hz.iter().copied();
    let inside = inside.filter(|hz| *hz > from_hz / MAX_STEP && *hz < to_hz * MAX_STEP);
    let mut last_hz = from_hz;
    for hz in inside.chain([to_hz]) {
        if hz > last_hz * MAX_STEP {
            return Some((last_hz, hz));
        }
        last_hz = last_hz.max(hz);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_found_at_each_end_and_inside() {
        let rising: Vec<f64> = (0..60).map(|k| 1.1f64.powi(k)).collect();
        assert_eq!(first_gap(&rising, 1.0, 200.0), None);
        let without_begin = &rising[10..];
        assert_eq!(
            first_gap(without_begin, 1.0, 200.0),
            Some((1.0, rising[10]))
        );
        let (last_hz, to_hz) = (rising[59], 2.0 * rising[59]);
        assert_eq!(first_gap(&rising, 1.0, to_hz), Some((last_hz, to_hz)));
        let gap = [&rising[..20], &rising[30..]].concat();
        assert_eq!(first_gap(&gap, 1.0, 200.0), Some((rising[19], rising[30])));
    }
}
