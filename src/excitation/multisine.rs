//! Many sines at once, each a whole number of turns a period.
//!
//! ```text
//!  u(n) = sum over lines k of a_k cos(2 pi k n/N + phi_k)        a_k in the shape of A(k rate/N), max |u| = largest A in the band
//! ```
//!
//! The phases are drawn at random, and then moved so that the sum's peak falls: clip the signal, keep the phases of what is
//! left, give the lines their amplitudes back, again (Van der Ouderaa, Schoukens, Renneboog, IEEE Trans. Instrum. Meas. 37, 1988).

use std::f64::consts::PI;

use nalgebra::Complex;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;

use super::envelope::Amplitude;
use super::fourier::{samples, transform, turn};
use super::periodic::Periodic;
use crate::config::{Config, Lines, MultisineSettings};

/// Odd lines a group, of which one is left out.
const GROUP: usize = 4;
/// Rounds of clipping.
const ROUNDS: u32 = 100;
/// The signal is clipped at the first part of its peak, in the end at the second.
const CLIP: (f64, f64) = (0.5, 0.97);
/// Samples to a turn of the fastest line while its phases are sought: peaks between them are 4 % higher at most.
const OVERSAMPLING: usize = 8;

/// The multisine of a configuration.
pub fn multisine(config: &Config) -> Periodic {
    let settings = &config.multisine;
    let length = libm::round(settings.period_s * config.servo.rate_hz).max(8.0) as usize;
    let line_hz = config.servo.rate_hz / length as f64;
    let chirp = &config.chirp;
    let (low_hz, high_hz) = chirp.band_hz();
    let amplitude = Amplitude::new(&chirp.amplitude);
    let of = |k: usize| (k, amplitude.at(libm::log(k as f64 * line_hz)));
    let lines = lines(settings, within(low_hz, high_hz, line_hz, length));
    let weighted: Vec<(usize, f64)> = lines.into_iter().map(of).collect();
    let mut table = table(&weighted, settings.seed, length);
    let peak_a = table.iter().fold(0.0f64, |peak, u| peak.max(u.abs()));
    let scale = if peak_a > 0.0 {
        amplitude.range_a(low_hz, high_hz).1 / peak_a
    } else {
        0.0
    };
    table.iter_mut().for_each(|u| *u *= scale);
    Periodic::new(config, table, settings.settle_periods, settings.periods)
}

/// The lines of the band below half the rate; one that is a limit up to rounding counts.
fn within(
    low_hz: f64,
    high_hz: f64,
    line_hz: f64,
    length: usize,
) -> std::ops::RangeInclusive<usize> {
    let low = libm::ceil(low_hz / line_hz - 1e-6).max(1.0) as usize;
    low..=(libm::floor(high_hz / line_hz + 1e-6) as usize).min((length - 1) / 2)
}

/// Those of the band that are excited.
fn lines(settings: &MultisineSettings, band: std::ops::RangeInclusive<usize>) -> Vec<usize> {
    match settings.lines {
        Lines::Full => band.collect(),
        Lines::Odd => band.filter(|k| k % 2 == 1).collect(),
        Lines::OddRandom => {
            let odd: Vec<usize> = band.filter(|k| k % 2 == 1).collect();
            let mut random = Pcg64::seed_from_u64(settings.seed);
            let kept = |group: &[usize]| {
                let out = if group.len() == GROUP {
                    (random.next_u64() >> 62) as usize
                } else {
                    GROUP
                };
                let rest = group.iter().enumerate().filter(|(place, _)| *place != out);
                rest.map(|(_, k)| *k).collect::<Vec<_>>()
            };
            odd.chunks(GROUP).flat_map(kept).collect()
        }
    }
}

/// One period of the sum of lines (number, amplitude).
fn table(lines: &[(usize, f64)], seed: u64, length: usize) -> Vec<f64> {
    let Some(&(last, _)) = lines.last() else {
        return vec![0.0; length];
    };
    let mut spectrum = vec![Complex::new(0.0, 0.0); last + 1];
    for (&(k, a), phase) in lines.iter().zip(phases(lines, seed)) {
        spectrum[k] = phase * a;
    }
    samples(&spectrum, length)
}

/// exp(i phi) of each line, by which the sum's peak is low.
fn phases(lines: &[(usize, f64)], seed: u64) -> Vec<Complex<f64>> {
    let mut random = Pcg64::new(u128::from(seed), 1);
    let mut draw =
        || turn(2.0 * PI * (random.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64));
    let mut phases: Vec<Complex<f64>> = lines.iter().map(|_| draw()).collect();
    let last = lines.last().map_or(0, |(k, _)| *k);
    let mut signal = vec![Complex::new(0.0, 0.0); (OVERSAMPLING * last).next_power_of_two()];
    let (mut best, mut lowest) = (phases.clone(), f64::INFINITY);
    for round in 0..ROUNDS {
        let peak = sum(lines, &phases, &mut signal);
        if peak < lowest {
            (best, lowest) = (phases.clone(), peak);
        }
        let level = peak * (CLIP.0 + (CLIP.1 - CLIP.0) * f64::from(round) / f64::from(ROUNDS));
        signal
            .iter_mut()
            .for_each(|u| *u = Complex::new(u.re.clamp(-level, level), 0.0));
        transform(&mut signal);
        for ((k, _), phase) in lines.iter().zip(&mut phases) {
            // What turns by exp(+i) in the signal stands conjugate in its transform with exp(+i) again.
            let left = signal[*k].conj();
            let size = left.norm_sqr().sqrt();
            *phase = if size > 0.0 { left / size } else { *phase };
        }
    }
    best
}

/// The samples of the sum, and its peak.
fn sum(lines: &[(usize, f64)], phases: &[Complex<f64>], signal: &mut [Complex<f64>]) -> f64 {
    signal.fill(Complex::new(0.0, 0.0));
    for ((k, a), phase) in lines.iter().zip(phases) {
        signal[*k] = phase * *a;
    }
    transform(signal);
    signal.iter().fold(0.0f64, |peak, u| peak.max(u.re.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{AmplitudePoint, Source, load};
    use crate::excitation::Excitation;

    /// Periods of a second at 5 kHz, lines from 20 to 219 Hz.
    fn config(lines: Lines, seed: u64, amplitude: &[(f64, f64)]) -> Config {
        let mut config = load(&Source::default()).unwrap();
        (config.chirp.start_hz, config.chirp.stop_hz) = (20.0, 219.0);
        let point = |&(frequency_hz, current_a): &(f64, f64)| AmplitudePoint {
            frequency_hz,
            current_a,
        };
        config.chirp.amplitude = amplitude.iter().map(point).collect();
        (
            config.multisine.period_s,
            config.multisine.lines,
            config.multisine.seed,
        ) = (1.0, lines, seed);
        config
    }

    const FLAT: [(f64, f64); 1] = [(1.0, 0.7)];

    /// The amplitude of each line, by another transform.
    fn amplitudes(table: &[f64]) -> Vec<f64> {
        let fft = realfft::RealFftPlanner::<f64>::new().plan_fft_forward(table.len());
        let (mut input, mut output) = (table.to_vec(), fft.make_output_vec());
        fft.process(&mut input, &mut output).unwrap();
        output
            .iter()
            .map(|line| 2.0 * line.norm() / table.len() as f64)
            .collect()
    }

    fn crest_factor(table: &[f64]) -> f64 {
        let rms = (table.iter().map(|u| u * u).sum::<f64>() / table.len() as f64).sqrt();
        table.iter().fold(0.0f64, |peak, u| peak.max(u.abs())) / rms
    }

    #[test]
    fn a_full_flat_one_has_its_lines_alike_nothing_else_and_half_the_crest_of_random_phases() {
        for seed in 1..=8 {
            let multisine = multisine(&config(Lines::Full, seed, &FLAT));
            let table = multisine.table();
            assert_eq!(table.len(), 5000);
            let amplitudes = amplitudes(table);
            let a = amplitudes[20];
            for (k, amplitude) in amplitudes.iter().enumerate() {
                let expected = if (20..=219).contains(&k) { a } else { 0.0 };
                // Transforms of 16384 and 5000 numbers: some 14 roundings of the sum of 200 lines.
                assert!(
                    (amplitude - expected).abs() < 1e-12 * a.max(0.1),
                    "line {k}: {amplitude} for {expected}"
                );
            }
            let peak = table.iter().fold(0.0f64, |peak, u| peak.max(u.abs()));
            assert!(
                (peak / 0.7 - 1.0).abs() < 1e-12,
                "the largest current is the amplitude: {peak}"
            );
            // The peak of 200 random phases is near sqrt(2 ln 5000) = 4.1 sigma at most, and 3 at least; a sine has 1.41.
            let crest = crest_factor(table);
            assert!((1.41..1.8).contains(&crest), "seed {seed}: {crest}");
        }
    }

    #[test]
    fn lines_follow_the_amplitude_over_frequency() {
        let points = [(30.0, 0.1), (60.0, 0.4), (120.0, 0.05)];
        let amplitudes = amplitudes(multisine(&config(Lines::Full, 3, &points)).table());
        // ln A is straight over ln f: A = 0.1 (f/30)^2 up to 60 Hz, 0.4 (f/60)^-3 up to 120 Hz.
        let expected = |f: f64| match f {
            ..=30.0 => 0.1,
            ..=60.0 => 0.1 * (f / 30.0).powi(2),
            ..=120.0 => 0.4 * (f / 60.0).powi(-3),
            _ => 0.05,
        };
        for k in 20..=219usize {
            let ratio = amplitudes[k] / amplitudes[60] / (expected(k as f64) / 0.4);
            assert!((ratio - 1.0).abs() < 1e-10, "line {k}: {ratio}");
        }
    }

    #[test]
    fn lines_left_out_are_zero_even_ones_and_one_in_each_group_of_four_odd_ones() {
        for (lines, left) in [(Lines::Odd, 100), (Lines::OddRandom, 75)] {
            let amplitudes = amplitudes(multisine(&config(lines, 5, &FLAT)).table());
            let excited: Vec<usize> = (0..amplitudes.len())
                .filter(|k| amplitudes[*k] > 1e-3)
                .collect();
            assert_eq!(excited.len(), left, "{lines:?}");
            assert!(excited.iter().all(|k| k % 2 == 1 && (20..=219).contains(k)));
            assert!(
                (0..amplitudes.len()).all(|k| excited.contains(&k) || amplitudes[k] < 1e-13),
                "{lines:?}"
            );
            for group in 0..25 {
                let first = 21 + 8 * group;
                let within = excited
                    .iter()
                    .filter(|k| (first..first + 8).contains(*k))
                    .count();
                assert_eq!(within, left / 25, "{lines:?}, group {group}");
            }
        }
        let out = |seed| lines(&config(Lines::OddRandom, seed, &FLAT).multisine, 20..=219);
        assert_ne!(out(1), out(2), "others with another seed");
    }

    #[test]
    fn the_same_seed_is_the_same_current_and_another_is_another() {
        let at = |seed: u64, tick: u64| {
            multisine(&config(Lines::Full, seed, &FLAT))
                .current_a(tick)
                .to_bits()
        };
        assert_eq!(at(1, 30_000), at(1, 30_000));
        assert_ne!(at(1, 30_000), at(2, 30_000));
    }

    #[test]
    fn a_band_without_a_line_is_no_current_and_no_panic() {
        let mut config = config(Lines::Full, 1, &FLAT);
        (config.chirp.start_hz, config.chirp.stop_hz) = (20.2, 20.8);
        assert!(multisine(&config).table().iter().all(|u| *u == 0.0));
    }
}
