//! Whether an input excites each frequency all the time, as noise does, and not at a time of its own, as a sweep does.
//!
//! The record is divided into segments, and the excited band into parts. The power of a steady input is about the same in all segments,
//! part by part; a sweep has power in one or two of them, a burst of noise has none after its end.

use std::ops::Range;

use crate::excited_band::excited_band_hz;
use crate::fft::RealFft;
use crate::welch::windowed_spectrum;
use crate::{Signals, band};

const SEGMENTS: usize = 12;
const PARTS: usize = 8;
/// Bins of a part, at least. With 2 complex bins, or 4 degrees of freedom, noise falls below a tenth of its mean with a probability of 2 %,
/// with 4 bins of 0.1 %: fewer bins than these are not enough to tell.
const MIN_BINS: usize = 4;
/// The power of each segment over the mean of all, at least.
const MIN_RATIO: f64 = 0.1;

/// Whether the input is steady; false where its band has too few bins to tell.
pub(super) fn is_steady(signals: &Signals) -> bool {
    let length = signals.len() / SEGMENTS;
    let Some(parts) = parts(signals, length) else {
        return false;
    };
    let fft = RealFft::new(length);
    let segments = signals.input.chunks_exact(length).take(SEGMENTS);
    let powers: Vec<Vec<f64>> = segments
        .map(|samples| powers(&fft, samples, &parts))
        .collect();
    (0..PARTS).all(|part| {
        let of_segments: Vec<f64> = powers.iter().map(|segment| segment[part]).collect();
        let mean = of_segments.iter().sum::<f64>() / SEGMENTS as f64;
        of_segments.iter().all(|power| *power > MIN_RATIO * mean)
    })
}

/// The parts of the excited band, in bins of a segment.
fn parts(signals: &Signals, length: usize) -> Option<Vec<Range<usize>>> {
    let bins = band::bins(excited_band_hz(signals)?, signals.rate_hz, length).ok()?;
    let (first, count) = (*bins.start(), bins.count());
    let edge = |part: usize| first + part * count / PARTS;
    (count >= PARTS * MIN_BINS).then(|| (0..PARTS).map(|part| edge(part)..edge(part + 1)).collect())
}

/// The power of each part in a segment.
fn powers(fft: &RealFft, samples: &[f64], parts: &[Range<usize>]) -> Vec<f64> {
    let spectrum = windowed_spectrum(fft, samples);
    let power = |part: &Range<usize>| spectrum[part.clone()].iter().map(|u| u.norm_sqr()).sum();
    parts.iter().map(power).collect()
}

#[cfg(test)]
mod tests {
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    const RATE_HZ: f64 = 1000.0;
    const SAMPLES: usize = 20_000;

    fn with_input(input: Vec<f64>) -> Signals {
        Signals {
            rate_hz: RATE_HZ,
            output: input.clone(),
            input,
        }
    }

    fn noise(seed: u64) -> Vec<f64> {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut uniform = || random.next_u64() as f64 / u64::MAX as f64 - 0.5;
        (0..SAMPLES).map(|_| uniform()).collect()
    }

    /// A sweep from 5 to 200 Hz.
    fn sweep(seconds: f64) -> impl Fn(f64) -> f64 {
        move |t| (std::f64::consts::TAU * (5.0 * t + 97.5 / seconds * t * t)).sin()
    }

    fn sampled(value: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..SAMPLES).map(|k| value(k as f64 / RATE_HZ)).collect()
    }

    #[test]
    fn noise_is_steady() {
        for seed in 0..100 {
            assert!(is_steady(&with_input(noise(seed))), "{seed}");
        }
    }

    #[test]
    fn periodic_input_is_steady() {
        let value = |t: f64| {
            (1..40)
                .map(|k| (std::f64::consts::TAU * 5.0 * t * f64::from(k) + f64::from(k * k)).sin())
                .sum()
        };
        assert!(is_steady(&with_input(sampled(value))));
    }

    #[test]
    fn sweep_is_not_steady() {
        assert!(!is_steady(&with_input(sampled(sweep(20.0)))));
        // Cut at both ends.
        assert!(!is_steady(&with_input(sampled(sweep(30.0)))));
    }

    #[test]
    fn burst_of_noise_is_not_steady() {
        let mut input = noise(1);
        input[14_000..].fill(0.0);
        assert!(!is_steady(&with_input(input)));
    }

    #[test]
    fn single_sinusoid_and_a_short_record_are_not_steady() {
        assert!(!is_steady(&with_input(sampled(|t| {
            (std::f64::consts::TAU * 20.0 * t).sin()
        }))));
        assert!(!is_steady(&with_input(noise(1)[..64].to_vec())));
    }
}
