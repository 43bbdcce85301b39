//! The drive of the simulated stage: current loop and motor.

use bench_plant::{DiscretePlant, Mode};

/// Amplifier and motor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drive {
    /// Bandwidth of the current loop in hertz.
    pub(super) bandwidth_hz: f64,
    /// Force constant of the motor in newtons per ampere.
    pub(super) force_constant_n_per_a: f64,
}

impl Drive {
    /// Modes behind this drive, sampled with a period.
    pub(super) fn sampled(self, modes: &[Mode], period_s: f64) -> DiscretePlant {
        DiscretePlant::new(
            modes,
            self.bandwidth_hz,
            self.force_constant_n_per_a,
            period_s,
        )
    }
}
