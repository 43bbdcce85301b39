//! A simulated stage with systematic errors of amplifier and probe.
use bench_hal::{AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, Reading, Tick};
use bench_rig::simulated::SimulatedRig;
use std::task::Poll;

/// Errors of the devices: current = gain (command) + offset; reading = gain (position) + offset.
#[derive(Clone, Copy, Debug)]
pub struct Skew {
    pub current_gain: f64,
    pub current_offset_a: f64,
    pub measures_current: bool,
    pub probe_gain: f64,
    pub probe_offset_m: f64,
    /// The reading lags by this distance against the direction of motion.
    pub backlash_m: f64,
    /// Quadratic error: reading = position + quadratic position^2.
    pub quadratic_per_m: f64,
}

impl Default for Skew {
    fn default() -> Self {
        Skew {
            current_gain: 1.0,
            current_offset_a: 0.0,
            measures_current: false,
            probe_gain: 1.0,
            probe_offset_m: 0.0,
            backlash_m: 0.0,
            quadratic_per_m: 0.0,
        }
    }
}

pub struct SkewedRig {
    pub inner: SimulatedRig,
    pub skew: Skew,
    actual_a: f64,
    play_output_m: f64,
}

impl SkewedRig {
    pub fn new(inner: SimulatedRig, skew: Skew) -> Self {
        SkewedRig {
            inner,
            skew,
            actual_a: 0.0,
            play_output_m: 0.0,
        }
    }

    /// Backlash: output of the play operator with a width of twice `backlash_m`.
    fn after_play_m(&mut self, position_m: f64) -> f64 {
        self.play_output_m = self.play_output_m.clamp(
            position_m - self.skew.backlash_m,
            position_m + self.skew.backlash_m,
        );
        self.play_output_m
    }
}

impl CurrentAmplifier for SkewedRig {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        self.inner.begin_enable()
    }
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        self.inner.poll_enable()
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        self.actual_a = self.skew.current_gain * current_a + self.skew.current_offset_a;
        self.inner.command(self.actual_a).map(|_| current_a)
    }
    fn disable(&mut self) {
        self.inner.disable();
    }
    fn status(&self) -> AmplifierStatus {
        self.inner.status()
    }
    fn actual_current_a(&self) -> Option<f64> {
        self.skew.measures_current.then_some(self.actual_a)
    }
}

impl DisplacementProbe for SkewedRig {
    fn latest(&mut self, now: Tick) -> Reading {
        let reading = self.inner.latest(now);
        let after_play_m = self.after_play_m(reading.position_m);
        let curved_m = after_play_m + self.skew.quadratic_per_m * after_play_m * after_play_m;
        Reading {
            position_m: self.skew.probe_gain * curved_m + self.skew.probe_offset_m,
            ..reading
        }
    }
}
