//! Amplitude over frequency by a response: as much displacement everywhere, up to what the current may be.
//!
//! ```text
//!  A(f) = min(travel / |G(f)|, cap(f))
//! ```
//!
//! so that resonances are not driven into the interlocks, and zeros get as much current as there is. The curve is put
//! into few points, joined by straight lines on logarithmic axes, that nowhere lie above it.

use crate::config::{AmplitudePoint, Config};

/// Points that an amplitude may have.
pub const MOST_POINTS: usize = 64;
/// Distance in ln A that a curve through fewer points may have.
const CLOSE: f64 = 0.01;

/// What the current may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cap {
    /// Amplitude in amperes at any frequency.
    pub current_a: f64,
    /// Change in amperes per second: A <= this/(2 pi f).
    pub slew_a_per_s: f64,
}

impl Cap {
    /// A share of what motor and amplifier allow; a sine of the continuous current has sqrt 2 times its amplitude.
    pub fn of(config: &Config) -> Cap {
        let (motor, amplifier, share) = (&config.motor, &config.amplifier, config.shape.current_ratio);
        let continuous_a = std::f64::consts::SQRT_2 * motor.continuous_current_a();
        let current_a = continuous_a.min(motor.peak_current_a()).min(amplifier.current_limit_a);
        Cap { current_a: share * current_a, slew_a_per_s: share * amplifier.slew_limit_a_per_s }
    }

    fn at_a(&self, frequency_hz: f64) -> f64 {
        self.current_a.min(self.slew_a_per_s / (2.0 * std::f64::consts::PI * frequency_hz))
    }
}

/// The amplitude by which |G| moves the stage by `travel_m`, up to `cap`; `response` is (frequency in hertz, |G| in metres per
/// ampere) with rising frequencies. At most [`MOST_POINTS`] points. `span` is how many times the least amplitude the largest
/// may be.
pub fn shaped(response: &[(f64, f64)], travel_m: f64, cap: Cap, span: f64) -> Vec<AmplitudePoint> {
    let wanted = |(frequency_hz, gain): &(f64, f64)| {
        let limit_a = cap.at_a(*frequency_hz);
        let current_a = if *gain > 0.0 { limit_a.min(travel_m / gain) } else { limit_a };
        (libm::log(*frequency_hz), libm::log(current_a))
    };
    let mut curve: Vec<(f64, f64)> = response.iter().map(wanted).collect();
    let least = curve.iter().map(|(_, a)| *a).fold(f64::INFINITY, f64::min);
    curve.iter_mut().for_each(|(_, a)| *a = a.min(least + libm::log(span)));
    simplified(&curve)
        .into_iter()
        .map(|(f, a)| AmplitudePoint { frequency_hz: libm::exp(f), current_a: libm::exp(a) })
        .collect()
}

/// The curve by few of its points, lowered to where they lie nowhere above it.
fn simplified(curve: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let [first, .., last] = curve else { return curve.to_vec() };
    let mut kept = vec![*first, *last];
    while kept.len() < MOST_POINTS {
        let far = |(_, off): &(usize, f64)| off.abs();
        let worst = off(curve, &kept).enumerate().max_by(|a, b| far(a).total_cmp(&far(b)));
        let Some((index, _)) = worst.filter(|(_, off)| off.abs() > CLOSE) else { break };
        let place = kept.partition_point(|(f, _)| *f < curve[index].0);
        kept.insert(place, curve[index]);
    }
    let above = off(curve, &kept).fold(0.0, f64::max);
    kept.iter().map(|(f, a)| (*f, a - above)).collect()
}

/// By how much the lines through `kept` lie above each point of the curve.
fn off(curve: &[(f64, f64)], kept: &[(f64, f64)]) -> impl Iterator<Item = f64> {
    curve.iter().map(|(f, a)| {
        let after = kept.partition_point(|(at, _)| at <= f).clamp(1, kept.len() - 1);
        let ((f0, a0), (f1, a1)) = (kept[after - 1], kept[after]);
        a0 + (a1 - a0) * (f - f0) / (f1 - f0) - a
    })
}
