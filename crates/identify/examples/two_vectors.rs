//! Modes and verdict from two vectors: a force and a displacement. `cargo run -p bench-identify --example two_vectors`
//!
//! The vectors are those of two simulated modes with residues of opposite signs and a noise of 0.3 um rms (uniform over
//! 1 um). Replace them by your own.

use std::error::Error;
use std::f64::consts::TAU;

use bench_identify::Identification;
use nalgebra::Complex;

const RATE_HZ: f64 = 2000.0;
const SAMPLES: usize = 40_000;

fn main() -> Result<(), Box<dyn Error>> {
    let (force_n, position_m) = simulated();

    let identification = Identification::new(RATE_HZ)
        .held_s(1.0 / RATE_HZ)
        .band_hz(5.0, 100.0);
    let found = identification.run(&force_n, &position_m)?;

    for mode in found.fit?.modes() {
        let (frequency, residue) = (mode.frequency_hz(), mode.residue_per_kg);
        println!(
            "{:8.4} ± {:.4} Hz   damping {:.4}   residue {:+.5} ± {:.5} 1/kg",
            frequency.value,
            frequency.half_width_95(),
            mode.damping_ratio.value,
            residue.value,
            residue.half_width_95(),
        );
    }
    println!(
        "CNMP zeros {}: {}",
        found.verdict.cnmp.name(),
        found.verdict.why
    );
    Ok(())
}

/// Random steps of force between rest at the beginning and at the end, and the response of two modes.
fn simulated() -> (Vec<f64>, Vec<f64>) {
    let mut modes = [Mode::new(30.0, 0.02, 0.5), Mode::new(42.0, 0.01, -0.2)];
    let mut random = 1_u64;
    let mut uniform = || {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (random >> 40) as f64 / f64::from(1 << 24) - 0.5
    };
    let (mut force_n, mut position_m, mut force) = (Vec::new(), Vec::new(), 0.0);
    for k in 0..SAMPLES {
        if k % 10 == 0 {
            let is_excited = (SAMPLES / 20..SAMPLES * 4 / 5).contains(&k);
            force = if is_excited { uniform().signum() } else { 0.0 };
        }
        let position: f64 = modes.iter().map(Mode::position_m).sum();
        force_n.push(force);
        position_m.push(position + 1e-6 * uniform());
        modes.iter_mut().for_each(|mode| mode.step(force));
    }
    (force_n, position_m)
}

/// A mode with a force that is held between two samples: q[k + 1] = exp(p T) q[k] + (exp(p T) - 1)/p u[k], with its pole p.
struct Mode {
    pole: Complex<f64>,
    residue_per_kg: f64,
    state: Complex<f64>,
}

impl Mode {
    fn new(frequency_hz: f64, damping_ratio: f64, residue_per_kg: f64) -> Mode {
        let unit = Complex::new(-damping_ratio, (1.0 - damping_ratio.powi(2)).sqrt());
        Mode {
            pole: unit * (TAU * frequency_hz),
            residue_per_kg,
            state: Complex::new(0.0, 0.0),
        }
    }

    fn position_m(&self) -> f64 {
        self.residue_per_kg * self.state.im / self.pole.im
    }

    fn step(&mut self, force_n: f64) {
        let step = (self.pole / RATE_HZ).exp();
        self.state = step * self.state + (step - 1.0) / self.pole * force_n;
    }
}
