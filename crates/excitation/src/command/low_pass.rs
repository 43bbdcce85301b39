//! The prefilter: a low-pass without overshoot.

use std::f64::consts::TAU;

use super::filter::CommandFilter;
use super::taps::Taps;

/// The response is cut off where its rest is below this ratio.
const REST: f64 = 1e-12;

/// The critically damped low-pass of second order H(z) = ((1 - a)/(1 - a/z))^2, a = exp(-w T) with w = 2 pi `frequency_hz`: its
/// taps are (1 - a)^2 (k + 1) a^k. Its step does not overshoot, and |H| = 1/2 near `frequency_hz`. It is cut off where the rest of
/// its step is below 1e-12, and scaled to a gain of 1 at low frequency.
pub fn low_pass_taps(frequency_hz: f64, period_s: f64) -> Taps {
    let decay = libm::exp(-TAU * frequency_hz * period_s);
    let mut weights = Vec::new();
    let (mut power, mut rest) = (1.0, 1.0);
    while rest > REST && weights.len() <= CommandFilter::MAX_TAPS {
        let weight = (1.0 - decay) * (1.0 - decay) * (weights.len() + 1) as f64 * power;
        weights.push(weight);
        power *= decay;
        // The rest of the sum after k + 1 taps: a^(k + 1) (1 + (k + 1) (1 - a)).
        rest = power * (1.0 + weights.len() as f64 * (1.0 - decay));
    }
    let taps = Taps::dense(0, weights);
    let sum = taps.sum();
    taps.scaled(1.0 / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 - (1 + (k + 1)(1 - a)) a^(k + 1), the closed form of the step.
    #[test]
    fn step_of_the_prefilter_is_that_of_its_closed_form() {
        let (frequency_hz, period_s) = (20.0, 2e-4);
        let decay = f64::exp(-TAU * frequency_hz * period_s);
        let taps = low_pass_taps(frequency_hz, period_s);
        let mut step = 0.0;
        for (tap, k) in taps.as_slice().iter().zip(1..) {
            step += tap.weight;
            let exact = 1.0 - (1.0 + f64::from(k) * (1.0 - decay)) * decay.powi(k);
            // Cut off at 1e-12; 1100 sums, each rounded at 1e-16.
            assert!((step - exact).abs() < 3e-12, "tap {k}: {step} {exact}");
        }
        assert!((step - 1.0).abs() < 1e-12);
    }
}
