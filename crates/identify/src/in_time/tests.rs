//! Rounded outputs of exact motions: the modes within their errors, and no modes where the readings are not those of modes.

mod lost;

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::simulated::{Parts, Simulation};
use super::*;
use crate::Signals;
use crate::modal::ModalParameters;
use crate::modal::{self, MeasurementChain};
use crate::record_check::Reading;
use crate::{EstimatorSettings, Identification, IdentifySettings, response};
use bench_plant::zeros::ModalTerm;
use nalgebra::Complex;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 500.0;
const BAND_HZ: (f64, f64) = (4.0, 60.0);
/// The step, as a ratio of the largest amplitude, and the noise, as a ratio of the step.
const STEP: f64 = 0.01;
const NOISE: f64 = 0.05;

fn term(frequency_hz: f64, damping_ratio: f64, residue_per_kg: f64) -> ModalTerm {
    ModalTerm {
        omega_rad_s: TAU * frequency_hz,
        damping_ratio,
        residue_per_kg,
    }
}

/// Two modes of opposite signs.
fn stage() -> Vec<ModalTerm> {
    vec![term(15.0, 0.02, 0.6), term(34.0, 0.012, -0.8)]
}

/// A linear sweep from 4 to 60 Hz in 12 s, and 4 s of rest.
fn sweep() -> Vec<f64> {
    let at = |k: u32| {
        let t = f64::from(k) / RATE_HZ;
        let phase = TAU * (BAND_HZ.0 * t + 0.5 * (BAND_HZ.1 - BAND_HZ.0) / 12.0 * t * t);
        if t < 12.0 { 0.1 * phase.sin() } else { 0.0 }
    };
    (0..8000).map(at).collect()
}

/// The position by a held force, at each sample before its step: with the pole p of a mode, q[k + 1] = exp(p T) q[k] + (exp(p T) - 1)/p u[k]
/// and the position r Im q/Im p.
fn motion(modes: &[ModalTerm], input: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; input.len()];
    for mode in modes {
        let (w, zeta) = (mode.omega_rad_s, mode.damping_ratio);
        let pole = Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * w;
        let step = (pole / RATE_HZ).exp();
        let mut q = Complex::new(0.0, 0.0);
        for (y, u) in sum.iter_mut().zip(input) {
            *y += mode.residue_per_kg * q.im / pole.im;
            q = step * q + (step - 1.0) / pole * u;
        }
    }
    sum
}

/// A motion with noise and the step of its readings.
fn noisy(motion: &[f64], seed: u64) -> (Vec<f64>, f64) {
    let largest = motion.iter().fold(0.0_f64, |max, y| max.max(y.abs()));
    let step = STEP * largest;
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut uniform = || (random.next_u64() as f64 + 0.5) / u64::MAX as f64;
    let mut normal = || (-2.0 * uniform().ln()).sqrt() * (TAU * uniform()).cos();
    let sum = motion.iter().map(|y| y + NOISE * step * normal());
    (sum.collect(), step)
}

fn rounded(values: &[f64], step: f64) -> Vec<f64> {
    values.iter().map(|y| step * (y / step).round()).collect()
}

fn signals(output: Vec<f64>) -> Signals {
    Signals {
        rate_hz: RATE_HZ,
        input: sweep(),
        output,
    }
}

/// The modes of rounded readings, beginning with a fit to their response.
fn fitted(values: Vec<f64>, step: f64) -> Option<TimeFit> {
    let readings: Vec<Reading> = values.iter().copied().map(Reading::Value).collect();
    fitted_to(&readings, values, Some(step))
}

/// The modes of readings, beginning with a fit to the response of an output.
fn fitted_to(readings: &[Reading], output: Vec<f64>, step: Option<f64>) -> Option<TimeFit> {
    let signals = signals(output);
    let frf = response(
        &signals,
        BAND_HZ,
        &IdentifySettings::Local(EstimatorSettings::default()),
    )
    .expect("a response");
    let path = crate::modal::InputPath {
        hold_s: 1.0 / RATE_HZ,
        lag_s: 0.0,
    };
    let MeasurementChain::Bench(path) = path.chain(RATE_HZ) else {
        panic!("a held input");
    };
    let chain = MeasurementChain::Bench(path.clone());
    let orders = modal::rising_orders(&frf.data, &chain, 6).expect("modes");
    let mut search = TimeSearch::new(&signals.input, readings, step, &path);
    search.try_modes(orders);
    search.result(BAND_HZ)
}

/// The errors of w, zeta and r of each mode over their standard deviations.
fn errors(fit: &crate::modal::ModalFit) -> Vec<f64> {
    let modes = fit.modes();
    assert_eq!(modes.len(), stage().len());
    let of_mode = |(found, truth): (&crate::modal::FittedMode, ModalTerm)| {
        let over =
            |estimate: crate::Estimate, value: f64| (estimate.value - value) / estimate.sigma;
        [
            over(found.omega_rad_s, truth.omega_rad_s),
            over(found.damping_ratio, truth.damping_ratio),
            over(found.residue_per_kg, truth.residue_per_kg),
        ]
    };
    modes.iter().zip(stage()).flat_map(of_mode).collect()
}

#[test]
fn errors_are_those_that_the_intervals_state() {
    let exact = motion(&stage(), &sweep());
    let mut all = Vec::new();
    let mut noise = Vec::new();
    for seed in 0..12 {
        let (values, step) = noisy(&exact, seed);
        let found = fitted(rounded(&values, step), step).expect("modes");
        all.extend(errors(&found.fit));
        noise.push(found.noise.sigma / (NOISE * step));
    }
    // The sum of the squares of 72 errors, some of which depend on each other: chi-square of 72 lies within 35 and 122 with 99.99 %, of 36
    // that count twice within 26 and 150. With intervals that are half or twice as wide it is about 288 or 18.
    let squares: f64 = all.iter().map(|error| error * error).sum();
    assert!((26.0..150.0).contains(&squares), "{squares}");
    // Some hundred readings near an end of their cell: 7 % each, 2 % in the mean.
    let mean = noise.iter().sum::<f64>() / noise.len() as f64;
    assert!((mean - 1.0).abs() < 0.06, "{mean}");
}

#[test]
fn readings_that_are_cut_off_and_not_rounded_have_the_same_modes() {
    let (values, step) = noisy(&motion(&stage(), &sweep()), 7);
    let readings = values.iter().map(|y| step * (y / step).floor()).collect();
    let found = fitted(readings, step).expect("modes");
    for error in errors(&found.fit) {
        assert!(error.abs() < 4.0, "{error}");
    }
}

#[test]
fn delay_of_a_part_of_a_sample_is_found() {
    // The motion at tenths of samples, of which every tenth one is seen, 3 tenths late.
    let input = sweep();
    let fine: Vec<f64> = input.iter().flat_map(|u| [*u; 10]).collect();
    let tenth = |mode: ModalTerm| ModalTerm {
        omega_rad_s: mode.omega_rad_s / 10.0,
        residue_per_kg: mode.residue_per_kg / 100.0,
        ..mode
    };
    let modes: Vec<ModalTerm> = stage().into_iter().map(tenth).collect();
    let moved = motion(&modes, &fine);
    let exact: Vec<f64> = (0..input.len())
        .map(|k| if k == 0 { 0.0 } else { moved[10 * k - 3] })
        .collect();
    let (values, step) = noisy(&exact, 3);
    let found = fitted(rounded(&values, step), step).expect("modes");
    let delay = found.fit.delay_s();
    let expected_s = 0.3 / RATE_HZ;
    assert!(
        (delay.value - expected_s).abs() < 4.0 * delay.sigma,
        "{delay:?}"
    );
    assert!(delay.sigma < 0.01 * expected_s, "{delay:?}");
}

#[test]
fn readings_show_no_modes_where_the_output_stays_within_a_step() {
    // A sweep up to 60 Hz of modes at 15 and 16 Hz, with steps of a third of the deflection by a constant force. The output is half a step,
    // so that no reading changes, at the frequency f with 3/((f/15)^2 - 1) = 0.5, 40 Hz.
    let modes = vec![term(15.0, 0.02, 0.6), term(16.0, 0.02, 0.06)];
    let (values, _) = noisy(&motion(&modes, &sweep()), 6);
    let compliance = |mode: &ModalTerm| mode.residue_per_kg / mode.omega_rad_s.powi(2);
    let step = 0.1 * modes.iter().map(compliance).sum::<f64>() / 3.0;
    let found = fitted(rounded(&values, step), step).expect("modes");
    let seen_hz = found.noise.seen_up_to_hz;
    assert!((30.0..52.0).contains(&seen_hz), "{seen_hz}");
}

#[test]
fn rejects_steps_of_unequal_size() {
    // The ends of the cells are off by 7 % of a step, in a pattern without a period.
    let (values, step) = noisy(&motion(&stage(), &sweep()), 1);
    let end = |level: f64| level + 0.5 + 0.1 * (level * 2.399_963).sin();
    let reading = |y: &f64| {
        let near = (y / step).round();
        let above = f64::from(u8::from(y / step > end(near)));
        let below = f64::from(u8::from(y / step < end(near - 1.0)));
        step * (near + above - below)
    };
    assert!(fitted(values.iter().map(reading).collect(), step).is_none());
}

#[test]
fn rejects_a_mode_that_moves_during_the_record() {
    let input = sweep();
    let mut moved = stage();
    moved[1].omega_rad_s *= 1.005;
    let (first, last) = (motion(&stage(), &input), motion(&moved, &input));
    let count = input.len() as f64;
    let mixed = first.iter().zip(last).enumerate();
    let exact: Vec<f64> = mixed
        .map(|(k, (a, b))| a + (b - a) * k as f64 / count)
        .collect();
    let (values, step) = noisy(&exact, 2);
    assert!(fitted(rounded(&values, step), step).is_none());
}

#[test]
fn rejects_a_disturbance_that_the_modes_do_not_have() {
    let (values, step) = noisy(&motion(&stage(), &sweep()), 4);
    let hum = |(k, y): (usize, &f64)| y + 0.3 * step * (TAU * 21.3 * k as f64 / RATE_HZ).sin();
    let values: Vec<f64> = values.iter().enumerate().map(hum).collect();
    assert!(fitted(rounded(&values, step), step).is_none());
}

#[test]
fn output_without_noise_has_modes_within_their_errors() {
    // Hardly a reading is uncertain, so that the noise is taken as that with which enough are.
    let exact = motion(&stage(), &sweep());
    let (_, step) = noisy(&exact, 0);
    let found = fitted(rounded(&exact, step), step).expect("modes");
    for error in errors(&found.fit) {
        assert!(error.abs() < 3.0, "{error}");
    }
    let information = found.noise.sigma / step;
    assert!((1e-3..0.02).contains(&information), "{information}");
}

#[test]
fn simulated_output_and_derivatives_are_those_of_the_motion() {
    let input = sweep();
    let path = bench_plant::SignalPath {
        period_s: 1.0 / RATE_HZ,
        amplifier_bandwidth_hz: f64::INFINITY,
        force_constant_n_per_a: 1.0,
        delays_s: vec![0.0],
        output: bench_plant::OutputKind::Position,
    };
    let simulation = Simulation {
        path: &path,
        input: &input,
    };
    let parameters = ModalParameters {
        modes: stage(),
        ..ModalParameters::default()
    };
    let exact = motion(&stage(), &input);
    let largest = exact.iter().fold(0.0_f64, |max, y| max.max(y.abs()));
    let expect = |found: &[f64], expected: &[f64], accuracy: f64| {
        let scale = expected.iter().fold(0.0_f64, |max, y| max.max(y.abs()));
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                (found - expected).abs() < accuracy * scale,
                "{found} {expected}"
            );
        }
    };
    let parts = simulation.parts(&parameters, &Parts::default());
    expect(&parts.sum(&parameters), &exact, 1e-9);
    let derivatives = simulation.derivatives(&parameters, &parts);
    // w, zeta, r of each mode, R and tau.
    assert_eq!(derivatives.len(), 8);
    // By the fourth-order difference of the motion; its error is about (1e-3 Q)^4 and rounding over 1e-3. The one-sided
    // differences of w and zeta are wrong by 1e-6 and some rounding.
    let along = |change: &dyn Fn(&mut Vec<ModalTerm>, f64)| -> Vec<f64> {
        let at = |h: f64| {
            let mut modes = stage();
            change(&mut modes, h);
            motion(&modes, &input)
        };
        let h = 1e-4;
        let (a, b, c, d) = (at(2.0 * h), at(h), at(-h), at(-2.0 * h));
        (0..input.len())
            .map(|k| (8.0 * (b[k] - c[k]) - (a[k] - d[k])) / (12.0 * h))
            .collect()
    };
    expect(
        &derivatives[3],
        &along(&|m, h| m[1].omega_rad_s *= h.exp()),
        3e-6,
    );
    expect(
        &derivatives[4],
        &along(&|m, h| m[1].damping_ratio *= h.exp()),
        3e-6,
    );
    expect(
        &derivatives[5],
        &along(&|m, h| m[1].residue_per_kg += h),
        1e-6,
    );
    // A constant compliance follows the input, seen before its step: by the sample before.
    let late: Vec<f64> = std::iter::once(0.0).chain(input.iter().copied()).collect();
    expect(&derivatives[6], &late[..input.len()], 1e-3);
    // The derivative to a delay is the negative velocity: with the numerator s, Re of q.
    let mut velocity = vec![0.0; input.len()];
    for mode in stage() {
        let (w, zeta) = (mode.omega_rad_s, mode.damping_ratio);
        let pole = Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * w;
        let step = (pole / RATE_HZ).exp();
        let mut q = Complex::new(0.0, 0.0);
        for (v, u) in velocity.iter_mut().zip(&input) {
            *v -= mode.residue_per_kg * (pole * q).im / pole.im;
            q = step * q + (step - 1.0) / pole * u;
        }
    }
    expect(&derivatives[7], &velocity, 2e-3);
    assert!(largest > 0.0);
}

/// Through the whole identification: without the likelihood the modes of this record are wrong by many times their errors.
#[test]
fn identification_of_a_rounded_output_decides_with_the_true_modes() {
    let (values, step) = noisy(&motion(&stage(), &sweep()), 5);
    let identification = Identification::new(RATE_HZ).held_s(1.0 / RATE_HZ);
    let found = identification
        .run(&sweep(), &rounded(&values, step))
        .expect("an analysis");
    let noise = found.readings_fit.expect("a rounded output");
    assert!(
        (noise.step.expect("a step") / step - 1.0).abs() < 1e-9,
        "{noise:?}"
    );
    assert!(
        (noise.sigma / (NOISE * step) - 1.0).abs() < 0.3,
        "{noise:?}"
    );
    assert_eq!(found.verdict.cnmp, crate::verdict::Cnmp::Excluded);
    let modes = found.fit.expect("modes").modes();
    let hz: Vec<f64> = modes.iter().map(|mode| mode.frequency_hz().value).collect();
    assert_eq!(hz.len(), 2);
    assert!(
        (hz[0] - 15.0).abs() < 1e-3 && (hz[1] - 34.0).abs() < 1e-3,
        "{hz:?}"
    );
}
