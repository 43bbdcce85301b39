//! Distortion at the omitted lines of a multisine, against closed forms.

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;

use bench_identify::Signals;
use bench_identify::harmonics::{Harmonics, InputSignal, LineLevel, harmonics, noise_probability};
use bench_identify::periodic::Repetition;
use realfft::RealFftPlanner;

const PERIOD: usize = 500;
/// The sum of three lines is below half of the sampling rate, 250 Hz, so that there is no aliasing.
const LAST: usize = 79;
/// The filter after the nonlinearity, 1/(1 - (f/60)^2 + 0.1 j f/60), with the line number as f in Hz: real and imaginary part.
fn gain(line: f64) -> (f64, f64) {
    let (re, im) = (1.0 - (line / 60.0).powi(2), 0.1 * line / 60.0);
    let square = re * re + im * im;
    (re / square, -im / square)
}

fn uniform(random: &mut Pcg64) -> f64 {
    ((random.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
}

/// A standard normal number (Box-Muller).
fn normal(random: &mut Pcg64) -> f64 {
    let radius = (-2.0 * uniform(random).ln()).sqrt();
    radius * (std::f64::consts::TAU * uniform(random)).cos()
}

/// Odd lines up to [`LAST`], with the third of every four omitted.
fn excited_lines() -> Vec<usize> {
    (1..=LAST)
        .step_by(2)
        .enumerate()
        .filter(|(place, _)| place % 4 != 2)
        .map(|(_, k)| k)
        .collect()
}

/// `periods` periods of y = filter(u + a u^2 + b u^3) with white noise. The amplitude of every line of u is 1.
fn record(seed: u64, (a, b): (f64, f64), noise_m: f64, periods: usize) -> Signals {
    let mut random = Pcg64::seed_from_u64(seed);
    let lines: Vec<(usize, f64)> = excited_lines()
        .into_iter()
        .map(|k| (k, std::f64::consts::TAU * uniform(&mut random)))
        .collect();
    let turn = std::f64::consts::TAU / PERIOD as f64;
    let input: Vec<f64> = (0..PERIOD)
        .map(|n| {
            lines
                .iter()
                .map(|(k, phase)| (turn * (k * n % PERIOD) as f64 + phase).cos())
                .sum()
        })
        .collect();
    let mut static_part: Vec<f64> = input
        .iter()
        .map(|u| u + a * u * u + b * u * u * u)
        .collect();
    let fft = RealFftPlanner::new().plan_fft_forward(PERIOD);
    let mut spectrum = fft.make_output_vec();
    fft.process(&mut static_part, &mut spectrum)
        .expect("buffers of the plan");
    let output: Vec<f64> = (0..PERIOD)
        .map(|n| {
            let of = |k: usize| {
                let (re, im) = gain(k as f64);
                let (s, c) = (turn * (k * n % PERIOD) as f64).sin_cos();
                let y = spectrum[k] * nalgebra::Complex::new(re, im);
                2.0 / PERIOD as f64 * (y.re * c - y.im * s)
            };
            (1..PERIOD / 2).map(of).sum()
        })
        .collect();
    let repeated = |one: &[f64]| {
        one.iter()
            .copied()
            .cycle()
            .take(periods * PERIOD)
            .collect::<Vec<f64>>()
    };
    let output_m = repeated(&output)
        .into_iter()
        .map(|y| y + noise_m * normal(&mut random))
        .collect();
    Signals {
        rate_hz: PERIOD as f64,
        input: repeated(&input),
        output: output_m,
    }
}

fn omitted_lines(signals: &Signals) -> Harmonics {
    let repetition = Repetition {
        period: PERIOD,
        skip: 0,
    };
    harmonics(
        signals,
        (1.0, LAST as f64),
        repetition,
        InputSignal::Commanded,
    )
    .unwrap()
    .expect("omitted lines")
}

/// Expected squared RMS value at a line of the products of `order` excited lines. The phases of the products are independent, so that
/// the squares (permutations x coefficient x amplitudes)^2 add, over all unordered sets of signed lines whose sum is `line`.
fn by_products(line: usize, order: usize, coefficient: f64) -> f64 {
    let signed: Vec<i64> = excited_lines()
        .iter()
        .flat_map(|k| [-(*k as i64), *k as i64])
        .collect();
    let (target, half) = (line as i64, 0.5f64);
    let mut sum = 0.0;
    for (i, a) in signed.iter().enumerate() {
        for (j, b) in signed.iter().enumerate().skip(i) {
            if order == 2 {
                let permutations = if i == j { 1.0 } else { 2.0 };
                sum += if a + b == target {
                    (permutations * half * half * coefficient).powi(2)
                } else {
                    0.0
                };
                continue;
            }
            for (l, c) in signed.iter().enumerate().skip(j) {
                let permutations = match (i == j, j == l) {
                    (true, true) => 1.0,
                    (false, false) => 6.0,
                    _ => 3.0,
                };
                sum += if a + b + c == target {
                    (permutations * half.powi(3) * coefficient).powi(2)
                } else {
                    0.0
                };
            }
        }
    }
    let (re, im) = gain(line as f64);
    // The RMS value of a line with the complex amplitudes C and C* at +-f is sqrt(2) |C|.
    2.0 * sum * (re * re + im * im)
}

#[test]
fn distortion_power_equals_the_closed_form_of_second_and_third_order_products() {
    let (a, b) = (1e-3, 2e-5);
    let (mut odd, mut even) = (0.0, 0.0);
    let seeds = 300;
    for seed in 0..seeds {
        let harmonics = omitted_lines(&record(seed, (a, b), 1e-3, 6));
        let sum = |lines: &[LineLevel]| {
            lines
                .iter()
                .map(|l| harmonics.without_noise_m2(l))
                .sum::<f64>()
        };
        (odd, even) = (odd + sum(&harmonics.odd), even + sum(&harmonics.even));
    }
    let expected_odd: f64 = (1..=LAST)
        .step_by(2)
        .filter(|k| !excited_lines().contains(k))
        .map(|k| by_products(k, 3, b))
        .sum();
    let expected_even: f64 = (2..=LAST).step_by(2).map(|k| by_products(k, 2, a)).sum();
    // The power of a line is that of a sum with many random phases: its standard deviation equals its mean. The standard error over
    // 300 seeds is 1/sqrt(300) = 5.8 %; the bound is three times that.
    for (name, found, expected) in [("odd", odd, expected_odd), ("even", even, expected_even)] {
        let ratio = found / f64::from(seeds as u32) / expected;
        assert!((0.827..1.173).contains(&ratio), "{name}: {ratio}");
    }
}

#[test]
fn detects_even_distortion_at_even_lines_and_odd_at_odd_lines() {
    for (terms, odd, even) in [
        ((1e-3, 0.0), false, true),
        ((0.0, 2e-5), true, false),
        ((1e-3, 2e-5), true, true),
    ] {
        let harmonics = omitted_lines(&record(4, terms, 1e-4, 6));
        let (by_odd, by_even) = (
            noise_probability(&harmonics.odd),
            noise_probability(&harmonics.even),
        );
        // With distortion the probability is far below any threshold. Without, it is above 1e-3, except once in a thousand.
        assert_eq!(by_odd < 1e-9, odd, "{terms:?}: {by_odd}");
        assert_eq!(by_even < 1e-9, even, "{terms:?}: {by_even}");
        assert!(
            (by_odd > 1e-3) != odd && (by_even > 1e-3) != even,
            "{terms:?}: {by_odd} {by_even}"
        );
    }
}

/// Adds 1 % of the amplitude of an excited line to the input at the lines that are not excited, and the linear response to it.
fn with_distorted_input(mut signals: Signals) -> Signals {
    let turn = std::f64::consts::TAU / PERIOD as f64;
    let lines = (2..LAST).filter(|k| !excited_lines().contains(k));
    for line in lines {
        let (re, im) = gain(line as f64);
        let phase = 2.4 * (line * line) as f64;
        for n in 0..signals.input.len() {
            let (sin, cos) = (turn * (line * n % PERIOD) as f64 + phase).sin_cos();
            signals.input[n] += 0.01 * cos;
            signals.output[n] += 0.01 * (re * cos - im * sin);
        }
    }
    signals
}

#[test]
fn distortion_of_a_measured_input_is_not_distortion_of_the_stage() {
    let measured = |signals: &Signals| {
        let repetition = Repetition {
            period: PERIOD,
            skip: 0,
        };
        let band_hz = (1.0, LAST as f64);
        harmonics(signals, band_hz, repetition, InputSignal::Measured)
            .unwrap()
            .expect("omitted lines")
    };
    let power = |harmonics: &Harmonics, lines: &[LineLevel]| {
        let powers = lines.iter().map(|line| harmonics.without_noise_m2(line));
        powers.sum::<f64>()
    };
    // Third-order products alone. Without the correction the power at the even lines were 1e-4 of that of the excited ones.
    let stage = record(11, (0.0, 2e-5), 1e-4, 6);
    let exact = omitted_lines(&stage);
    let found = measured(&with_distorted_input(stage));
    let ratio = power(&found, &found.odd) / power(&exact, &exact.odd);
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
    let even = power(&found, &found.even) / power(&found, &found.excited);
    assert!(even < 2e-6, "{even}");
    assert_eq!((found.odd.len(), found.even.len()), (10, 39));
}

#[test]
fn noise_alone_gives_the_stated_rate_of_false_alarms() {
    let seeds = 200;
    let (mut below, mut level) = ([0; 2], 0.0);
    for seed in 0..seeds {
        let harmonics = omitted_lines(&record(1000 + seed, (0.0, 0.0), 0.01, 6));
        for lines in [&harmonics.odd, &harmonics.even] {
            let probability = noise_probability(lines);
            below[0] += u32::from(probability < 0.1);
            below[1] += u32::from(probability < 1e-3);
        }
        let high: Vec<f64> = harmonics
            .even
            .iter()
            .filter(|l| l.frequency_hz > 20.0)
            .map(|line| line.noise_m2)
            .collect();
        level += high.iter().sum::<f64>() / high.len() as f64;
    }
    // Of 400 probabilities, 40 +- 6 are expected below 0.1; the bound is three sigma. 0.4 are expected below 0.001; five or more have a
    // probability of 1 in 16,000.
    assert!((22..=58).contains(&below[0]) && below[1] < 5, "{below:?}");
    // White noise with a variance of 1e-4 per sample gives 2 x 1e-4/500 per line. With 200 seeds x 29 lines x 5 degrees of freedom the
    // standard error is 0.6 %; the bound is three times that. The correction of drift, estimated from 11 noisy samples, adds
    // 500 x 2/11/(2 pi k)^2 at line k: below 0.6 % from line 20 on, 0.2 % on average.
    let ratio = level / f64::from(seeds as u32) / (2.0 * 1e-4 / PERIOD as f64);
    assert!((0.98..1.02).contains(&ratio), "{ratio}");
}

#[test]
fn ignores_omitted_lines_with_input_and_needs_at_least_one_omitted_line() {
    let mut signals = record(1, (0.0, 0.0), 1e-3, 6);
    let all = omitted_lines(&signals);
    let (omitted, turn) = (5.0, std::f64::consts::TAU / PERIOD as f64);
    for (n, u) in signals.input.iter_mut().enumerate() {
        *u += 1e-3 * (turn * omitted * n as f64).cos();
    }
    let fewer = omitted_lines(&signals);
    assert_eq!(
        (fewer.odd.len(), fewer.even.len()),
        (all.odd.len() - 1, all.even.len())
    );
    assert!(fewer.odd.iter().all(|line| line.frequency_hz != omitted));
    // A pulse excites every line.
    for (n, u) in signals.input.iter_mut().enumerate() {
        *u = f64::from(u8::from(n % PERIOD == 0));
    }
    let repetition = Repetition {
        period: PERIOD,
        skip: 0,
    };
    assert_eq!(
        harmonics(&signals, (1.0, 79.0), repetition, InputSignal::Commanded),
        Ok(None)
    );
}

#[test]
fn noise_probability_is_the_tail_of_a_sum_of_exponentials() {
    let level = |surprisal| LineLevel {
        frequency_hz: 1.0,
        input_a2: 0.0,
        power_m2: 0.0,
        noise_m2: 0.0,
        surprisal,
    };
    assert_eq!(noise_probability(&[]), 1.0);
    // One line: exp(-x); two lines with the sum x: (1 + x) exp(-x). The error is two roundings of numbers near 1.
    assert!((noise_probability(&[level(2.0)]) - (-2.0f64).exp()).abs() < 1e-15);
    assert!((noise_probability(&[level(2.0), level(1.0)]) - 4.0 * (-3.0f64).exp()).abs() < 1e-15);
    assert_eq!(noise_probability(&[level(0.0)]), 1.0);
    assert_eq!(noise_probability(&[level(1e6), level(f64::INFINITY)]), 0.0);
    // The sum over 1000 lines has the mean 1000, the standard deviation 31.6 and the median 1000 - 1/3.
    let many = noise_probability(&vec![level(1.0 - 1.0 / 3000.0); 1000]);
    assert!((many - 0.5).abs() < 1e-3, "{many}");
}
