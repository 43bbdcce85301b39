//! Amplitude over frequency by a response: the same displacement at all frequencies, up to the limit of the current.
//!
//! ```text
//!  A(f) = min(travel / |G(f)|, limit(f))
//! ```
//!
//! At resonances the travel stays within the interlocks, and at zeros the current is the largest. The curve is simplified to a
//! few points, joined by straight lines on logarithmic axes that nowhere lie above it.

use super::amplitude::AmplitudePoint;
use super::limits::Limits;
use bench_base::units::rad_s;

/// Largest number of points of an amplitude curve.
pub const MAX_POINTS: usize = 64;
/// Largest deviation in ln A of the simplified curve.
const MAX_DEVIATION: f64 = 0.01;

/// Limits of the current of a sine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentLimit {
    /// Amplitude in amperes at any frequency.
    pub current_a: f64,
    /// Largest change in amperes per second: A <= slew_a_per_s/(2 pi f).
    pub slew_a_per_s: f64,
}

impl CurrentLimit {
    /// The limits of motor and amplifier times a ratio. A sine with the continuous current as RMS has sqrt 2 times its amplitude.
    pub fn new(limits: &Limits, ratio: f64) -> CurrentLimit {
        let continuous_a = std::f64::consts::SQRT_2 * limits.continuous_current_a;
        let current_a = continuous_a
            .min(limits.peak_current_a)
            .min(limits.amplifier_current_a);
        CurrentLimit {
            current_a: ratio * current_a,
            slew_a_per_s: ratio * limits.slew_a_per_s,
        }
    }

    /// The largest amplitude at a frequency in amperes.
    pub fn at_a(&self, frequency_hz: f64) -> f64 {
        self.current_a.min(self.slew_a_per_s / rad_s(frequency_hz))
    }

    /// The amplitude that moves the stage by `travel_m` where the response has this gain, up to the limit.
    fn amplitude_a(&self, frequency_hz: f64, gain: f64, travel_m: f64) -> f64 {
        let limit_a = self.at_a(frequency_hz);
        if gain > 0.0 {
            limit_a.min(travel_m / gain)
        } else {
            limit_a
        }
    }
}

/// The amplitude that moves the stage by `travel_m`, up to `limit`. `response` is (frequency in hertz, |G| in metres per
/// ampere) with rising frequencies; the result has at most [`MAX_POINTS`] points. The largest amplitude is at most `span`
/// times the smallest one.
pub fn shaped_amplitude(
    response: &[(f64, f64)],
    travel_m: f64,
    limit: CurrentLimit,
    span: f64,
) -> Vec<AmplitudePoint> {
    let response = response.iter();
    let mut curve: Vec<(f64, f64)> = response
        .map(|(f, gain)| (*f, limit.amplitude_a(*f, *gain, travel_m)))
        .map(|(frequency_hz, current_a)| (libm::log(frequency_hz), libm::log(current_a)))
        .collect();
    let least = curve.iter().map(|(_, a)| *a).fold(f64::INFINITY, f64::min);
    let highest = least + libm::log(span);
    curve.iter_mut().for_each(|(_, a)| *a = a.min(highest));
    let points = simplified(&curve).into_iter();
    let points = points.map(|(f, a)| AmplitudePoint {
        frequency_hz: libm::exp(f),
        current_a: libm::exp(a),
    });
    points.collect()
}

/// The curve through a few of its points, lowered so that it lies nowhere above the original.
fn simplified(curve: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let [first, .., last] = curve else {
        return curve.to_vec();
    };
    let mut kept = vec![*first, *last];
    while kept.len() < MAX_POINTS {
        let errors = deviations(curve, &kept).map(f64::abs).enumerate();
        let worst = errors.max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((index, _)) = worst.filter(|(_, error)| *error > MAX_DEVIATION) else {
            break;
        };
        let place = kept.partition_point(|(f, _)| *f < curve[index].0);
        kept.insert(place, curve[index]);
    }
    let above = deviations(curve, &kept).fold(0.0, f64::max);
    kept.iter().map(|(f, a)| (*f, a - above)).collect()
}

/// Distances by which the lines through `kept` lie above each point of the curve.
fn deviations(curve: &[(f64, f64)], kept: &[(f64, f64)]) -> impl Iterator<Item = f64> {
    curve.iter().map(|(f, a)| {
        let after = kept
            .partition_point(|(at, _)| at <= f)
            .clamp(1, kept.len() - 1);
        let ((f0, a0), (f1, a1)) = (kept[after - 1], kept[after]);
        a0 + (a1 - a0) * (f - f0) / (f1 - f0) - a
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AmplitudeCurve;

    const CAP: CurrentLimit = CurrentLimit {
        current_a: 2.0,
        slew_a_per_s: 4000.0,
    };

    /// |1e-4 w0^2/(s^2 + 2 zeta w0 s + w0^2)| and |1 + s^2/wz^2| together: resonance at 30 Hz, zero at 80 Hz.
    fn gain(f: f64) -> f64 {
        let (x, z) = (f / 30.0, f / 80.0);
        let resonance = ((1.0 - x * x).powi(2) + (2.0 * 0.009 * x).powi(2)).sqrt();
        1e-4 * ((1.0 - z * z).powi(2) + 1e-6).sqrt() / resonance
    }

    fn response() -> Vec<(f64, f64)> {
        (0..=4000)
            .map(|k| 0.1 * 5000f64.powf(f64::from(k) / 4000.0))
            .map(|f| (f, gain(f)))
            .collect()
    }

    #[test]
    fn displacement_is_constant_up_to_the_limit_of_the_current() {
        let points = shaped_amplitude(&response(), 100e-6, CAP, f64::INFINITY);
        assert!(
            (10..=MAX_POINTS).contains(&points.len()),
            "{}",
            points.len()
        );
        let amplitude = AmplitudeCurve::of_current(&points);
        for (f, gain) in response() {
            let (current_a, cap_a) = (
                amplitude.at(f.ln()),
                2f64.min(4000.0 / (std::f64::consts::TAU * f)),
            );
            let wanted_a = cap_a.min(100e-6 / gain);
            // The current exceeds the wanted value only by rounding; it is below by at most twice the tolerance of
            // the simplification.
            let ratio = current_a / wanted_a;
            assert!(
                (0.9..=1.0 + 1e-9).contains(&ratio),
                "{f} Hz: {current_a} of {wanted_a} A"
            );
        }
        let at = |f: f64| amplitude.at(f.ln());
        // At the resonance Q = 55.6, reduced by 1 - (30/80)^2: 4.77 mm/A and 21 mA; at the antiresonance nearly the
        // limit of 2 A.
        assert!(
            (0.019..0.0212).contains(&at(30.0)) && at(80.0) > 1.8,
            "{} {}",
            at(30.0),
            at(80.0)
        );
    }

    #[test]
    fn ratio_of_largest_to_smallest_amplitude_is_the_span() {
        let points = shaped_amplitude(&response(), 100e-6, CAP, 50.0);
        let least = points
            .iter()
            .map(|p| p.current_a)
            .fold(f64::INFINITY, f64::min);
        let most = points.iter().map(|p| p.current_a).fold(0.0, f64::max);
        assert!(
            (45.0..=50.0 + 1e-6).contains(&(most / least)),
            "{}",
            most / least
        );
    }

    #[test]
    fn noisy_or_zero_response_gives_a_valid_curve() {
        let noisy: Vec<(f64, f64)> = (1..3000)
            .map(|k| (f64::from(k), 1e-6 * (1.0 + f64::from(k * k % 97))))
            .collect();
        let points = shaped_amplitude(&noisy, 1e-4, CAP, f64::INFINITY);
        assert_eq!(points.len(), MAX_POINTS);
        assert!(
            points
                .windows(2)
                .all(|pair| pair[0].frequency_hz < pair[1].frequency_hz)
        );
        let dead = shaped_amplitude(&[(1.0, 0.0), (10.0, 0.0)], 1e-4, CAP, f64::INFINITY);
        assert_eq!(
            dead.iter()
                .map(|p| (p.current_a * 1e9).round() / 1e9)
                .collect::<Vec<_>>(),
            [2.0, 2.0]
        );
    }
}
