//! The simulated probe: noise, quantisation, range, a clock of its own, and readings that arrive later.

use std::collections::VecDeque;

use bench_hal::{Reading, Validity};

use super::noise::Gaussian;
use crate::config::Config;

/// The clock of a free-running probe differs from the loop's by as much, so that readings of all ages occur, as they do
/// where two oscillators drift past each other; no simple ratio, so that they fill the period evenly.
const CLOCK_ERROR: f64 = 0.618_034e-3;

/// What lies between a position and the number that a probe makes of it: noise and quantisation.
#[derive(Clone, Debug)]
pub struct Sensor {
    noise: Gaussian,
    noise_rms_m: f64,
    quantum_m: f64,
}

impl Sensor {
    /// The sensor of a configuration.
    pub fn new(config: &Config) -> Self {
        Sensor {
            noise: Gaussian::new(config.sim.seed, 0),
            noise_rms_m: config.sim.probe_noise_rms_m,
            quantum_m: config.sim.probe_quantisation_m,
        }
    }

    /// What is measured at `position_m`, in metres.
    pub fn sense(&mut self, position_m: f64) -> f64 {
        let noisy_m = position_m + self.noise_rms_m * self.noise.next();
        if self.quantum_m > 0.0 {
            libm::round(noisy_m / self.quantum_m) * self.quantum_m
        } else {
            noisy_m
        }
    }
}

/// The probe, with what it has measured and not yet told. Times are in ticks since the start.
#[derive(Clone, Debug)]
pub(super) struct Probe {
    sensor: Sensor,
    half_range_m: f64,
    sequence: u64,
    /// From one measurement to the next.
    period: f64,
    /// From a measurement to its arrival.
    age: f64,
    /// When the next measurement is due.
    due: f64,
    /// Measured, not yet arrived, with the time of the measurement.
    coming: VecDeque<(f64, Reading)>,
    newest: (f64, Reading),
    tick_s: f64,
}

impl Probe {
    /// The probe of a configuration, which has already seen the stage at rest once.
    pub(super) fn new(config: &Config) -> Self {
        let rate_hz = config.servo.rate_hz;
        let period = config
            .probe
            .rate_hz
            .map_or(1.0, |probe_hz| rate_hz / probe_hz * (1.0 + CLOCK_ERROR));
        let age = config.probe.age_at_arrival_s() * rate_hz;
        let mut probe = Probe {
            sensor: Sensor::new(config),
            half_range_m: config.probe.range_m / 2.0,
            sequence: 0,
            period,
            age,
            due: -age,
            coming: VecDeque::with_capacity((age / period) as usize + 2),
            newest: (-age, Reading::default()),
            tick_s: config.servo.period_s(),
        };
        if !is_immediate(config) {
            probe.newest.1 = probe.measure(0.0);
            probe.due += period;
        }
        probe
    }

    /// A measurement of `position_m`, of no age.
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

    /// Measures what falls due up to `to`; `position_m` tells where the stage is at a time.
    pub(super) fn watch(&mut self, to: f64, position_m: impl Fn(f64) -> f64) {
        while self.due <= to + 1e-9 {
            let reading = self.measure(position_m(self.due));
            self.coming.push_back((self.due, reading));
            self.due += self.period;
            self.receive(to);
        }
    }

    /// Takes what has arrived by `now`.
    fn receive(&mut self, now: f64) {
        let age = self.age;
        while let Some(arrived) = self
            .coming
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

/// Whether each tick has a reading of its very moment.
pub(super) fn is_immediate(config: &Config) -> bool {
    config.probe.rate_hz.is_none() && config.probe.age_at_arrival_s() == 0.0
}
