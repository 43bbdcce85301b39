//! Reference plant: the stage at 8 % of L with 10 % of asymmetry, sampled at 5 kHz, with its chirp and its noise.
//! Independent of the library.

use std::f64::consts::PI;
use std::sync::LazyLock;

use bench_identify::Signals;
use nalgebra::Complex;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;

pub const RATE_HZ: f64 = 5000.0;
/// Newtons per ampere.
const FORCE_CONSTANT: f64 = 11.12;
/// Rad/s: the 1 kHz current loop.
const AMPLIFIER_RAD_S: f64 = 2.0 * PI * 1000.0;

/// omega in rad/s, residue in 1/kg, damping ratio, as `tests/python/stage.py` computes them from masses and beams. The
/// last six are the unmodelled modes of the built stage, with residues that make them visible.
pub const MODES: [(f64, f64, f64); 10] = [
    (
        143.689_269_182_618_15,
        -2.903_524_423_034_201_5e-6,
        0.011_055_663_158_347_56,
    ),
    (
        183.936_395_146_788_84,
        4.715_225_052_258_582e-1,
        0.008_777_627_626_056_26,
    ),
    (
        516.656_502_781_449_1,
        -3.194_385_121_407_502_4e-2,
        0.004_012_685_609_485_7,
    ),
    (
        538.998_917_721_225_9,
        2.085_064_331_994_430_2e-2,
        0.003_932_453_521_067_82,
    ),
    (1_477.176_865_717_920_7, 0.018, 0.005),
    (1_494.141_466_047_305_6, -0.025, 0.005),
    (1_714.052_951_798_591_3, 0.041, 0.005),
    (1_768.088_345_433_54, -0.017, 0.005),
    (1_771.858_256_624_643_2, 0.035, 0.005),
    (1_781.911_353_116_130_8, -0.04, 0.005),
];

/// Force constant, current loop (first order) and modes, held over each tick, and one tick of delay.
///
/// `G(s) = sum c/(s - p)` in partial fractions; under a zero-order hold each becomes `g/(z - l)` with l = exp(p T) and
/// g = c (l - 1)/p, exactly.
pub struct SampledPlant {
    /// (l, g); of each complex pair both.
    terms: Vec<(Complex<f64>, Complex<f64>)>,
}

impl SampledPlant {
    pub fn stage() -> Self {
        Self::new(&MODES)
    }

    pub fn new(modes: &[(f64, f64, f64)]) -> Self {
        let mut terms = vec![Self::term(
            Complex::from(-AMPLIFIER_RAD_S),
            Self::amplifier_residue(modes),
        )];
        for &(omega, residue, damping) in modes {
            let pole = Complex::new(-damping * omega, omega * (1.0 - damping * damping).sqrt());
            let c = FORCE_CONSTANT * AMPLIFIER_RAD_S * residue
                / (pole + AMPLIFIER_RAD_S)
                / (pole - pole.conj());
            terms.extend([Self::term(pole, c), Self::term(pole.conj(), c.conj())]);
        }
        Self { terms }
    }

    fn amplifier_residue(modes: &[(f64, f64, f64)]) -> Complex<f64> {
        let s = -AMPLIFIER_RAD_S;
        let at_pole = |&(omega, residue, damping): &(f64, f64, f64)| {
            residue / (s * s + 2.0 * damping * omega * s + omega * omega)
        };
        Complex::from(FORCE_CONSTANT * AMPLIFIER_RAD_S * modes.iter().map(at_pole).sum::<f64>())
    }

    fn term(pole: Complex<f64>, c: Complex<f64>) -> (Complex<f64>, Complex<f64>) {
        let step = (pole / RATE_HZ).exp();
        (step, c * (step - 1.0) / pole)
    }

    /// The analytic response in m/A at a frequency.
    pub fn response(&self, frequency_hz: f64) -> Complex<f64> {
        let z = Complex::from_polar(1.0, 2.0 * PI * frequency_hz / RATE_HZ);
        self.terms
            .iter()
            .map(|(step, gain)| gain / (z - step))
            .sum::<Complex<f64>>()
            / z
    }

    /// The output in metres, tick by tick, from rest.
    pub fn simulate(&self, input_a: &[f64]) -> Vec<f64> {
        let mut states = vec![Complex::from(0.0); self.terms.len()];
        let mut last = 0.0;
        let mut output = Vec::with_capacity(input_a.len());
        for &input in input_a {
            output.push(states.iter().map(|state| state.re).sum());
            for (state, (step, gain)) in states.iter_mut().zip(&self.terms) {
                *state = *state * step + gain * last;
            }
            last = input;
        }
        output
    }
}

/// The excitation of an identification run: a logarithmic chirp from 0.1 to 500 Hz within 110 s, 2 s of quiet before
/// and 8 s after; faded in over 5 s, out over 1 s; its amplitude follows the plant (log-log between the points).
pub fn chirp() -> Vec<f64> {
    chirp_of(110.0, 2.0, 8.0)
}

/// The same chirp with other durations.
pub fn chirp_of(duration_s: f64, before_s: f64, after_s: f64) -> Vec<f64> {
    const AMPLITUDES: [(f64, f64); 7] = [
        (0.1, 0.4),
        (8.0, 0.4),
        (20.0, 0.1),
        (45.0, 0.1),
        (70.0, 1.0),
        (150.0, 3.0),
        (500.0, 3.0),
    ];
    let (from_hz, to_hz) = (0.1, 500.0);
    let growth = f64::ln(to_hz / from_hz) / duration_s;
    let ticks = ((duration_s + before_s + after_s) * RATE_HZ).round() as usize;
    let sample = |k: usize| {
        let t = k as f64 / RATE_HZ - before_s;
        if !(0.0..duration_s).contains(&t) {
            return 0.0;
        }
        let frequency_hz = from_hz * (growth * t).exp();
        let phase = 2.0 * PI * from_hz / growth * (growth * t).exp_m1();
        let fade = faded(t / 5.0_f64.min(duration_s / 10.0))
            * faded((duration_s - t) / 1.0_f64.min(duration_s / 10.0));
        interpolated(&AMPLITUDES, frequency_hz) * fade * phase.sin()
    };
    (0..ticks).map(sample).collect()
}

fn faded(x: f64) -> f64 {
    if x < 1.0 {
        0.5 - 0.5 * (PI * x).cos()
    } else {
        1.0
    }
}

fn interpolated(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points
        .iter()
        .position(|p| p.0 >= x)
        .unwrap_or(points.len() - 1)
        .max(1);
    let ((x0, y0), (x1, y1)) = (points[after - 1], points[after]);
    y0 * (y1 / y0).powf((x / x0).ln() / (x1 / x0).ln())
}

/// A run without any noise, simulated once in each test binary.
pub fn clean_run() -> Signals {
    static RUN: LazyLock<Signals> = LazyLock::new(|| {
        let input_a = chirp();
        let output_m = SampledPlant::stage().simulate(&input_a);
        Signals {
            rate_hz: RATE_HZ,
            input: input_a,
            output: output_m,
        }
    });
    RUN.clone()
}

/// The noise of the built stage: probe noise of 40 nm RMS, quantisation of 30 nm, and floor vibration of 20 nm RMS around 5 Hz
/// and 15 nm RMS around 70 Hz.
pub fn with_noise(signals: &Signals, seed: u64) -> Signals {
    let mut dice = Dice::new(seed);
    let slow = floor(&mut dice, signals.len(), 5.0, 0.1, 20e-9);
    let fast = floor(&mut dice, signals.len(), 70.0, 0.02, 15e-9);
    let step = 30e-9;
    let noisy = |(k, y): (usize, &f64)| {
        ((y + slow[k] + fast[k] + 40e-9 * dice.normal()) / step).round() * step
    };
    let output_m = signals.output.iter().enumerate().map(noisy).collect();
    Signals {
        output: output_m,
        ..signals.clone()
    }
}

/// Narrowband noise: a resonance driven by white noise, stationary from the start.
fn floor(dice: &mut Dice, ticks: usize, frequency_hz: f64, damping: f64, rms: f64) -> Vec<f64> {
    let omega = 2.0 * PI * frequency_hz / RATE_HZ;
    let step = (Complex::new(-damping, (1.0 - damping * damping).sqrt()) * omega).exp();
    let drive = rms * (1.0 - step.norm_sqr()).sqrt();
    let mut state = Complex::new(dice.normal(), dice.normal()) * rms;
    let mut next = || {
        state = state * step + Complex::new(dice.normal(), dice.normal()) * drive;
        state.re
    };
    (0..ticks).map(|_| next()).collect()
}

/// Seeded normal deviates.
pub struct Dice(Pcg64);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed))
    }

    /// Uniform in (0, 1].
    pub fn uniform(&mut self) -> f64 {
        ((self.0.next_u64() >> 11) + 1) as f64 / (1_u64 << 53) as f64
    }

    /// Mean 0, variance 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (2.0 * PI * self.uniform()).cos()
    }
}
