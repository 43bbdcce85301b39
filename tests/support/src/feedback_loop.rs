//! A closed loop of a resonance and a PI controller, simulated independently of the library: y = P u + v, u = C (r - y).

use bench_identify::Signals;
use bench_identify::joint::LoopSignals;
use nalgebra::Complex;

use crate::stage::Dice;

pub const RATE_HZ: f64 = 1000.0;
pub const BAND_HZ: (f64, f64) = (2.0, 300.0);
/// A resonance at 20 Hz with 2 % of damping, of static gain 1 after one tick: `y[k] = a1 y[k-1] + a2 y[k-2] + b u[k-1]`.
pub const POLE: (f64, f64) = (20.0, 0.02);
/// u = KP e + KI T sum e
const KP: f64 = 0.05;
const KI: f64 = 3.0;

fn coefficients() -> (f64, f64, f64) {
    let (w, zeta) = (std::f64::consts::TAU * POLE.0 / RATE_HZ, POLE.1);
    let a1 = 2.0 * (-zeta * w).exp() * (w * (1.0 - zeta * zeta).sqrt()).cos();
    let a2 = -(-2.0 * zeta * w).exp();
    (a1, a2, 1.0 - a1 - a2)
}

/// P at a frequency: b z^-1/(1 - a1 z^-1 - a2 z^-2).
pub fn plant(frequency_hz: f64) -> Complex<f64> {
    let (a1, a2, b) = coefficients();
    let back = Complex::from_polar(1.0, -std::f64::consts::TAU * frequency_hz / RATE_HZ);
    back * b / (Complex::new(1.0, 0.0) - back * a1 - back * back * a2)
}

/// L = P C, C = KP + KI T/(1 - z^-1).
pub fn loop_gain(frequency_hz: f64) -> Complex<f64> {
    let back = Complex::from_polar(1.0, -std::f64::consts::TAU * frequency_hz / RATE_HZ);
    plant(frequency_hz) * (Complex::new(KI / RATE_HZ, 0.0) / (Complex::new(1.0, 0.0) - back) + KP)
}

/// A run of 20 s whose reference is a chirp from 1 to 400 Hz, with white noise on the position.
pub fn run(noise: f64, seed: u64) -> LoopSignals {
    let (a1, a2, b) = coefficients();
    let mut dice = Dice::new(seed);
    let (mut y, mut u, mut sum): ([f64; 2], f64, f64) = ([0.0; 2], 0.0, 0.0);
    let (mut reference_m, mut input_a, mut output_m) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..20_000 {
        let r = swept(k as f64 / RATE_HZ);
        let now = a1 * y[0] + a2 * y[1] + b * u;
        y = [now, y[0]];
        let measured = now + noise * dice.normal();
        sum += r - measured;
        u = KP * (r - measured) + KI / RATE_HZ * sum;
        reference_m.push(r);
        input_a.push(u);
        output_m.push(measured);
    }
    LoopSignals {
        signals: Signals {
            rate_hz: RATE_HZ,
            input: input_a,
            output: output_m,
        },
        reference_m,
    }
}

fn swept(t: f64) -> f64 {
    let (from_hz, to_hz, length_s, begin_s) = (1.0_f64, 400.0, 16.0, 0.5);
    let time = t - begin_s;
    if !(0.0..length_s).contains(&time) {
        return 0.0;
    }
    let growth = (to_hz / from_hz).ln() / length_s;
    let fade = |x: f64| {
        if x < 1.0 {
            0.5 - 0.5 * (std::f64::consts::PI * x).cos()
        } else {
            1.0
        }
    };
    let phase = std::f64::consts::TAU * from_hz / growth * (growth * time).exp_m1();
    fade(time / 0.5) * fade((length_s - time) / 0.2) * phase.sin()
}
