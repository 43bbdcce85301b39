//! Records of a stage in a closed loop: modes with the reference as the instrument, and the bias without it.

use std::f64::consts::TAU;

use bench_identify::modal::FittedMode;
use bench_identify::verdict::Cnmp;
use bench_identify::{
    Estimate, ExternalAnalysis, Identification, IdentificationError, IdentifyError, SignalsError,
};
use nalgebra::Complex;

const RATE_HZ: f64 = 500.0;
const BAND_HZ: (f64, f64) = (6.0, 50.0);
/// Modes by frequency in hertz, damping ratio and residue. The zeros are at -2.058 +- 194.31j rad/s.
const STAGE: [(f64, f64, f64); 2] = [(12.0, 0.02, 1.0), (38.0, 0.01, 0.6)];
/// u = STIFFNESS e + DAMPING (e - e of the sample before)/T. The open loop has |L| = 9.4 at 12 Hz and 1.6 at 38 Hz, both near -j.
const STIFFNESS: f64 = 2000.0;
const DAMPING: f64 = 8.0;
/// 1 s of rest, a linear sweep from 3 to 60 Hz with an amplitude of 1 in 58 s, and rest.
const SAMPLES: usize = 31_000;
const SWEEP_S: f64 = 58.0;

/// Numbers of PCG's multiplier.
struct Random(u64);

impl Random {
    fn of_seed(seed: u64) -> Random {
        Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x1234_5678_9ABC_DEF1)
    }

    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Of mean 0 and variance 1.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

fn sweep(k: usize) -> f64 {
    let time_s = k as f64 / RATE_HZ - 1.0;
    if !(0.0..SWEEP_S).contains(&time_s) {
        return 0.0;
    }
    let fade = (time_s.min(SWEEP_S - time_s) / 0.5).min(1.0);
    (TAU * (3.0 + 0.5 * 57.0 * time_s / SWEEP_S) * time_s).sin() * fade
}

/// What is recorded of a loop.
#[derive(Clone, Debug, Default)]
struct Record {
    reference: Vec<f64>,
    input: Vec<f64>,
    output: Vec<f64>,
}

/// u = C (r - y) + d, and y with white noise. With the pole p and a held force u, the state of a mode is
/// x[k + 1] = e x[k] + (e - 1)/p u[k], e = exp(p T), and its position r Im x/Im p. The reference of the record is that of the excitation.
fn simulated(noise: f64, seed: u64, excitation: impl Fn(usize) -> Excitation) -> Record {
    let mut random = Random::of_seed(seed);
    let poles =
        STAGE.map(|(hz, zeta, _)| Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * (TAU * hz));
    let mut states = [Complex::new(0.0, 0.0); 2];
    let mut previous = 0.0;
    let mut record = Record::default();
    for k in 0..SAMPLES {
        let positions = states.iter().zip(poles).zip(STAGE);
        let position: f64 = positions.map(|((x, p), mode)| mode.2 * x.im / p.im).sum();
        let measured = position + noise * random.normal();
        let excitation = excitation(k);
        let error = excitation.set_point - measured;
        let rate = (error - previous) * RATE_HZ;
        let force = STIFFNESS * error + DAMPING * rate + excitation.force;
        previous = error;
        for (x, p) in states.iter_mut().zip(poles) {
            let e = (p / RATE_HZ).exp();
            *x = e * *x + (e - 1.0) / p * force;
        }
        record.reference.push(excitation.reference);
        record.input.push(force);
        record.output.push(measured);
    }
    record
}

/// What acts on the loop, and the signal that is recorded of it.
struct Excitation {
    set_point: f64,
    force: f64,
    reference: f64,
}

/// A swept set-point.
fn set_point(k: usize) -> Excitation {
    Excitation {
        set_point: sweep(k),
        force: 0.0,
        reference: sweep(k),
    }
}

fn identification() -> Identification {
    Identification::new(RATE_HZ)
        .band_hz(BAND_HZ.0, BAND_HZ.1)
        .held_s(1.0 / RATE_HZ)
}

fn with_reference(record: &Record) -> ExternalAnalysis {
    let found =
        identification().run_with_reference(&record.reference, &record.input, &record.output);
    found.expect("an analysis")
}

/// The mode that is nearest to a frequency in hertz.
fn nearest(modes: &[FittedMode], hz: f64) -> FittedMode {
    let distance = |mode: &FittedMode| (mode.frequency_hz().value - hz).abs();
    let by_distance = |a: &&FittedMode, b: &&FittedMode| distance(a).total_cmp(&distance(b));
    *modes.iter().min_by(by_distance).expect("a mode")
}

/// The errors of the nearest modes in standard deviations: frequency, damping ratio and residue of each.
fn normalised_errors(found: &ExternalAnalysis) -> [[f64; 3]; 2] {
    let modes = found.fit.as_ref().expect("modes").modes();
    let of = |estimate: Estimate, truth: f64| (estimate.value - truth) / estimate.sigma;
    STAGE.map(|(hz, zeta, residue)| {
        let mode = nearest(&modes, hz);
        [
            of(mode.frequency_hz(), hz),
            of(mode.damping_ratio, zeta),
            of(mode.residue_per_kg, residue),
        ]
    })
}

/// Within five standard deviations, with a residue that is known to a ratio.
fn assert_modes(found: &ExternalAnalysis, max_sigma: f64) {
    for errors in normalised_errors(found) {
        assert!(errors.iter().all(|z| z.abs() < 5.0), "{errors:?}");
    }
    let modes = found.fit.as_ref().expect("modes").modes();
    assert_eq!(modes.len(), STAGE.len(), "{}", found.verdict.why);
    for (mode, (_, _, residue)) in modes.iter().zip(STAGE) {
        let sigma = mode.residue_per_kg.sigma;
        assert!(sigma < max_sigma * residue, "{:?}", mode.residue_per_kg);
    }
}

/// Noise whose power in a bin is 0.05 of that of the reference. A sweep over B in the time T_s has |R|^2 = rate^2 T_s/(4 B), and noise
/// in a record of the time T has |V|^2 = rate T sigma^2: |V|^2/|R|^2 = 4 B T/(T_s rate) sigma^2 = 0.487 sigma^2.
const STRONG_NOISE: f64 = 0.32;

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The residue of each mode over the true one, minus 1.
fn residue_errors(found: &ExternalAnalysis) -> [f64; 2] {
    let modes = found.fit.as_ref().expect("modes").modes();
    STAGE.map(|(hz, _, residue)| nearest(&modes, hz).residue_per_kg.value / residue - 1.0)
}

/// H1 from input to output is G - rho (G + 1/C) with rho = 0.05/1.05, as the noise v adds -C S v to the input: 1/C is nearly a constant, and
/// the residues are 4.8 % too small. Their standard deviations are some 1 % at 12 Hz, where |1 + 1/L| is 1 over several half-widths.
#[test]
fn strong_noise_in_the_loop_biases_the_response_of_the_input_but_not_that_of_the_reference() {
    let (mut inside, mut all) = (0, 0);
    let (mut joint, mut direct) = (Vec::new(), Vec::new());
    let (mut sigmas, mut direct_sigmas) = (Vec::new(), Vec::new());
    for seed in 0..60 {
        let record = simulated(STRONG_NOISE, seed, set_point);
        let found = with_reference(&record);
        for errors in normalised_errors(&found) {
            inside += errors.iter().filter(|z| z.abs() < 1.96).count();
            all += errors.len();
            sigmas.push(errors[2]);
        }
        joint.extend(residue_errors(&found));
        if seed < 10 {
            let found = identification().run(&record.input, &record.output);
            let found = found.expect("an analysis");
            direct.extend(residue_errors(&found));
            direct_sigmas.extend(normalised_errors(&found).map(|errors| errors[2]));
        }
    }
    let coverage = inside as f64 / all as f64;
    println!("coverage {coverage:.3} of {all}");
    let (joint, direct) = (mean(&joint), mean(&direct));
    let (sigmas, direct_sigmas) = (mean(&sigmas), mean(&direct_sigmas));
    println!("joint {joint:.4}, {sigmas:.2} sigmas; direct {direct:.4}, {direct_sigmas:.2} sigmas");
    assert!((0.90..0.99).contains(&coverage), "{coverage} of {all}");
    // The mean of 120 errors of variance 1 has a standard deviation of 0.09.
    assert!(sigmas.abs() < 0.3, "{sigmas}");
    assert!(joint.abs() < 0.01, "{joint}");
    assert!((-0.07..-0.03).contains(&direct), "{direct}");
    assert!(direct_sigmas < -2.0, "{direct_sigmas}");
}

#[test]
fn modes_zeros_and_verdict_of_a_stage_in_a_loop() {
    let found = with_reference(&simulated(3e-3, 1, set_point));
    assert_modes(&found, 1e-2);
    assert_eq!(found.verdict.cnmp, Cnmp::Excluded, "{}", found.verdict.why);
    let data = &found.frf.data;
    let chi2 = found.fit.as_ref().expect("modes").chi2_per_freedom;
    // 2200 bins with two components: the standard deviation of chi^2 per freedom is sqrt(2/4400) = 0.02, and that of the noise some 2 %.
    assert!(data.len() > 2000, "{}", data.len());
    assert!((0.85..1.15).contains(&chi2), "{chi2}");
}

/// A force that is added in the loop: the response of the output to it is G S, whatever its unit.
#[test]
fn reference_enters_the_loop_anywhere_in_any_unit() {
    let at_scale = |scale: f64| {
        let added = |k: usize| Excitation {
            set_point: 0.0,
            force: 2000.0 * sweep(k),
            reference: scale * sweep(k),
        };
        with_reference(&simulated(3e-3, 2, added))
    };
    let found = at_scale(1.0);
    assert_modes(&found, 1e-2);
    assert_eq!(found.verdict.cnmp, Cnmp::Excluded, "{}", found.verdict.why);
    // Powers of 2, so that the rounding is the same.
    for scale in [2.0_f64.powi(-20), 2.0_f64.powi(30)] {
        let scaled = at_scale(scale);
        assert_eq!(scaled.frf.data.len(), found.frf.data.len());
        for (a, b) in scaled.frf.data.iter().zip(&found.frf.data) {
            let ratio = a.variance / b.variance;
            assert!((ratio - 1.0).abs() < 1e-6, "{scale}: {a:?} {b:?}");
        }
        for (a, b) in scaled
            .frf
            .magnitude_sigma
            .iter()
            .zip(&found.frf.magnitude_sigma)
        {
            assert!((a / b - 1.0).abs() < 1e-6, "{scale}: {a} {b}");
        }
    }
}

/// The band of the reference without a stated one, and a set-point that ends at 40 after a move of 2 s before the sweep ends.
#[test]
fn set_point_may_end_elsewhere_than_it_began() {
    let moving = |k: usize| {
        let time_s = k as f64 / RATE_HZ;
        let part = ((time_s - 55.0) / 2.0).clamp(0.0, 1.0);
        let moved = 10.0 + 40.0 * part * part * (3.0 - 2.0 * part);
        let set_point = moved + sweep(k);
        Excitation {
            set_point,
            force: 0.0,
            reference: set_point,
        }
    };
    // The loop begins at rest at 10: the first 1.5 s, in which it goes there, are cut.
    let record = simulated(3e-3, 3, |k| moving(k.saturating_sub(750)));
    let cut = |samples: &Vec<f64>| samples[750..].to_vec();
    let record = Record {
        reference: cut(&record.reference),
        input: cut(&record.input),
        output: cut(&record.output),
    };
    let found = with_reference(&record);
    assert_modes(&found, 1e-2);
    assert_eq!(found.verdict.cnmp, Cnmp::Excluded, "{}", found.verdict.why);
}

#[test]
fn band_without_a_stated_one_is_that_of_the_reference() {
    let record = simulated(3e-3, 4, set_point);
    let found = Identification::new(RATE_HZ)
        .held_s(1.0 / RATE_HZ)
        .run_with_reference(&record.reference, &record.input, &record.output)
        .expect("an analysis");
    // The sweep from 3 to 60 Hz; the input has noise up to 250 Hz.
    let (low_hz, high_hz) = found.band_hz;
    assert!((1.0..3.5).contains(&low_hz), "{low_hz}");
    assert!((58.0..66.0).contains(&high_hz), "{high_hz}");
}

#[test]
fn exchanged_columns_give_no_verdict_and_no_certain_remedy() {
    let record = simulated(1e-5, 5, set_point);
    let found = identification()
        .run_with_reference(&record.reference, &record.output, &record.input)
        .expect("an analysis");
    let why = &found.verdict.why;
    assert_eq!(found.verdict.cnmp, Cnmp::Undecided, "{why}");
    assert!(why.contains("--reference"), "{why}");
    assert!(!why.contains("which are swapped"), "{why}");
}

#[test]
fn rejects_references_that_are_none() {
    let Record {
        reference,
        input,
        output,
    } = simulated(1e-5, 6, set_point);
    let rejected = |reference: &[f64]| {
        let found = identification().run_with_reference(reference, &input, &output);
        found.map(|_| ()).expect_err("an error")
    };
    let (samples, signals) = (SAMPLES, SAMPLES);
    let lengths = SignalsError::ReferenceLength {
        reference: SAMPLES - 1,
        signals,
    };
    let constant = SignalsError::ConstantReference {
        value: 0.25,
        samples,
    };
    for (given, error) in [
        (&reference[1..], lengths),
        (&vec![0.25; SAMPLES][..], constant),
    ] {
        let error = IdentificationError::Signals(IdentifyError::Signals(error));
        assert_eq!(rejected(given), error);
    }
    for value in [f64::NAN, f64::INFINITY] {
        let mut damaged = reference.clone();
        damaged[17] = value;
        let why = rejected(&damaged).to_string();
        assert!(why.contains("the reference is"), "{why}");
        assert!(why.contains("at sample 17"), "{why}");
    }
}

#[test]
fn reference_of_another_record_is_named() {
    let record = simulated(1e-3, 7, set_point);
    // Noise that the loop does not know, in place of its reference.
    let mut random = Random::of_seed(8);
    let other: Vec<f64> = (0..SAMPLES).map(|_| random.normal()).collect();
    let found = identification().run_with_reference(&other, &record.input, &record.output);
    let error = found.map(|found| found.verdict.why).expect_err("no data");
    let (low_hz, high_hz) = BAND_HZ;
    let weak = IdentifyError::WeakReference { low_hz, high_hz };
    assert_eq!(error, IdentificationError::Signals(weak));
}

#[test]
fn periods_need_no_reference() {
    let record = simulated(1e-3, 9, set_point);
    let repetition = bench_identify::periodic::Repetition {
        period: 5000,
        skip: 0,
    };
    let found = identification().periods(repetition).run_with_reference(
        &record.reference,
        &record.input,
        &record.output,
    );
    let error = found.map(|found| found.verdict.why).expect_err("refused");
    assert_eq!(error, IdentificationError::ReferenceOfPeriods);
}
