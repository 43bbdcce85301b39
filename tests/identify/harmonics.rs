//! Distortion at the omitted lines of a multisine, against closed forms.

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;

use bench::identify::Signals;
use bench::identify::harmonics::{Harmonics, LineLevel, harmonics, noise_probability};
use bench::identify::periodic::Repetition;
use realfft::RealFftPlanner;

const PERIOD: usize = 500;
/// Sums of three lines stay below half of the rate, 250, so that none is folded back.
const LAST: usize = 79;
/// The filter behind the distortion: 1/(1 - (f/60)^2 + 0.1 i f/60), lines being hertz.
fn gain(line: f64) -> (f64, f64) {
    let (re, im) = (1.0 - (line / 60.0).powi(2), 0.1 * line / 60.0);
    let square = re * re + im * im;
    (re / square, -im / square)
}

fn uniform(random: &mut Pcg64) -> f64 {
    ((random.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
}

/// By Box and Muller.
fn normal(random: &mut Pcg64) -> f64 {
    let radius = (-2.0 * uniform(random).ln()).sqrt();
    radius * (std::f64::consts::TAU * uniform(random)).cos()
}

/// Odd lines up to [`LAST`] without the third of each four.
fn excited_lines() -> Vec<usize> {
    (1..=LAST)
        .step_by(2)
        .enumerate()
        .filter(|(place, _)| place % 4 != 2)
        .map(|(_, k)| k)
        .collect()
}

/// A record of `periods` of y = filter(u + a u^2 + b u^3), u of amplitude 1 a line, with white noise on every sample.
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
        input_a: repeated(&input),
        output_m,
    }
}

fn omitted_lines(signals: &Signals) -> Harmonics {
    let repetition = Repetition {
        period: PERIOD,
        skip: 0,
    };
    harmonics(signals, (1.0, LAST as f64), repetition)
        .unwrap()
        .expect("lines left out")
}

/// E |Y|^2 as a square of an RMS at a line, of products of `order` lines: the sum over all unordered choices of signed lines
/// that add up to it, each of a phase of its own, of (their orders x coefficient x amplitudes)^2.
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
                let orders = if i == j { 1.0 } else { 2.0 };
                sum += if a + b == target {
                    (orders * half * half * coefficient).powi(2)
                } else {
                    0.0
                };
                continue;
            }
            for (l, c) in signed.iter().enumerate().skip(j) {
                let orders = match (i == j, j == l) {
                    (true, true) => 1.0,
                    (false, false) => 6.0,
                    _ => 3.0,
                };
                sum += if a + b + c == target {
                    (orders * half.powi(3) * coefficient).powi(2)
                } else {
                    0.0
                };
            }
        }
    }
    let (re, im) = gain(line as f64);
    // A complex amplitude C is an RMS of sqrt(2) |C|.
    2.0 * sum * (re * re + im * im)
}

#[test]
fn second_and_third_order_products_equal_their_closed_form_at_even_and_odd_lines() {
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
    // The power of a line is that of a sum of many random phases: its sigma equals its mean. Over 300 seeds: 1/sqrt(300) =
    // 5.8 %; the bound is three sigma.
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
        // Existing distortion is found with a large margin; otherwise noise alone explains the lines, except once in a thousand.
        assert_eq!(by_odd < 1e-9, odd, "{terms:?}: {by_odd}");
        assert_eq!(by_even < 1e-9, even, "{terms:?}: {by_even}");
        assert!(
            (by_odd > 1e-3) != odd && (by_even > 1e-3) != even,
            "{terms:?}: {by_odd} {by_even}"
        );
    }
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
    // 400 probabilities: 40 are below 0.1, with a sigma of 6; the bound is three sigma. 0.4 are below 0.001; five or more occur once in
    // 16,000 times.
    assert!((22..=58).contains(&below[0]) && below[1] < 5, "{below:?}");
    // White noise of variance 1e-4 a sample is 2 x 1e-4/500 a line; 200 seeds x 29 lines x 5 degrees: 0.6 %, three of them. What is
    // taken off as drift, from 11 samples of noise, adds 500 x 2/11/(2 pi k)^2: below 0.6 % from line 20 on, 0.2 % on average.
    let ratio = level / f64::from(seeds as u32) / (2.0 * 1e-4 / PERIOD as f64);
    assert!((0.98..1.02).contains(&ratio), "{ratio}");
}

#[test]
fn ignores_omitted_lines_with_input_and_needs_at_least_one() {
    let mut signals = record(1, (0.0, 0.0), 1e-3, 6);
    let all = omitted_lines(&signals);
    let (left_out, turn) = (5.0, std::f64::consts::TAU / PERIOD as f64);
    for (n, u) in signals.input_a.iter_mut().enumerate() {
        *u += 1e-3 * (turn * left_out * n as f64).cos();
    }
    let fewer = omitted_lines(&signals);
    assert_eq!(
        (fewer.odd.len(), fewer.even.len()),
        (all.odd.len() - 1, all.even.len())
    );
    assert!(fewer.odd.iter().all(|line| line.frequency_hz != left_out));
    // Every line excited: a pulse.
    for (n, u) in signals.input_a.iter_mut().enumerate() {
        *u = f64::from(u8::from(n % PERIOD == 0));
    }
    let repetition = Repetition {
        period: PERIOD,
        skip: 0,
    };
    assert_eq!(harmonics(&signals, (1.0, 79.0), repetition), Ok(None));
}

#[test]
fn probability_is_that_of_a_sum_of_exponentials() {
    let level = |surprisal| LineLevel {
        frequency_hz: 1.0,
        input_a2: 0.0,
        power_m2: 0.0,
        noise_m2: 0.0,
        surprisal,
    };
    assert_eq!(noise_probability(&[]), 1.0);
    // exp(-x), (1 + x) exp(-x): two roundings of numbers near 1.
    assert!((noise_probability(&[level(2.0)]) - (-2.0f64).exp()).abs() < 1e-15);
    assert!((noise_probability(&[level(2.0), level(1.0)]) - 4.0 * (-3.0f64).exp()).abs() < 1e-15);
    assert_eq!(noise_probability(&[level(0.0)]), 1.0);
    assert_eq!(noise_probability(&[level(1e6), level(f64::INFINITY)]), 0.0);
    // Of 1000 lines the sum is 1000 with a sigma of 31.6; half lies beyond 1000 - 1/3.
    let many = noise_probability(&vec![level(1.0 - 1.0 / 3000.0); 1000]);
    assert!((many - 0.5).abs() < 1e-3, "{many}");
}
