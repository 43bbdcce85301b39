//! Records of a held command by closed form: modes close together, and a band up to 0.45 of the rate.

use std::f64::consts::TAU;

use bench_identify::verdict::Cnmp;
use bench_identify::{Estimate, ExternalAnalysis, Identification};
use bench_plant::zeros::ModalTerm;
use bench_test_support::synthetic::{normal, term};
use nalgebra::Complex;

/// A deviate of a uniform distribution, from the tail of a normal one.
fn uniform(normal: &mut impl FnMut() -> f64, low: f64, high: f64) -> f64 {
    low + (high - low) * normal().mul_add(997.0, 0.31).rem_euclid(1.0)
}

/// A chirp, and the rest after it in which the modes decay to e^-6.
struct Timing {
    rate_hz: f64,
    chirp_s: f64,
    rest_s: f64,
}

impl Timing {
    fn new(rate_hz: f64, chirp_s: f64, modes: &[ModalTerm]) -> Timing {
        let decay_per_s = |mode: &ModalTerm| mode.damping_ratio * mode.omega_rad_s;
        let slowest = modes.iter().map(decay_per_s).fold(f64::INFINITY, f64::min);
        Timing {
            rate_hz,
            chirp_s,
            rest_s: 6.0 / slowest,
        }
    }

    fn samples(&self) -> usize {
        (self.rate_hz * (self.chirp_s + self.rest_s)) as usize
    }
}

/// Input and output of a chirp from rest to rest.
struct Record {
    rate_hz: f64,
    input: Vec<f64>,
    output: Vec<f64>,
}

/// sin of a phase that rises linearly in frequency, with faded ends.
fn chirp(timing: &Timing, (low_hz, high_hz): (f64, f64)) -> Vec<f64> {
    let before_s = 0.02 * timing.chirp_s;
    let active_s = timing.chirp_s - before_s;
    let fade_s = 0.04 * active_s;
    let value = |k: usize| {
        let t = k as f64 / timing.rate_hz - before_s;
        if !(0.0..active_s).contains(&t) {
            return 0.0;
        }
        let ends = (t.min(active_s - t) / fade_s).min(1.0);
        let phase = TAU * (low_hz + 0.5 * (high_hz - low_hz) * t / active_s) * t;
        phase.sin() * (0.5 - 0.5 * (0.5 * TAU * ends).cos())
    };
    (0..timing.samples()).map(value).collect()
}

/// The displacement of a mode by a held force: with the pole p, x[k + 1] = e x[k] + (e - 1)/p u[k] with e = exp(p T), and the position
/// r Im x/Im p.
fn displacement(mode: &ModalTerm, input: &[f64], rate_hz: f64) -> Vec<f64> {
    let zeta = mode.damping_ratio;
    let pole = Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * mode.omega_rad_s;
    let step = (pole / rate_hz).exp();
    let mut x = Complex::new(0.0, 0.0);
    let next = |force: &f64| {
        let position = mode.residue_per_kg * x.im / pole.im;
        x = step * x + (step - 1.0) / pole * force;
        position
    };
    input.iter().map(next).collect()
}

/// The record of a sum of modes, with noise as a ratio of the RMS output.
fn record(
    modes: &[ModalTerm],
    timing: &Timing,
    band_hz: (f64, f64),
    (noise_ratio, normal): (f64, &mut impl FnMut() -> f64),
) -> Record {
    let (input, rate_hz) = (chirp(timing, band_hz), timing.rate_hz);
    let mut output = vec![0.0; input.len()];
    for mode in modes {
        let moved = displacement(mode, &input, rate_hz);
        output.iter_mut().zip(moved).for_each(|(sum, y)| *sum += y);
    }
    let power = output.iter().map(|y| y * y).sum::<f64>() / output.len() as f64;
    let sigma = noise_ratio * power.sqrt();
    output.iter_mut().for_each(|y| *y += sigma * normal());
    Record {
        rate_hz,
        input,
        output,
    }
}

fn identified(record: &Record) -> ExternalAnalysis {
    Identification::new(record.rate_hz)
        .held_s(1.0 / record.rate_hz)
        .run(&record.input, &record.output)
        .expect("an analysis")
}

/// The zero above the real axis of two modes; `None` if the zeros are real. The numerator is r1 (s^2 + 2 z2 w2 s + w2^2) + r2 (s^2 + 2 z1
/// w1 s + w1^2).
fn complex_zero(first: &ModalTerm, second: &ModalTerm) -> Option<Complex<f64>> {
    let [r1, r2] = [first.residue_per_kg, second.residue_per_kg];
    let [w1, w2] = [first.omega_rad_s, second.omega_rad_s];
    let a = r1 + r2;
    let b = 2.0 * (r1 * second.damping_ratio * w2 + r2 * first.damping_ratio * w1);
    let c = r1 * w2 * w2 + r2 * w1 * w1;
    let discriminant = b * b - 4.0 * a * c;
    let imaginary = (-discriminant).sqrt() / (2.0 * a).abs();
    (discriminant < 0.0).then(|| Complex::new(-b / (2.0 * a), imaginary))
}

/// Asserts that a verdict is not the opposite one. A zero at the end of the band, within 5 %, may count or not.
fn assert_not_wrong(analysis: &ExternalAnalysis, modes: &[ModalTerm; 2]) {
    let right = complex_zero(&modes[0], &modes[1]).filter(|zero| zero.re > 0.0);
    let hz = right.map(|zero| zero.norm() / TAU);
    let (low_hz, high_hz) = analysis.band_hz;
    let within = |ratio: f64| hz.is_some_and(|hz| (low_hz * ratio..high_hz / ratio).contains(&hz));
    match analysis.verdict.cnmp {
        Cnmp::Detected => assert!(within(0.95), "{modes:?} {:?}", analysis.verdict),
        Cnmp::Excluded => assert!(!within(1.05), "{modes:?} {:?}", analysis.verdict),
        Cnmp::Undecided => {}
    }
}

/// The errors of frequency, damping and residue of each mode in standard deviations; `None` if the number of modes is another.
fn errors_in_sigmas(analysis: &ExternalAnalysis, modes: &[ModalTerm]) -> Option<Vec<[f64; 3]>> {
    let found = analysis.fit.as_ref().ok()?.modes();
    let errors = found.iter().zip(modes).map(|(found, mode)| {
        [
            in_sigmas(found.omega_rad_s, mode.omega_rad_s),
            in_sigmas(found.damping_ratio, mode.damping_ratio),
            in_sigmas(found.residue_per_kg, mode.residue_per_kg),
        ]
    });
    (found.len() == modes.len()).then(|| errors.collect())
}

fn in_sigmas(found: Estimate, truth: f64) -> f64 {
    (found.value - truth) / found.sigma
}

#[test]
fn modes_a_few_bins_apart_give_no_wrong_verdict_and_no_wrong_sign() {
    let mut normal = normal(71);
    let (mut decided, mut both_found) = (0, 0);
    const COUNT: usize = 40;
    for _ in 0..COUNT {
        let hz = uniform(&mut normal, 15.0, 30.0);
        let zeta = uniform(&mut normal, 3e-3, 8e-3);
        let chirp_s = uniform(&mut normal, 10.0, 25.0);
        let bins = uniform(&mut normal, 1.0, 6.0);
        let residue = uniform(&mut normal, 0.5, 3.0);
        let sign = if normal() > 0.5 { 1.0 } else { -1.0 };
        let first = term(hz, zeta, uniform(&mut normal, 0.5, 3.0));
        let timing = Timing::new(200.0, chirp_s, &[first]);
        let duration_s = timing.chirp_s + timing.rest_s;
        let second = term(hz + bins / duration_s, 1.2 * zeta, sign * residue);
        let modes = [first, second];
        let record = record(&modes, &timing, (5.0, 60.0), (1e-4, &mut normal));
        let analysis = identified(&record);
        assert_not_wrong(&analysis, &modes);
        decided += usize::from(analysis.verdict.cnmp != Cnmp::Undecided);
        both_found += usize::from(errors_in_sigmas(&analysis, &modes).is_some());
    }
    println!("{decided} decided, {both_found} with both modes, of {COUNT}");
    assert!(decided >= COUNT / 2, "{decided} of {COUNT}");
    assert!(both_found >= COUNT * 3 / 4, "{both_found} of {COUNT}");
}

#[test]
fn intervals_of_a_held_command_cover_up_to_045_of_the_rate() {
    let mut normal = normal(72);
    let mut errors = Vec::new();
    const COUNT: usize = 60;
    for _ in 0..COUNT {
        let rate_hz = uniform(&mut normal, 300.0, 600.0);
        let low_hz = rate_hz * uniform(&mut normal, 0.05, 0.12);
        let high_hz = rate_hz * uniform(&mut normal, 0.3, 0.42);
        let modes = [
            term(low_hz, uniform(&mut normal, 8e-3, 2e-2), 1.0),
            term(high_hz, uniform(&mut normal, 2e-3, 1e-2), -0.7),
        ];
        let band_hz = (0.4 * low_hz, 0.47 * rate_hz);
        let timing = Timing::new(rate_hz, 20.0, &modes);
        let record = record(&modes, &timing, band_hz, (1e-3, &mut normal));
        let analysis = identified(&record);
        assert_not_wrong(&analysis, &modes);
        errors.extend(errors_in_sigmas(&analysis, &modes).unwrap_or_default());
    }
    let number = errors.len();
    assert!(number >= 2 * COUNT * 9 / 10, "{number}");
    for k in 0..3 {
        let square: f64 = errors.iter().map(|error| error[k] * error[k]).sum();
        let rms = (square / number as f64).sqrt();
        println!("parameter {k}: error {rms:.3} sigma rms of {number}");
        // The RMS of 110 normal deviates is 1 with a standard deviation of 1/sqrt(220) = 0.067.
        assert!((0.8..1.2).contains(&rms), "parameter {k}: {rms}");
    }
}
