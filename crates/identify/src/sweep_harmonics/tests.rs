//! Sweeps with known harmonics, and linear plants without any.

use super::*;
use crate::Identification;
use crate::verdict::Cnmp;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const RATE_HZ: f64 = 2000.0;
const SAMPLES: usize = 44_000;

/// 20 s from one frequency to another at constant speed, with rest before and after.
fn sweep(from_hz: f64, to_hz: f64) -> Vec<f64> {
    let force = |k: usize| {
        let t = k as f64 / RATE_HZ - 0.5;
        let envelope = (2.0 * t).min(2.0 * (20.0 - t)).clamp(0.0, 1.0);
        envelope * (TAU * (from_hz * t + (to_hz - from_hz) * t * t / 40.0)).sin()
    };
    (0..SAMPLES).map(force).collect()
}

/// The motion of a mode from rest: q' = p q + u, x = Im q w.
fn motion(input: &[f64], hz: f64, damping_ratio: f64) -> Vec<f64> {
    let w = TAU * hz;
    let pole = Complex::new(-damping_ratio, (1.0 - damping_ratio * damping_ratio).sqrt()) * w;
    let step = (pole / RATE_HZ).exp();
    let mut q = Complex::new(0.0, 0.0);
    let positions = input.iter().map(|force| {
        let position = w * q.im;
        q = step * q + (step - 1.0) / pole * *force;
        position
    });
    positions.collect()
}

/// Numbers with a standard deviation of 1: sums of twelve uniform ones.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut uniform = move || random.next_u64() as f64 / u64::MAX as f64;
    move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

fn found(input: Vec<f64>, output: &[f64], noise_level: f64, seed: u64) -> Vec<SweepHarmonic> {
    let mut noise = noise(seed);
    let output = output.iter().map(|y| y + noise_level * noise()).collect();
    harmonics(&Signals {
        rate_hz: RATE_HZ,
        input,
        output,
    })
}

/// cos^2 x = (1 + cos 2x)/2 and cos^3 x = (3 cos x + cos 3x)/4.
#[test]
fn harmonics_of_powers_are_found_with_their_ratio() {
    let (square, cube) = (0.02, 0.04);
    let curve = |x: &f64| x + square * x * x + cube * x * x * x;
    for (from_hz, to_hz) in [(10.0, 150.0), (150.0, 10.0)] {
        let input = sweep(from_hz, to_hz);
        let output: Vec<f64> = input.iter().map(curve).collect();
        let found = found(input, &output, 1e-3, 1);
        let fundamental = 1.0 + 0.75 * cube;
        let expected = [
            (2, 0.5 * square / fundamental),
            (3, 0.25 * cube / fundamental),
        ];
        assert_eq!(found.len(), 2);
        for (found, (order, ratio)) in found.iter().zip(expected) {
            assert_eq!(found.order, order);
            // 1e-3 of noise is 3e-5 in a window of 400 samples; the envelope is below 1 at the ends.
            assert!((found.ratio / ratio - 1.0).abs() < 0.02, "{found:?}");
            let (low_hz, high_hz) = found.band_hz;
            assert!(low_hz < 20.0 && high_hz > 140.0, "{found:?}");
        }
    }
}

/// Also with light damping, a free vibration that passes the harmonics of a sweep downwards, and without any noise.
#[test]
fn linear_plant_has_no_harmonics() {
    for (from_hz, to_hz) in [(5.0, 150.0), (150.0, 5.0)] {
        for damping_ratio in [0.0005, 0.005, 0.05] {
            let input = sweep(from_hz, to_hz);
            let output = motion(&input, 90.0, damping_ratio);
            for (noise_level, seed) in [(0.0, 0), (1e-6, 1), (1e-4, 2), (1e-2, 3), (1.0, 4)] {
                let found = found(input.clone(), &output, noise_level, seed);
                assert_eq!(found, [], "{from_hz} Hz, {damping_ratio}, {noise_level}");
            }
        }
    }
}

/// A third harmonic of the measured force, to which the plant responds.
#[test]
fn harmonics_of_the_input_are_none_of_the_plant() {
    let input: Vec<f64> = sweep(5.0, 150.0)
        .iter()
        .map(|u| u + 0.05 * u * u * u)
        .collect();
    let output = motion(&input, 60.0, 0.01);
    assert_eq!(found(input, &output, 1e-5, 1), []);
}

/// What a probe with play sees, this much to either side.
fn through_play(positions: &[f64], half: f64) -> Vec<f64> {
    let mut seen = 0.0;
    let seen = positions.iter().map(|x| {
        seen = f64::clamp(seen, x - half, x + half);
        seen
    });
    seen.collect()
}

/// The reasons of the verdict of an output with noise. It is undecided.
fn why_undecided(input: &[f64], output: &[f64]) -> String {
    let mut noise = noise(3);
    let output: Vec<f64> = output.iter().map(|y| y + 1e-4 * noise()).collect();
    let identification = Identification::new(RATE_HZ).held_s(1.0 / RATE_HZ);
    let found = identification.run(input, &output);
    let verdict = found.unwrap_or_else(|error| panic!("{error}")).verdict;
    assert_eq!(verdict.cnmp, Cnmp::Undecided, "{}", verdict.why);
    verdict.why
}

fn two_modes(input: &[f64]) -> Vec<f64> {
    let other = motion(input, 90.0, 0.02);
    let pairs = motion(input, 40.0, 0.02).into_iter().zip(other);
    pairs.map(|(a, b)| a + 0.5 * b).collect()
}

#[test]
fn verdict_is_undecided_because_of_play() {
    let input = sweep(5.0, 150.0);
    let output = through_play(&two_modes(&input), 0.1);
    let why = why_undecided(&input, &output);
    assert!(why.starts_with("the output has the"), "{why}");
    assert!(why.contains("third harmonic"), "{why}");
    assert!(why.contains("half of the amplitude"), "{why}");
}

#[test]
fn verdict_is_undecided_because_of_a_clipped_input() {
    let input = sweep(5.0, 150.0);
    let output = two_modes(&input);
    let recorded: Vec<f64> = input.iter().map(|u| u.clamp(-0.6, 0.6)).collect();
    let why = why_undecided(&recorded, &output);
    assert!(why.starts_with("the input stays at its limit"), "{why}");
    assert!(!why.contains("harmonic"), "{why}");
}

#[test]
fn play_has_a_third_harmonic() {
    let input = sweep(5.0, 150.0);
    let output = through_play(&motion(&input, 60.0, 0.05), 0.02);
    let found = found(input, &output, 1e-4, 1);
    let largest = found.iter().max_by(|a, b| a.ratio.total_cmp(&b.ratio));
    assert!(largest.is_some_and(|found| found.order == 3), "{found:?}");
}

#[test]
fn other_excitations_have_none() {
    let mut noise = noise(5);
    let white: Vec<f64> = (0..SAMPLES).map(|_| noise()).collect();
    let mut steps = Vec::new();
    for _ in 0..SAMPLES / 10 {
        steps.extend([noise().signum(); 10]);
    }
    let mut blow = vec![0.0; SAMPLES];
    blow[100..110].fill(1.0);
    for input in [white, steps, blow, vec![0.0; SAMPLES], Vec::new()] {
        let output: Vec<f64> = input.iter().map(|u| u + 0.1 * u * u * u).collect();
        assert_eq!(found(input, &output, 1e-3, 2), []);
    }
}
