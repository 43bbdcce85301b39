//! Signals in closed form: the response of a sum of modes to a multisine, with drift and noise.
use std::f64::consts::TAU;

use bench_identify::Signals;
use nalgebra::Complex;

/// Samples per period, and per second.
pub const PERIOD: usize = 1000;

/// Modes: hertz, damping ratio, residue.
pub const STAGE: [(f64, f64, f64); 2] = [(40.0, 0.02, 1.0), (90.0, 0.02, 0.6)];

/// Approximately normal numbers of mean 0 and variance 1: sums of twelve uniform numbers.
pub fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x1234_5678_9ABC_DEF1;
    let mut uniform = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

pub fn response(hz: f64) -> Complex<f64> {
    let s = Complex::new(0.0, TAU * hz);
    let part = |(f, zeta, r): (f64, f64, f64)| {
        (s * s + s * (2.0 * zeta * TAU * f) + (TAU * f).powi(2)).inv() * r
    };
    STAGE.into_iter().map(part).sum()
}

/// `periods` periods of a multisine with `lines` in Hz (Schroeder phases) at 1 kHz and the steady-state response of the stage, with a
/// drift of `drift` per period and white noise of `sigma`.
pub fn multisine(lines: &[usize], periods: usize, drift: f64, sigma: f64, seed: u64) -> Signals {
    let mut normal = normal(seed);
    let tone = |j: usize, f: usize| {
        Complex::from_polar(
            1.0,
            -std::f64::consts::PI * (j * j) as f64 / lines.len() as f64 + 0.3 * f as f64,
        )
    };
    let one = |of: &dyn Fn(usize) -> Complex<f64>| -> Vec<f64> {
        let at = |n: usize| {
            let turn = |f: usize| {
                Complex::from_polar(1.0, TAU * ((n * f) % PERIOD) as f64 / PERIOD as f64)
            };
            lines
                .iter()
                .enumerate()
                .map(|(j, f)| (of(*f) * tone(j, *f) * turn(*f)).re)
                .sum()
        };
        (0..PERIOD).map(at).collect()
    };
    let (input, output) = (
        one(&|_| Complex::new(1.0, 0.0)),
        one(&|f| response(f as f64)),
    );
    let samples = 0..periods * PERIOD;
    Signals {
        rate_hz: PERIOD as f64,
        input: samples.clone().map(|n| input[n % PERIOD]).collect(),
        output: samples
            .map(|n| output[n % PERIOD] + drift * n as f64 / PERIOD as f64 + sigma * normal())
            .collect(),
    }
}

/// The signals as a table `time_s,force_n,position_m`.
pub fn csv(signals: &Signals) -> String {
    let row = |(n, (u, y)): (usize, (&f64, &f64))| {
        format!("{},{u:e},{y:e}\n", n as f64 / signals.rate_hz)
    };
    let rows: String = signals
        .input
        .iter()
        .zip(&signals.output)
        .enumerate()
        .map(row)
        .collect();
    format!("time_s,force_n,position_m\n{rows}")
}
