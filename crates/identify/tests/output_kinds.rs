//! Modes and verdicts of outputs that are positions, velocities and accelerations, by closed form.

use std::f64::consts::TAU;

use bench_identify::verdict::Cnmp;
use bench_identify::{Estimate, ExternalAnalysis, Identification, OutputKind, StaticSign};
use nalgebra::Complex;

const RATE_HZ: f64 = 500.0;
const BAND_HZ: (f64, f64) = (4.0, 90.0);

/// A mode by frequency in hertz, damping ratio and residue.
type Mode = (f64, f64, f64);

/// Zeros at -2.058 +- 194.31j rad/s, by the roots of 0.6 (s^2 + 2 z1 w1 s + w1^2) + 1.0 (s^2 + 2 z2 w2 s + w2^2).
const STAGE: [Mode; 2] = [(12.0, 0.02, 1.0), (38.0, 0.01, 0.6)];

/// Numbers of PCG's multiplier.
struct Random(u64);

impl Random {
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

    fn log_between(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.uniform())
    }
}

/// How the force follows from its samples, and on which side of its step an acceleration is read.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Force {
    HeldReadBefore,
    HeldReadAfter,
    /// Linear between samples at 16 times the rate: that of a measured smooth force.
    Smooth,
}

/// A linear chirp over the band with faded ends, after 0.5 s at rest.
fn chirp(t_s: f64, chirp_s: f64) -> f64 {
    let t_s = t_s - 0.5;
    if !(0.0..chirp_s).contains(&t_s) {
        return 0.0;
    }
    let ends = (t_s.min(chirp_s - t_s) / (0.05 * chirp_s)).min(1.0);
    let rising_hz = 0.5 * (BAND_HZ.1 - BAND_HZ.0) * t_s / chirp_s;
    (TAU * (BAND_HZ.0 + rising_hz) * t_s).sin() * (0.5 - 0.5 * (0.5 * TAU * ends).cos())
}

/// With the pole p, x' = p x + f and y = r Im(p^k x)/Im p, + r f for an acceleration. Of a force f0 + (f1 - f0) t/T over a step T,
/// x(T) = e x + (e - 1)/p f0 + ((e - 1)/(p^2 T) - 1/p) (f1 - f0), e = exp(p T).
fn add_mode(
    output: &mut [f64],
    (hz, zeta, residue): Mode,
    kind: OutputKind,
    force: Force,
    chirp_s: f64,
) {
    let fine = if force == Force::Smooth { 16 } else { 1 };
    let pole = Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * (TAU * hz);
    let step_s = 1.0 / (RATE_HZ * fine as f64);
    let e = (pole * step_s).exp();
    let (by_first, by_rise) = (
        (e - 1.0) / pole,
        (e - 1.0) / (pole * pole * step_s) - pole.inv(),
    );
    let sample = |k: usize| chirp(k as f64 * step_s, chirp_s);
    let mut x = Complex::new(0.0, 0.0);
    for k in 0..output.len() * fine {
        let now = sample(k);
        if k % fine == 0 {
            let direct = match (kind, force) {
                (OutputKind::Acceleration, Force::HeldReadBefore) => sample(k.saturating_sub(1)),
                (OutputKind::Acceleration, _) => now,
                _ => 0.0,
            };
            let modal = (pole.powi(kind.derivatives()) * x).im / pole.im;
            output[k / fine] += residue * (modal + direct);
        }
        let rise = if force == Force::Smooth {
            sample(k + 1) - now
        } else {
            0.0
        };
        x = e * x + by_first * now + by_rise * rise;
    }
}

/// Input and output of a chirp from rest to rest, with noise as a ratio of the RMS output.
fn record(
    stage: &[Mode],
    kind: OutputKind,
    force: Force,
    noise: f64,
    random: &mut Random,
) -> (Vec<f64>, Vec<f64>) {
    let slowest = stage
        .iter()
        .map(|(hz, zeta, _)| TAU * hz * zeta)
        .fold(f64::INFINITY, f64::min);
    let chirp_s = 12.0;
    let samples = (RATE_HZ * (chirp_s + 1.0 + 8.0 / slowest)) as usize;
    let input = (0..samples)
        .map(|k| chirp(k as f64 / RATE_HZ, chirp_s))
        .collect();
    let mut output = vec![0.0; samples];
    for mode in stage {
        add_mode(&mut output, *mode, kind, force, chirp_s);
    }
    let rms = (output.iter().map(|y| y * y).sum::<f64>() / samples as f64).sqrt();
    output
        .iter_mut()
        .for_each(|y| *y += noise * rms * random.normal());
    (input, output)
}

fn identified(
    stated: Option<OutputKind>,
    force: Force,
    (input, output): &(Vec<f64>, Vec<f64>),
) -> ExternalAnalysis {
    let mut identification = Identification::new(RATE_HZ).band_hz(BAND_HZ.0, BAND_HZ.1);
    if force != Force::Smooth {
        identification = identification.held_s(1.0 / RATE_HZ);
    }
    if let Some(kind) = stated {
        identification = identification.output_kind(kind);
    }
    identification.run(input, output).expect("an analysis")
}

/// Within five standard deviations, which are below a ratio of the value.
fn assert_estimate(what: &str, found: Estimate, truth: f64, max_sigma: f64) {
    let error = (found.value - truth).abs();
    assert!(error < 5.0 * found.sigma, "{what}: {found:?} for {truth}");
    assert!(found.sigma < max_sigma * truth.abs(), "{what}: {found:?}");
}

#[test]
fn modes_of_a_velocity_and_of_an_acceleration_are_those_of_the_position() {
    let forces = [Force::HeldReadBefore, Force::HeldReadAfter, Force::Smooth];
    for (seed, kind) in OutputKind::ALL.into_iter().enumerate() {
        for force in forces {
            let case = format!("{} {force:?}", kind.name());
            let mut random = Random(seed as u64 + 11);
            let found = identified(
                Some(kind),
                force,
                &record(&STAGE, kind, force, 1e-3, &mut random),
            );
            let modes = found.fit.as_ref().expect("modes").modes();
            assert_eq!(modes.len(), 2, "{case}");
            for (mode, (hz, zeta, residue)) in modes.iter().zip(STAGE) {
                // Noise of 1e-3 in some 6000 samples.
                assert_estimate(&case, mode.frequency_hz(), hz, 1e-5);
                assert_estimate(&case, mode.damping_ratio, zeta, 1e-3);
                assert_estimate(&case, mode.residue_per_kg, residue, 1e-3);
            }
            assert_eq!(
                found.verdict.cnmp,
                Cnmp::Excluded,
                "{case}: {}",
                found.verdict.why
            );
            assert_eq!(found.output_kind, kind);
            let zeros = &found.verdict.zeros;
            assert_eq!(
                zeros.len(),
                1,
                "{case}: zeros at 0 are not those of the position"
            );
            let distance = (zeros[0].s - Complex::new(-2.058, 194.31)).norm();
            assert!(distance < 0.3, "{case}: {:?}", zeros[0]);
        }
    }
}

#[test]
fn sign_of_the_static_response_is_that_of_the_sensor() {
    let force = Force::HeldReadBefore;
    for (sensor, sign) in [(1.0, StaticSign::Positive), (-1.0, StaticSign::Negative)] {
        let stage = STAGE.map(|(hz, zeta, residue)| (hz, zeta, sensor * residue));
        let record = record(&stage, OutputKind::Position, force, 1e-3, &mut Random(31));
        let found = identified(None, force, &record);
        assert_eq!(found.static_sign(), Some(sign));
        assert_eq!(found.verdict.cnmp, Cnmp::Excluded, "{}", found.verdict.why);
    }
}

/// A velocity that is taken for a position has modes that do not describe it, or too many for the data to determine.
#[test]
fn modes_that_do_not_describe_the_stage_have_no_certain_sign() {
    let (kind, force) = (OutputKind::Velocity, Force::HeldReadBefore);
    let mut with_modes = 0;
    for seed in 32..40 {
        let record = record(&STAGE, kind, force, 1e-3, &mut Random(seed));
        let found = identified(None, force, &record);
        assert_eq!(found.verdict.cnmp, Cnmp::Undecided);
        assert_eq!(found.static_sign(), None);
        if let Ok(fit) = &found.fit {
            let modes = found.verdict.modes(fit);
            assert!(modes.len() > 1);
            assert!(modes.iter().all(|mode| mode.certain_sign() == '?'));
            with_modes += 1;
        }
        let found = identified(Some(kind), force, &record);
        let modes = found.verdict.modes(found.fit.as_ref().expect("modes"));
        assert!(modes.iter().all(|mode| mode.certain_sign() == '+'));
    }
    assert!(with_modes > 0);
}

/// One to three modes, the first one with a positive residue.
struct Stage {
    modes: Vec<Mode>,
}

impl Stage {
    fn random(random: &mut Random) -> Stage {
        let count = 1 + (3.0 * random.uniform()) as usize;
        let mut hz = random.log_between(7.0, 14.0);
        let modes = (0..count).map(|k| {
            let sign = if k > 0 && random.uniform() < 0.5 {
                -1.0
            } else {
                1.0
            };
            let mode = (
                hz,
                random.log_between(0.005, 0.03),
                sign * random.log_between(0.2, 2.0),
            );
            hz *= random.log_between(1.25, 2.3);
            mode
        });
        Stage {
            modes: modes.collect(),
        }
    }

    /// The number of zeros in the right half plane, of N = sum of r_k times the other denominators, by the change of the phase of N along
    /// the imaginary axis (Hurwitz): from 0 to infinity it is pi/2 (left - right).
    fn right_zeros(&self) -> i32 {
        let poles: Vec<(f64, f64)> = self
            .modes
            .iter()
            .map(|(hz, zeta, _)| (TAU * hz, *zeta))
            .collect();
        let denominator = |k: usize, s: Complex<f64>| {
            s * s + s * (2.0 * poles[k].1 * poles[k].0) + poles[k].0.powi(2)
        };
        let numerator = |w: f64| {
            let s = Complex::new(0.0, w);
            let term = |k: usize| {
                let others = (0..poles.len()).filter(|j| *j != k);
                others.map(|j| denominator(j, s)).product::<Complex<f64>>() * self.modes[k].2
            };
            (0..poles.len()).map(term).sum::<Complex<f64>>()
        };
        let points: Vec<Complex<f64>> = (0..40_000)
            .map(|k| numerator(0.1 * (k as f64 * 4e-4).exp()))
            .collect();
        let turn: f64 = points
            .windows(2)
            .map(|pair| (pair[1] / pair[0]).arg())
            .sum();
        let left_less_right = (turn / (0.25 * TAU)).round() as i32;
        let all = 2 * (poles.len() as i32 - 1);
        (all - left_less_right) / 2
    }
}

/// Whether a verdict differs from the truth: a CNMP pair is two zeros in the right half plane, a real zero is one.
fn is_wrong(found: &ExternalAnalysis, stage: &Stage) -> bool {
    match found.verdict.cnmp {
        Cnmp::Detected => stage.right_zeros() < 2,
        Cnmp::Excluded => stage.right_zeros() >= 2,
        Cnmp::Undecided => false,
    }
}

#[test]
fn no_random_stage_has_a_wrong_verdict_or_sign_and_none_is_named_another_kind() {
    for kind in OutputKind::ALL {
        let mut undecided = 0;
        for seed in 0..20 {
            let mut random = Random(0x9E37_79B9 * (seed + 1) + kind.derivatives() as u64);
            let stage = Stage::random(&mut random);
            let force = [Force::HeldReadBefore, Force::HeldReadAfter][seed as usize % 2];
            let noise = random.log_between(3e-4, 3e-3);
            let signals = record(&stage.modes, kind, force, noise, &mut random);
            let found = identified(Some(kind), force, &signals);
            let case = format!(
                "{} {seed}: {} {:?}",
                kind.name(),
                found.verdict.why,
                stage.modes
            );
            assert!(!is_wrong(&found, &stage), "{case}");
            assert!(!found.verdict.why.contains("--output-kind"), "{case}");
            assert!(!found.verdict.why.contains("exchange"), "{case}");
            undecided += i32::from(found.verdict.cnmp == Cnmp::Undecided && stage.modes.len() > 1);
            let modes = found.fit.expect("modes").modes();
            assert_eq!(modes.len(), stage.modes.len(), "{case}");
            for (mode, (hz, _, residue)) in modes.iter().zip(&stage.modes) {
                assert!(
                    (mode.frequency_hz().value / hz - 1.0).abs() < 1e-3,
                    "{case}"
                );
                assert!(mode.residue_per_kg.value * residue > 0.0, "{case}");
            }
        }
        assert!(
            undecided <= 3,
            "{}: {undecided} of 20 are undecided",
            kind.name()
        );
    }
}

#[test]
fn kind_that_is_not_stated_is_named_and_no_verdict_is_made() {
    let force = Force::HeldReadBefore;
    let stages: [&[Mode]; 3] = [
        &STAGE,
        &[(20.0, 0.01, 0.7)],
        &[(9.0, 0.02, 1.0), (17.0, 0.006, -0.4), (45.0, 0.01, 0.5)],
    ];
    for stage in stages {
        for kind in [OutputKind::Velocity, OutputKind::Acceleration] {
            let signals = record(stage, kind, force, 1e-3, &mut Random(5));
            let found = identified(None, force, &signals);
            let (why, name) = (&found.verdict.why, kind.name());
            assert_eq!(found.verdict.cnmp, Cnmp::Undecided, "{name} {stage:?}");
            assert!(
                why.contains(&format!("--output-kind {name}")),
                "{name} {stage:?}: {why}"
            );
            assert!(!why.contains("exchange"), "{why}");
        }
        let signals = record(stage, OutputKind::Position, force, 1e-3, &mut Random(6));
        let found = identified(None, force, &signals);
        assert!(
            !found.verdict.why.contains("--output-kind"),
            "{stage:?}: {}",
            found.verdict.why
        );
    }
}

#[test]
fn kind_that_is_not_stated_is_never_decided_wrongly_in_noise() {
    for noise in [3e-3, 1e-2, 3e-2, 1e-1, 3e-1] {
        for seed in 0..3 {
            let mut random = Random(0x51_7CC1 * (seed + 1));
            let stage = Stage::random(&mut random);
            for kind in [OutputKind::Velocity, OutputKind::Acceleration] {
                let force = Force::HeldReadBefore;
                let signals = record(&stage.modes, kind, force, noise, &mut random);
                let found = identified(None, force, &signals);
                let case = format!("{} {noise} {seed}: {:?}", kind.name(), stage.modes);
                assert!(!is_wrong(&found, &stage), "{case}: {}", found.verdict.why);
            }
        }
    }
}

#[test]
fn lag_that_is_far_shorter_than_the_hold_changes_nothing() {
    let force = Force::HeldReadAfter;
    for kind in OutputKind::ALL {
        let (input, output) = record(&STAGE, kind, force, 1e-3, &mut Random(3));
        let chain = Identification::new(RATE_HZ)
            .band_hz(BAND_HZ.0, BAND_HZ.1)
            .held_s(1.0 / RATE_HZ)
            .output_kind(kind);
        let without = chain.run(&input, &output).expect("an analysis");
        for lag_s in [1e-15, 1e-9] {
            let with = chain
                .lag_s(lag_s)
                .run(&input, &output)
                .expect("an analysis");
            assert_eq!(with.verdict.cnmp, Cnmp::Excluded, "{lag_s}");
            let [with, without] = [&with, &without].map(|found| found.fit.as_ref().expect("modes"));
            assert_eq!(with.modes(), without.modes(), "{} {lag_s}", kind.name());
        }
    }
}

#[test]
fn swapped_columns_are_named_and_no_other_kind() {
    let stages: [&[Mode]; 2] = [&STAGE, &[(20.0, 0.01, 0.7), (33.0, 0.01, 0.4)]];
    for stage in stages {
        let position = OutputKind::Position;
        let (input, output) = record(stage, position, Force::Smooth, 1e-4, &mut Random(7));
        let found = identified(None, Force::Smooth, &(output, input));
        let why = &found.verdict.why;
        assert_eq!(found.verdict.cnmp, Cnmp::Undecided, "{stage:?}");
        assert!(!why.contains("--output-kind"), "{stage:?}: {why}");
    }
}
