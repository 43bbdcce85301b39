//! How large an excitation is over frequency, and how it comes and goes.

use std::f64::consts::PI;

use crate::config::AmplitudePoint;

/// A(f): straight lines over ln f, constant beyond the ends.
#[derive(Clone, Debug)]
pub struct Amplitude {
    /// ln f and ln A of each point.
    points: Vec<(f64, f64)>,
}

impl Amplitude {
    /// Through the points, whose frequencies rise.
    pub fn new(points: &[AmplitudePoint]) -> Amplitude {
        let ln = |p: &AmplitudePoint| (libm::log(p.frequency_hz), libm::log(p.current_a));
        Amplitude {
            points: points.iter().map(ln).collect(),
        }
    }

    /// Amperes at the logarithm of a frequency in hertz; 0 without a point.
    pub fn at(&self, ln_frequency: f64) -> f64 {
        let after = self
            .points
            .partition_point(|(ln_f, _)| *ln_f <= ln_frequency);
        let ln_a = match (
            after.checked_sub(1).and_then(|i| self.points.get(i)),
            self.points.get(after),
        ) {
            (Some(&(f0, a0)), Some(&(f1, a1))) => a0 + (a1 - a0) * (ln_frequency - f0) / (f1 - f0),
            (Some(&(_, a)), None) | (None, Some(&(_, a))) => a,
            (None, None) => return 0.0,
        };
        libm::exp(ln_a)
    }

    /// The least and the largest value from one frequency to another, both in hertz.
    pub fn range_a(&self, low_hz: f64, high_hz: f64) -> (f64, f64) {
        let (low, high) = (libm::log(low_hz), libm::log(high_hz));
        let inside = self
            .points
            .iter()
            .filter(|(ln_f, _)| (low..=high).contains(ln_f))
            .map(|(ln_f, _)| *ln_f);
        let values = inside.chain([low, high]).map(|ln_f| self.at(ln_f));
        values.fold((f64::INFINITY, 0.0), |(least, most), a| {
            (least.min(a), a.max(most))
        })
    }
}

/// (1 - cos(pi t/T))/2 from 0 to 1 over T, 1 after.
pub(super) fn fade(time_s: f64, length_s: f64) -> f64 {
    if time_s >= length_s {
        1.0
    } else {
        0.5 - 0.5 * libm::cos(PI * time_s.max(0.0) / length_s)
    }
}
