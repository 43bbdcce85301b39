//! The simulated probe: noise, quantisation, range, its own clock, and delayed readings.

use std::collections::VecDeque;

use bench_hal::{Reading, Validity};

use super::noise::Gaussian;
use bench_config::{LoopSettings, ProbeSettings, SimSettings};

/// Relative difference between the clock of a free-running probe and that of the loop. The readings then take all ages, as with
/// two real oscillators; the ratio is irrational, so that the ages are uniformly distributed.
const CLOCK_ERROR: f64 = 0.618_034e-3;

/// Noise and quantisation of a probe.
#[derive(Clone, Debug)]
pub struct Sensor {
    noise: Gaussian,
    noise_rms_m: f64,
    quantum_m: f64,
}

impl Sensor {
    /// The configured sensor.
    pub fn new(sim: &SimSettings) -> Self {
        Sensor {
            noise: Gaussian::new(sim.seed, 0),
            noise_rms_m: sim.probe_noise_rms_m,
            quantum_m: sim.probe_quantisation_m,
        }
    }

    /// The measurement at `position_m`, in metres.
    pub fn sense(&mut self, position_m: f64) -> f64 {
        let noisy_m = position_m + self.noise_rms_m * self.noise.next();
        if self.quantum_m > 0.0 {
            libm::round(noisy_m / self.quantum_m) * self.quantum_m
        } else {
            noisy_m
        }
    }
}

/// The probe and its measurements that have not arrived yet. Times are in ticks since the start.
#[derive(Clone, Debug)]
pub(super) struct Probe {
    sensor: Sensor,
    half_range_m: f64,
    sequence: u64,
    /// Time between two measurements.
    period: f64,
    /// Time from a measurement to its arrival.
    age: f64,
    /// Time of the next measurement.
    due: f64,
    /// Measurements that have not arrived yet, with their times.
    pending: VecDeque<(f64, Reading)>,
    newest: (f64, Reading),
    tick_s: f64,
}

impl Probe {
    /// The configured probe. If the rig is not `synchronous`, its first measurement is that of the stage at rest, so that the first
    /// tick has a reading; a synchronous rig measures in each tick.
    pub(super) fn new(
        settings: &ProbeSettings,
        sim: &SimSettings,
        servo: &LoopSettings,
        synchronous: bool,
    ) -> Self {
        let rate_hz = servo.rate_hz;
        let period = settings
            .rate_hz
            .map_or(1.0, |probe_hz| rate_hz / probe_hz * (1.0 + CLOCK_ERROR));
        let age = settings.age_at_arrival_s() * rate_hz;
        let mut probe = Probe {
            sensor: Sensor::new(sim),
            half_range_m: settings.range_m / 2.0,
            sequence: 0,
            period,
            age,
            due: -age,
            pending: VecDeque::with_capacity((age / period) as usize + 2),
            newest: (-age, Reading::default()),
            tick_s: servo.period_s(),
        };
        if !synchronous {
            probe.newest.1 = probe.measure(0.0);
            probe.due += period;
        }
        probe
    }

    /// A measurement of `position_m` with age zero.
    pub(super) fn measure(&mut self, position_m: f64) -> Reading {
        let sensed_m = self.sensor.sense(position_m);
        let validity = if sensed_m.abs() <= self.half_range_m {
            Validity::Valid
        } else {
            Validity::OutOfRange
        };
        self.sequence += 1;
        let position_m = sensed_m.clamp(-self.half_range_m, self.half_range_m);
        Reading {
            position_m,
            sequence: self.sequence,
            age_ns: 0,
            validity,
        }
    }

    /// Takes all measurements that are due up to `to`; `position_m` gives the displacement at a time.
    pub(super) fn measure_until(&mut self, to: f64, position_m: impl Fn(f64) -> f64) {
        while self.due <= to + 1e-9 {
            let reading = self.measure(position_m(self.due));
            self.pending.push_back((self.due, reading));
            self.due += self.period;
            self.receive(to);
        }
    }

    /// Updates the newest reading to the measurements that have arrived by `now`.
    fn receive(&mut self, now: f64) {
        let age = self.age;
        while let Some(arrived) = self
            .pending
            .pop_front_if(|(taken, _)| *taken + age <= now + 1e-9)
        {
            self.newest = arrived;
        }
    }

    /// The newest reading that has arrived by `now`, with its age.
    pub(super) fn latest(&mut self, now: f64) -> Reading {
        self.receive(now);
        let (taken, reading) = self.newest;
        Reading {
            age_ns: ((now - taken).max(0.0) * self.tick_s * 1e9) as u64,
            ..reading
        }
    }
}

/// Whether each tick has a reading of the same time.
pub(super) fn is_immediate(probe: &ProbeSettings) -> bool {
    probe.rate_hz.is_none() && probe.age_at_arrival_s() == 0.0
}
