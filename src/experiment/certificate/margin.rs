//! The modulus margin of a loop by a measured response, with a lower bound.
//!
//! ```text
//! L(w) = H(w) R(w) C(w)                           H measured (A to m), C the controller, R the roll-off of a free-running probe
//! m(w) = |1 + L(w)| - 1.96 sigma(w) |R C|         lower 95 % bound at one frequency, within the measured band
//! m(w) = |1 + L model(w)|                         outside of it
//! ```
//!
//! sigma is the standard deviation of the component of the error of H along 1 + L: the error is circular, so it is that of |H|. The
//! bound holds at each frequency, not for all at once.
//!
//! Stability: the model of the loop is stable, and plant and controller are stable apart from integrators, so by Nyquist the measured
//! loop is stable if arg(1 + L) changes over the measured band as it does by the model.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::error::CertificateError;
use crate::control::{ClosedLoop, Margins};
use crate::identify::{Frf, SIGMAS_95};

/// The response must reach from this fraction of the lowest crossing of |L| = 1 ...
const BELOW_CROSSING: f64 = 0.5;
/// ... to this multiple of the highest one: there |L| is 1/2 for a slope of -1.
const ABOVE_CROSSING: f64 = 2.0;
/// Two frequencies with a larger ratio between them leave a gap: at a slope of -1, |L| changes by as much.
const MAX_STEP: f64 = 1.2;
/// Highest frequency of the loop that is examined, as a ratio of half the rate: at half the rate L is real.
const HIGHEST: f64 = 1.0 - 1e-9;

/// The lower bound of the modulus margin of a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowerMargin {
    /// The lower 95 % bound of min |1 + L|.
    pub margin: f64,
    /// Its frequency in hertz.
    pub at_hz: f64,
    /// Whether the loop is stable by the measured response, if it is by the model.
    pub is_stable: bool,
}

/// A loop with the measured response of its plant.
pub(super) struct MeasuredLoop<'a> {
    /// Response from current (A) to position (m), for readings of the mean age.
    pub frf: &'a Frf,
    /// The loop by the model.
    pub model: &'a ClosedLoop,
    /// Period of a probe with its own clock, in seconds.
    pub probe_period_s: Option<f64>,
}

impl MeasuredLoop<'_> {
    /// The lower bound of the modulus margin.
    pub fn lower_margin(&self) -> LowerMargin {
        let (margin, at_hz) = self.in_band().into_iter().chain(self.outside_band()).fold(
            (f64::INFINITY, f64::NAN),
            |least, found| match found.0 < least.0 || found.0.is_nan() {
                true => found,
                false => least,
            },
        );
        LowerMargin {
            margin,
            at_hz,
            is_stable: self.turns_as_by_the_model(),
        }
    }

    /// Refuses a response that does not cover the crossings of |L| = 1 by the model, or has a gap there.
    ///
    /// # Errors
    /// With the first part of the band that is missing.
    pub fn require_band(&self, margins: &Margins) -> Result<(), CertificateError> {
        let crossings_hz = margins
            .crossings
            .iter()
            .map(|crossing| crossing.rad_s / TAU);
        let lowest_hz = crossings_hz.clone().reduce(f64::min);
        let Some((lowest_hz, highest_hz)) = lowest_hz.zip(crossings_hz.reduce(f64::max)) else {
            return Ok(());
        };
        let needed_from_hz = BELOW_CROSSING * lowest_hz;
        let needed_to_hz = (ABOVE_CROSSING * highest_hz).min(self.last_hz());
        match first_gap(&self.frf.frequency_hz, needed_from_hz, needed_to_hz) {
            None => Ok(()),
            Some((from_hz, to_hz)) => Err(CertificateError::Band {
                from_hz,
                to_hz,
                needed_from_hz,
                needed_to_hz,
            }),
        }
    }

    /// Highest frequency at which a gap can be filled by a measurement, in hertz.
    fn last_hz(&self) -> f64 {
        let nyquist_hz = 0.5 / self.model.plant().period_s();
        let probe_hz = self
            .probe_period_s
            .map_or(f64::INFINITY, |period_s| 0.5 / period_s);
        0.9 * nyquist_hz.min(probe_hz)
    }

    /// Lower bound and frequency in hertz at each frequency of the response.
    fn in_band(&self) -> Vec<(f64, f64)> {
        let points = self.frf.frequency_hz.iter().enumerate();
        points
            .map(|(k, hz)| (self.lower_distance(k), *hz))
            .collect()
    }

    fn lower_distance(&self, k: usize) -> f64 {
        let controller = self.controller(self.frf.frequency_hz[k]);
        let distance = (self.frf.response[k] * controller + 1.0).norm();
        distance - SIGMAS_95 * self.frf.magnitude_sigma[k] * controller.norm()
    }

    /// R C at a frequency.
    fn controller(&self, hz: f64) -> Complex<f64> {
        self.model.law_response(TAU * hz) * self.roll_off(hz)
    }

    /// The mean of exp(-j w t) over the ages t of the readings of a free-running probe, about the mean age: sin(x)/x, x = w T/2.
    fn roll_off(&self, hz: f64) -> f64 {
        let x = PI * hz * self.probe_period_s.unwrap_or(0.0);
        match x == 0.0 {
            true => 1.0,
            false => libm::sin(x) / x,
        }
    }

    /// |1 + L| and the frequency in hertz outside of the measured band, by the model.
    fn outside_band(&self) -> Vec<(f64, f64)> {
        let (from_rad_s, to_rad_s) = self.band_rad_s();
        let nyquist_rad_s = HIGHEST * PI / self.model.plant().period_s();
        let low = 1e-3 * from_rad_s;
        let below = self.model.frequencies(low, from_rad_s);
        let above = match to_rad_s < nyquist_rad_s {
            true => self.model.frequencies(to_rad_s, nyquist_rad_s),
            false => Vec::new(),
        };
        let frequencies = below.into_iter().chain(above);
        let distance = |w: f64| (self.model.sampled_loop(w) + 1.0).norm();
        frequencies.map(|w| (distance(w), w / TAU)).collect()
    }

    /// Lowest and highest measured frequency in rad/s.
    fn band_rad_s(&self) -> (f64, f64) {
        let frequency_hz = &self.frf.frequency_hz;
        let ends = [frequency_hz.first(), frequency_hz.last()];
        let [from, to] = ends.map(|hz| TAU * hz.copied().unwrap_or_default());
        (from, to)
    }

    /// Whether arg(1 + L) changes over the measured band as by the model, to within half a turn. The difference is a whole number
    /// of turns, apart from the errors at the two ends.
    fn turns_as_by_the_model(&self) -> bool {
        let points = self.frf.frequency_hz.iter().zip(&self.frf.response);
        let measured = points.map(|(hz, response)| response * self.controller(*hz) + 1.0);
        let (from_rad_s, to_rad_s) = self.band_rad_s();
        let model = self.model.frequencies(from_rad_s, to_rad_s).into_iter();
        let ends = std::iter::once(from_rad_s).chain(model).chain([to_rad_s]);
        let model = ends.map(|w| self.model.sampled_loop(w) + 1.0);
        let difference = argument_change(measured) - argument_change(model);
        difference.abs() < PI
    }
}

/// Change of the argument along a curve through these points, each step within half a turn, in radians.
fn argument_change(points: impl Iterator<Item = Complex<f64>>) -> f64 {
    let mut change = 0.0;
    let mut last: Option<Complex<f64>> = None;
    for point in points {
        change += last.map_or(0.0, |last| (point / last).arg());
        last = Some(point);
    }
    change
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

    #[test]
    fn argument_change_counts_turns() {
        let circle = (0..=40).map(|k| Complex::from_polar(2.0, f64::from(k) * 0.05 * TAU));
        // 40 steps of 0.05 turns are two turns.
        assert!((argument_change(circle) - 2.0 * TAU).abs() < 1e-12);
    }
}
