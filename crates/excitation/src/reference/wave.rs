//! A wave that repeats its shape: r = A shape(x) with x = f t modulo 1.

use super::design::{check_amplitude, check_frequency};
use crate::waveform::Reference;
use bench_base::finding::Finding;

/// A wave that begins at tick 0.
pub(super) struct Wave {
    amplitude_m: f64,
    cycles_per_tick: f64,
    shape: fn(f64) -> f64,
}

impl Wave {
    /// A wave with a shape over one cycle, 0 to 1.
    pub fn new(amplitude_m: f64, frequency_hz: f64, period_s: f64, shape: fn(f64) -> f64) -> Wave {
        Wave {
            amplitude_m,
            cycles_per_tick: frequency_hz * period_s,
            shape,
        }
    }
}

impl Reference for Wave {
    fn at_m(&self, tick: u64) -> f64 {
        let cycles = tick as f64 * self.cycles_per_tick;
        self.amplitude_m * (self.shape)(cycles - libm::floor(cycles))
    }
}

/// What is wrong with amplitude and frequency of a wave.
pub(super) fn check_wave(
    amplitude_m: f64,
    frequency_hz: f64,
    soft_limit_m: f64,
    rate_hz: f64,
) -> Vec<Finding> {
    let mut findings = check_amplitude(amplitude_m, soft_limit_m);
    findings.extend(check_frequency(frequency_hz, rate_hz));
    findings
}
