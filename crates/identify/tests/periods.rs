//! Periodic records of few periods: variances, intervals, modes and verdicts, by closed form.

use std::f64::consts::TAU;

use bench_identify::periodic::{self, Repetition};
use bench_identify::verdict::Cnmp;
use bench_identify::{Estimate, ExternalAnalysis, Identification, Signals};
use nalgebra::Complex;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;

const RATE_HZ: f64 = 1000.0;

/// A mode by frequency in hertz, damping ratio and residue.
type Mode = (f64, f64, f64);

/// Residues of equal signs: all zeros lie left of the axis.
const STAGE: [Mode; 2] = [(30.3, 0.03, 1.0), (70.7, 0.01, 0.6)];

/// The numerator r1 (s^2 + 2 z2 w2 s + w2^2) + r2 (s^2 + 2 z1 w1 s + w1^2) has the zeros
/// -(r1 z2 w2 + r2 z1 w1)/(r1 + r2) +- j ..., with w in hertz -(0.3535 - 0.7575)/0.5 = 0.81: 5.1 rad/s right of the axis, at
/// sqrt((r1 w2^2 + r2 w1^2)/(r1 + r2)) = 95.3 Hz.
const CNMP_STAGE: [Mode; 2] = [(30.3, 0.05, 1.0), (70.7, 0.005, -0.5)];

fn uniform(random: &mut Pcg64) -> f64 {
    ((random.next_u64() >> 11) + 1) as f64 / (1u64 << 53) as f64
}

/// A normal number of mean 0 and variance 1 (Box, Muller).
fn normal(random: &mut Pcg64) -> f64 {
    let radius = (-2.0 * uniform(random).ln()).sqrt();
    radius * (TAU * uniform(random)).cos()
}

fn pole((hz, zeta, _): Mode) -> Complex<f64> {
    Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * (TAU * hz)
}

/// The periodic displacement by a held periodic force. With the pole p, q[k + 1] = e q[k] + (e - 1)/p u[k] with e = exp(p T), and the
/// position r Im q/Im p. From q = 0 a period of N samples leads to q_N; the periodic state begins with q_N/(1 - e^N).
fn displacement(modes: &[Mode], force: &[f64]) -> Vec<f64> {
    let mut output = vec![0.0; force.len()];
    for mode in modes {
        let pole = pole(*mode);
        let e = (pole / RATE_HZ).exp();
        let step = |q: Complex<f64>, u: &f64| e * q + (e - 1.0) / pole * u;
        let after = force.iter().fold(Complex::new(0.0, 0.0), step);
        let whole = (pole * force.len() as f64 / RATE_HZ).exp();
        let mut q = after / (Complex::new(1.0, 0.0) - whole);
        for (y, u) in output.iter_mut().zip(force) {
            *y += mode.2 * q.im / pole.im;
            q = step(q, u);
        }
    }
    output
}

/// The response of sampled positions to a held force: the z-transform of [`displacement`].
fn response(modes: &[Mode], hz: f64) -> Complex<f64> {
    let z = Complex::from_polar(1.0, TAU * hz / RATE_HZ);
    let of_mode = |mode: &Mode| {
        let pole = pole(*mode);
        let e = (pole / RATE_HZ).exp();
        let gain = (e - 1.0) / pole;
        let difference = gain / (z - e) - gain.conj() / (z - e.conj());
        difference * mode.2 / Complex::new(0.0, 2.0 * pole.im)
    };
    modes.iter().map(of_mode).sum()
}

/// Periods of a force with the displacement and white noise of `sigma`: one more than are averaged, as the last one measures the drift.
fn record(
    modes: &[Mode],
    force: &[f64],
    averaged: usize,
    sigma: f64,
    random: &mut Pcg64,
) -> Signals {
    let position = displacement(modes, force);
    let samples = (averaged + 1) * force.len();
    let output = (0..samples).map(|n| position[n % force.len()] + sigma * normal(random));
    Signals {
        rate_hz: RATE_HZ,
        output: output.collect(),
        input: (0..samples).map(|n| force[n % force.len()]).collect(),
    }
}

fn repetition(period: usize) -> Repetition {
    Repetition { period, skip: 0 }
}

/// The analysis in the default band.
fn identified(signals: &Signals, period: usize) -> ExternalAnalysis {
    Identification::new(RATE_HZ)
        .held_s(1.0 / RATE_HZ)
        .periods(repetition(period))
        .run(&signals.input, &signals.output)
        .expect("an analysis")
}

/// A sum of lines of 1 Hz over 1000 samples with Schroeder phases.
fn multisine(lines: &[usize], amplitude: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut force = vec![0.0; 1000];
    for (j, line) in lines.iter().enumerate() {
        let phase = -0.5 * TAU * (j * j) as f64 / lines.len() as f64;
        for (n, u) in force.iter_mut().enumerate() {
            let angle = TAU * ((n * line) % 1000) as f64 / 1000.0 + phase;
            *u += amplitude(*line as f64) * angle.cos();
        }
    }
    force
}

fn all_lines() -> Vec<usize> {
    (5..=200).collect()
}

/// A maximum-length sequence of the order 9 (x^9 + x^5 + 1) or 10 (x^10 + x^7 + 1), each value held for some samples.
fn prbs(order: u32, hold: usize) -> Vec<f64> {
    let tap = if order == 9 { 5 } else { 7 };
    let length = (1_u32 << order) - 1;
    let mut cells = 1_u32;
    let mut force = Vec::new();
    for _ in 0..length {
        let bit = ((cells >> (order - 1)) ^ (cells >> (tap - 1))) & 1;
        cells = ((cells << 1) | bit) & length;
        let value = if bit == 1 { 1.0 } else { -1.0 };
        force.extend(std::iter::repeat_n(value, hold));
    }
    force
}

/// A result for each seed, by two threads.
fn over_seeds<T: Send>(seeds: u64, result: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let half = |parity: u64| -> Vec<T> {
        let of_half = (0..seeds).filter(|seed| seed % 2 == parity);
        of_half.map(&result).collect()
    };
    std::thread::scope(|scope| {
        let odd = scope.spawn(|| half(1));
        let mut all = half(0);
        all.extend(odd.join().expect("no panic"));
        all
    })
}

/// The mean of |H - H_true|^2 over its variance is the reduced chi-square of the exact model. With the variances of single lines it is
/// (P - 1)/(P - 2) for P periods, with pooled ones 1. Lines from 20 Hz on: at line k the correction of drift adds
/// 2 x 1000/21/(2 pi k)^2 of the noise, 0.6 % at 20 Hz.
///
/// 40 records of 181 lines: the standard deviation of the mean is 1.2 % by the noise of the lines, and 0.6 % by that of the variances; by
/// single lines of five periods 2.2 %. The bounds are three of them.
#[test]
fn mean_chi_square_of_the_exact_model_is_one_for_any_number_of_periods() {
    let force = multisine(&all_lines(), |_| 1.0);
    for averaged in [5, 7, 10, 20] {
        let ratios = over_seeds(40, |seed| {
            let mut random = Pcg64::seed_from_u64(1000 * averaged as u64 + seed);
            let signals = record(&STAGE, &force, averaged, 1e-6, &mut random);
            let periods = periodic::estimate(&signals, (19.5, 200.5), repetition(1000));
            let periods = periods.expect("lines");
            let mean = |data: &[bench_identify::FrfDatum]| {
                let ratio = |datum: &bench_identify::FrfDatum| {
                    let error = datum.response - response(&STAGE, datum.frequency_hz);
                    error.norm_sqr() / datum.variance
                };
                data.iter().map(ratio).sum::<f64>() / data.len() as f64
            };
            (mean(&periods.frf.data), mean(&periods.pooled().data))
        });
        let own = ratios.iter().map(|ratio| ratio.0).sum::<f64>() / 40.0;
        let pooled = ratios.iter().map(|ratio| ratio.1).sum::<f64>() / 40.0;
        println!("{averaged} periods: {own:.3} by single lines, {pooled:.3} pooled");
        let of_single = (averaged - 1) as f64 / (averaged - 2) as f64;
        assert!((own - of_single).abs() < 0.07, "{averaged}: {own}");
        assert!((pooled - 1.0).abs() < 0.04, "{averaged}: {pooled}");
    }
}

/// Intervals that contain the truth, of frequencies, damping ratios and residues.
fn within(found: &ExternalAnalysis, modes: &[Mode]) -> [usize; 3] {
    let fit = found.fit.as_ref().expect("modes");
    let mut counts = [0; 3];
    for (mode, (hz, zeta, residue)) in fit.modes().iter().zip(modes) {
        let contains = |estimate: Estimate, truth: f64| {
            usize::from((estimate.value - truth).abs() < estimate.half_width_95())
        };
        counts[0] += contains(mode.frequency_hz(), *hz);
        counts[1] += contains(mode.damping_ratio, *zeta);
        counts[2] += contains(mode.residue_per_kg, *residue);
    }
    counts
}

/// 100 records with two modes: 200 intervals of each kind, with a standard deviation of 1.5 % of their coverage of 95 %; the bounds are
/// two of them. With variances of single lines, weights of 10 degrees of freedom make the errors of the parameters
/// sqrt(E w^2)/E w = sqrt((10 - 2)/(10 - 4)) = 1.15 times as large as stated: 91 %.
#[test]
fn intervals_of_six_periods_contain_the_truth() {
    const SEEDS: u64 = 100;
    let force = multisine(&all_lines(), |_| 1.0);
    let found = over_seeds(SEEDS, |seed| {
        let mut random = Pcg64::seed_from_u64(seed);
        identified(&record(&STAGE, &force, 6, 1e-5, &mut random), 1000)
    });
    let mut counts = [0; 3];
    let mut chi2 = 0.0;
    for analysis in &found {
        let fit = analysis.fit.as_ref().expect("modes");
        assert_eq!(fit.modes().len(), 2, "{:?}", fit.modes());
        chi2 += fit.chi2_per_freedom / SEEDS as f64;
        for (sum, one) in counts.iter_mut().zip(within(analysis, &STAGE)) {
            *sum += one;
        }
    }
    let percent = counts.map(|count| 100.0 * count as f64 / (2 * SEEDS) as f64);
    println!("frequency, damping, residue: {percent:?} %, mean reduced chi-square {chi2:.3}");
    assert!(
        percent
            .iter()
            .all(|percent| (92.0..=98.0).contains(percent)),
        "{percent:?}"
    );
    // 100 times some 300 degrees of freedom: 0.9 %, and pooled variances of 14 % over 13 lines: 0.4 %.
    assert!((0.96..1.04).contains(&chi2), "{chi2}");
}

/// The modes of a stage with zeros left and right of the axis, by a PRBS in its default band.
#[test]
fn prbs_decides_in_its_default_band_without_other_modes() {
    for (order, hold, highest_hz) in [(9, 1, 500.0), (9, 2, 250.0), (9, 4, 113.9), (10, 4, 113.9)] {
        let force = prbs(order, hold);
        for (stage, verdict) in [(STAGE, Cnmp::Excluded), (CNMP_STAGE, Cnmp::Detected)] {
            let found = over_seeds(8, |seed| {
                let mut random = Pcg64::seed_from_u64(seed);
                identified(&record(&stage, &force, 6, 5e-8, &mut random), force.len())
            });
            for analysis in found {
                let modes = analysis.fit.as_ref().expect("modes").modes();
                let what = format!("order {order}, hold {hold}: {:?}", analysis.verdict);
                assert_eq!(analysis.verdict.cnmp, verdict, "{what}");
                assert_eq!(modes.len(), 2, "{what} {modes:?}");
                for (mode, (hz, _, residue)) in modes.iter().zip(stage) {
                    let off = mode.frequency_hz().value / hz - 1.0;
                    assert!(off.abs() < 1e-3, "{what} {mode:?}");
                    assert!(mode.residue_per_kg.value * residue > 0.0, "{what} {mode:?}");
                }
                // Half of the power of a hold of 2 samples at 0.5 fc, of 4 at 0.4554 fc; the lines are 2 Hz apart or less.
                let high_hz = analysis.band_hz.1;
                assert!(
                    (highest_hz - 2.1..highest_hz + 0.1).contains(&high_hz),
                    "{what}"
                );
            }
        }
    }
}

/// Amplitudes over a range of 50:1: falling, with a minimum at the first mode, and with the law of a constant displacement.
#[test]
fn multisine_of_any_shape_keeps_all_of_its_lines() {
    let shapes: [fn(f64) -> f64; 4] = [
        |_| 1.0,
        |hz| 50_f64.powf((5.0 - hz) / 195.0),
        |hz| (0.02 + (hz / 30.3).ln().abs()).min(1.0),
        |hz| (hz * hz / 40_000.0).max(0.02),
    ];
    let odd: Vec<usize> = (5..=199).step_by(2).collect();
    let odd_random: Vec<usize> = odd
        .iter()
        .copied()
        .filter(|line| line % 16 != 9 && line % 16 != 15)
        .collect();
    let sparse: Vec<usize> = (5..=197).step_by(4).collect();
    for (k, shape) in shapes.into_iter().enumerate() {
        for lines in [&all_lines(), &odd, &odd_random, &sparse] {
            let force = multisine(lines, shape);
            let mut random = Pcg64::seed_from_u64(k as u64);
            let signals = record(&STAGE, &force, 6, 1e-8, &mut random);
            let found = identified(&signals, 1000);
            let expected: Vec<f64> = lines.iter().map(|line| *line as f64).collect();
            assert_eq!(
                found.frf.frequency_hz,
                expected,
                "shape {k}, {} lines",
                lines.len()
            );
        }
    }
}

/// A repeated noise has irregular lines up to half of the rate, and all but those below a hundredth of the largest are used.
#[test]
fn repeated_noise_is_analysed_up_to_half_of_the_rate() {
    let mut random = Pcg64::seed_from_u64(4);
    let force: Vec<f64> = (0..1000).map(|_| normal(&mut random)).collect();
    let signals = record(&STAGE, &force, 6, 1e-8, &mut random);
    let found = identified(&signals, 1000);
    assert!(found.band_hz.1 > 495.0, "{:?}", found.band_hz);
    assert!(found.frf.len() > 480, "{}", found.frf.len());
}

/// A sinusoid of 1 um on the output, and noise of 0.1 um: 1e-6 and 1e-7 sqrt(4/1000) = 6e-9 of a line in a period of 1 s. On a line it
/// repeats in every period, between lines its phase changes by 0.3 or 0.4 turns, which the scatter of the periods shows.
#[test]
fn hum_gives_no_mode() {
    let force = multisine(&all_lines(), |_| 1.0);
    for (hum_hz, repeats) in [(50.0, true), (100.0, true), (50.3, false), (120.4, false)] {
        for seed in 0..4 {
            let mut random = Pcg64::seed_from_u64(seed);
            let mut signals = record(&STAGE, &force, 6, 1e-7, &mut random);
            for (n, y) in signals.output.iter_mut().enumerate() {
                *y += 1e-6 * (TAU * hum_hz * n as f64 / RATE_HZ + 0.4).cos();
            }
            let found = identified(&signals, 1000);
            let fit = found.fit.as_ref().expect("modes");
            let what = format!("{hum_hz} Hz: {:?} {:?}", found.verdict, fit.modes());
            assert_eq!(fit.modes().len(), 2, "{what}");
            assert_eq!(found.verdict.cnmp, Cnmp::Excluded, "{what}");
            let expected = if repeats { vec![hum_hz] } else { Vec::new() };
            assert_eq!(fit.left_out_hz, expected, "{what}");
            let stated = format!("{hum_hz:.2} Hz alone");
            assert_eq!(found.verdict.why.contains(&stated), repeats, "{what}");
            for (mode, (hz, _, _)) in fit.modes().iter().zip(STAGE) {
                let (value, sigma) = (mode.frequency_hz().value, mode.frequency_hz().sigma);
                assert!((value - hz).abs() < 5.0 * sigma, "{what}");
            }
        }
    }
}

/// Modes of a half-power width of 0.24 Hz on a line of 1 Hz, beside it, and between two.
#[test]
fn light_mode_between_lines_is_found() {
    let force = multisine(&all_lines(), |_| 1.0);
    for hz in [120.0, 120.2, 120.5] {
        let stage = [STAGE[0], STAGE[1], (hz, 1e-3, 0.05)];
        for seed in 0..4 {
            let mut random = Pcg64::seed_from_u64(seed);
            let found = identified(&record(&stage, &force, 6, 1e-7, &mut random), 1000);
            let modes = found.fit.as_ref().expect("modes").modes();
            let what = format!("{hz} Hz: {:?} {modes:?}", found.verdict);
            assert_eq!(modes.len(), 3, "{what}");
            let light = modes[2];
            let (value, sigma) = (light.frequency_hz().value, light.frequency_hz().sigma);
            assert!((value - hz).abs() < 5.0 * sigma, "{what}");
            assert!(light.damping_ratio.value < 3e-3, "{what}");
            assert!(
                (light.residue_per_kg.value / 0.05 - 1.0).abs() < 0.2,
                "{what}"
            );
            assert_eq!(found.verdict.cnmp, Cnmp::Excluded, "{what}");
        }
    }
}
