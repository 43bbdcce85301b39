//! Amplitude over frequency, and the fade at both ends.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The amplitude of an excitation at a frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmplitudePoint {
    /// Frequency in hertz, rising from point to point.
    #[schemars(range(min = 1e-4, max = 1e5))]
    pub frequency_hz: f64,
    /// Amplitude in amperes.
    #[schemars(range(min = 1e-9, max = 1000.0))]
    pub current_a: f64,
}

/// The amplitude of a swept reference at a frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TravelPoint {
    /// Frequency in hertz, rising from point to point.
    #[schemars(range(min = 1e-4, max = 1e5))]
    pub frequency_hz: f64,
    /// Amplitude in metres.
    #[schemars(range(min = 1e-12, max = 1.0))]
    pub amplitude_m: f64,
}

/// A(f): straight lines on logarithmic axes, constant beyond the ends. The unit is that of its points.
#[derive(Clone, Debug)]
pub struct AmplitudeCurve {
    /// ln f and ln A of each point.
    points: Vec<(f64, f64)>,
}

impl AmplitudeCurve {
    /// A curve in amperes, through points of rising frequency.
    pub fn of_current(points: &[AmplitudePoint]) -> AmplitudeCurve {
        AmplitudeCurve::new(points.iter().map(|p| (p.frequency_hz, p.current_a)))
    }

    /// A curve in metres, through points of rising frequency.
    pub fn of_travel(points: &[TravelPoint]) -> AmplitudeCurve {
        AmplitudeCurve::new(points.iter().map(|p| (p.frequency_hz, p.amplitude_m)))
    }

    fn new(points: impl Iterator<Item = (f64, f64)>) -> AmplitudeCurve {
        let points = points.map(|(frequency_hz, a)| (libm::log(frequency_hz), libm::log(a)));
        AmplitudeCurve {
            points: points.collect(),
        }
    }

    /// The amplitude at `ln_frequency`, the natural logarithm of the frequency in hertz; 0 if the curve has no
    /// points.
    pub fn at(&self, ln_frequency: f64) -> f64 {
        let after = self
            .points
            .partition_point(|(ln_f, _)| *ln_f <= ln_frequency);
        let before = after.checked_sub(1).and_then(|i| self.points.get(i));
        let ln_a = match (before, self.points.get(after)) {
            (Some(&(f0, a0)), Some(&(f1, a1))) => a0 + (a1 - a0) * (ln_frequency - f0) / (f1 - f0),
            (Some(&(_, a)), None) | (None, Some(&(_, a))) => a,
            (None, None) => return 0.0,
        };
        libm::exp(ln_a)
    }

    /// The smallest and the largest amplitude between two frequencies in hertz.
    pub fn range(&self, low_hz: f64, high_hz: f64) -> (f64, f64) {
        let (low, high) = (libm::log(low_hz), libm::log(high_hz));
        let frequencies = self.points.iter().map(|(ln_f, _)| *ln_f);
        let inside = frequencies.filter(|ln_f| (low..=high).contains(ln_f));
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
