//! The band that an input excites, found from its spectrum.
//!
//! ```text
//! P(f)     mean of |U|^2 over +-3 % of f, and at least +-8 bins
//! excited  P >= 1e-3 max P,  or  f P >= 1e-2 max f P          (a white and a pink spectrum)
//! ```
//!
//! The band reaches from the lowest to the highest excited bin. A sweep falls by far more than these ratios within a few bins of
//! its end; the noise of a measured current, and its harmonics, lie below them.

use core::ops::RangeInclusive;

use super::Signals;
use super::fft::RealFft;

/// Half-width of the mean as a ratio of frequency.
const WIDTH_RATIO: f64 = 0.03;
/// Smallest half-width of the mean in bins.
const MIN_HALF_WIDTH: usize = 8;
/// Smallest ratio of the power of an excited bin to the largest: -30 dB.
const POWER_RATIO: f64 = 1e-3;
/// The same of the power times frequency, which is constant in a logarithmic sweep: -20 dB.
const PINK_RATIO: f64 = 1e-2;

/// The lowest and the highest frequency in hertz that the input excites; `None` without any input.
pub fn excited_band_hz(signals: &Signals) -> Option<(f64, f64)> {
    let spectrum = RealFft::new(signals.len()).below_nyquist(signals.input.clone());
    let power: Vec<f64> = spectrum.iter().map(|u| u.norm_sqr()).collect();
    let bins = excited_bins(&power)?;
    let bin_hz = signals.rate_hz / signals.len() as f64;
    Some((*bins.start() as f64 * bin_hz, *bins.end() as f64 * bin_hz))
}

/// The outermost bins of the excited band. Bin 0 holds the offset and is not used.
fn excited_bins(power: &[f64]) -> Option<RangeInclusive<usize>> {
    let mean = mean_power(power);
    let pink = |bin: usize, power: f64| bin as f64 * power;
    let bins = 1..power.len();
    let max = bins.clone().map(|bin| mean[bin]).fold(0.0, f64::max);
    let max_pink = bins
        .clone()
        .map(|bin| pink(bin, mean[bin]))
        .fold(0.0, f64::max);
    let exceeds = |bin: usize, power: f64| {
        power >= POWER_RATIO * max || pink(bin, power) >= PINK_RATIO * max_pink
    };
    // The mean reaches beyond the last excited bin, the bin itself does not.
    let is_excited = |bin: &usize| exceeds(*bin, mean[*bin]) && exceeds(*bin, power[*bin]);
    let first = bins.clone().find(is_excited)?;
    let last = bins.rev().find(is_excited)?;
    (max > 0.0).then_some(first..=last)
}

/// The mean power around each bin.
fn mean_power(power: &[f64]) -> Vec<f64> {
    let mut sums = vec![0.0];
    for (bin, power) in power.iter().enumerate() {
        // Bin 0 does not count.
        let counted = if bin == 0 { 0.0 } else { *power };
        sums.push(sums[bin] + counted);
    }
    let mean = |bin: usize| {
        let half_width = MIN_HALF_WIDTH.max((WIDTH_RATIO * bin as f64) as usize);
        let (low, high) = (
            bin.saturating_sub(half_width),
            (bin + half_width + 1).min(power.len()),
        );
        (sums[high] - sums[low]) / (high - low) as f64
    };
    (0..power.len()).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 1000.0;

    fn band_of(input: impl Fn(f64) -> f64, seconds: f64) -> (f64, f64) {
        let samples = (seconds * RATE_HZ) as usize;
        let input: Vec<f64> = (0..samples).map(|n| input(n as f64 / RATE_HZ)).collect();
        excited_band_hz(&Signals {
            rate_hz: RATE_HZ,
            output: input.clone(),
            input,
        })
        .expect("an input")
    }

    #[test]
    fn finds_the_limits_of_a_linear_sweep_from_rest_to_rest() {
        // 4 to 130 Hz in 20 s with 1 s of rest before and 4 s after.
        let sweep = |t: f64| {
            let t = t - 1.0;
            let phase = std::f64::consts::TAU * (4.0 * t + 0.5 * (126.0 / 20.0) * t * t);
            let inside = (0.0..20.0).contains(&t);
            if inside { phase.sin() } else { 0.0 }
        };
        // |U| is 1/(2 sqrt(k)) inside, with k = 126/20 Hz/s, and 1/(4 pi d) at d beyond an end without fading: -30 dB at d = 12.6 Hz.
        let (low, high) = band_of(sweep, 25.0);
        assert!((0.0..5.0).contains(&low), "{low}");
        assert!((128.0..145.0).contains(&high), "{high}");
    }

    #[test]
    fn finds_the_limits_of_a_logarithmic_sweep() {
        let sweep = |t: f64| {
            let rate = (200.0_f64 / 0.5).ln() / 40.0;
            (std::f64::consts::TAU * 0.5 / rate * (rate * t).exp()).sin()
        };
        // It begins at full amplitude, which excites lower frequencies as well: |U| is 1/(4 pi d) there.
        let (low, high) = band_of(sweep, 40.0);
        assert!(low < 0.6 && (195.0..215.0).contains(&high), "{low} {high}");
    }

    #[test]
    fn impulse_excites_every_frequency() {
        let (low, high) = band_of(|t| if t == 0.5 { 1.0 } else { 0.0 }, 2.0);
        assert_eq!((low, high), (0.5, 499.5));
    }

    #[test]
    fn noise_of_a_measured_current_is_not_excitation() {
        let tones = |t: f64| {
            let line = |hz: f64| (std::f64::consts::TAU * hz * t + hz * hz).sin();
            let lines: f64 = (10..=80).step_by(2).map(|hz| line(f64::from(hz))).sum();
            // A deterministic sequence in place of noise, some 60 dB below the lines.
            lines + 1e-3 * ((t * RATE_HZ * 12.9898).sin() * 43758.5453).fract()
        };
        assert_eq!(band_of(tones, 10.0), (10.0, 80.0));
    }

    #[test]
    fn zero_input_has_no_band() {
        let signals = Signals {
            rate_hz: RATE_HZ,
            input: vec![0.0; 100],
            output: vec![0.0; 100],
        };
        assert_eq!(excited_band_hz(&signals), None);
    }
}
