//! The interlocks: below every controller, they see every reading first and every command last.
//!
//! A trip is latched by the arming machine, not here: these functions only say whether a reading, a tick or a command may
//! pass. A command that is not finite is a trip, not a value to clamp.

use bench_hal::{Reading, Tick, Validity};

use super::arming::Trip;
use crate::config::Config;

/// Limits and what must be remembered to check them.
#[derive(Clone, Debug)]
pub struct Interlocks {
    soft_limit_m: f64,
    peak_current_a: f64,
    continuous_current_a: f64,
    cooling: f64,
    stale_ns: u64,
    stuck_ns: u64,
    stuck_current_a: f64,
    overruns_per_s: u32,
    thermal_a2: f64,
    last_command_a: f64,
    fresh: Freshness,
    window_start_ns: u64,
    window_missed: u32,
}

/// Since when the probe says the same.
#[derive(Clone, Copy, Debug, Default)]
struct Freshness {
    sequence: Option<u64>,
    sequence_ns: u64,
    position_m: f64,
    position_ns: u64,
    lowest_a: f64,
    highest_a: f64,
}

impl Interlocks {
    /// Interlocks as configured, the motor cold.
    pub fn new(config: &Config) -> Self {
        let ns = |seconds: f64| (seconds * 1e9) as u64;
        Interlocks {
            soft_limit_m: config.interlock.soft_limit_m,
            peak_current_a: config.motor.peak_current_a(),
            continuous_current_a: config.motor.continuous_current_a(),
            cooling: config.servo.period_s() / config.motor.thermal_time_constant_s,
            stale_ns: ns(config.interlock.probe_stale_s),
            stuck_ns: ns(config.interlock.probe_stuck_s),
            stuck_current_a: config.interlock.probe_stuck_current_a,
            overruns_per_s: config.interlock.overruns_per_s,
            thermal_a2: 0.0,
            last_command_a: 0.0,
            fresh: Freshness::default(),
            window_start_ns: 0,
            window_missed: 0,
        }
    }

    /// May this reading be used? *In the tick.*
    pub fn check_reading(&mut self, reading: &Reading, now: Tick) -> Result<(), Trip> {
        let stuck = self.follow(reading, now);
        if reading.validity != Validity::Valid || !reading.position_m.is_finite() {
            return Err(Trip::ProbeInvalid);
        }
        let age_ns = reading.age_ns.max(now.scheduled_ns - self.fresh.sequence_ns);
        if age_ns > self.stale_ns {
            return Err(Trip::ProbeStale { age_s: seconds(age_ns), limit_s: seconds(self.stale_ns) });
        }
        if reading.position_m.abs() > self.soft_limit_m {
            return Err(Trip::Travel { position_m: reading.position_m, limit_m: self.soft_limit_m });
        }
        stuck
    }

    /// Remembers when sequence and position last changed, and how far the current moved since.
    fn follow(&mut self, reading: &Reading, now: Tick) -> Result<(), Trip> {
        let fresh = &mut self.fresh;
        let first = fresh.sequence.is_none();
        if fresh.sequence != Some(reading.sequence) {
            (fresh.sequence, fresh.sequence_ns) = (Some(reading.sequence), now.scheduled_ns);
        }
        if first || fresh.position_m.to_bits() != reading.position_m.to_bits() {
            (fresh.position_m, fresh.position_ns) = (reading.position_m, now.scheduled_ns);
            (fresh.lowest_a, fresh.highest_a) = (self.last_command_a, self.last_command_a);
        }
        (fresh.lowest_a, fresh.highest_a) =
            (fresh.lowest_a.min(self.last_command_a), fresh.highest_a.max(self.last_command_a));
        let unchanged_ns = now.scheduled_ns - fresh.position_ns;
        if unchanged_ns > self.stuck_ns && fresh.highest_a - fresh.lowest_a > self.stuck_current_a {
            return Err(Trip::ProbeStuck { unchanged_s: seconds(unchanged_ns), limit_s: seconds(self.stuck_ns) });
        }
        Ok(())
    }

    /// Are too many ticks missed? Counted over a second that begins with a missed tick. *In the tick.*
    pub fn check_timing(&mut self, missed: u32, now: Tick) -> Result<(), Trip> {
        if missed == 0 {
            return Ok(());
        }
        if now.scheduled_ns - self.window_start_ns > 1_000_000_000 || self.window_missed == 0 {
            (self.window_start_ns, self.window_missed) = (now.scheduled_ns, 0);
        }
        self.window_missed = self.window_missed.saturating_add(missed);
        if self.window_missed > self.overruns_per_s {
            return Err(Trip::Overruns { count: self.window_missed, limit: self.overruns_per_s });
        }
        Ok(())
    }

    /// May this command go out? Integrates the motor's heat, thermal' = (i^2 - thermal)/tau. *In the tick.*
    pub fn check_command(&mut self, command_a: f64) -> Result<(), Trip> {
        if !command_a.is_finite() {
            return Err(Trip::CommandNotFinite);
        }
        if command_a.abs() > self.peak_current_a {
            return Err(Trip::PeakCurrent { command_a, limit_a: self.peak_current_a });
        }
        let thermal_a2 = self.thermal_a2 + self.cooling * (command_a * command_a - self.thermal_a2);
        if thermal_a2 > self.continuous_current_a * self.continuous_current_a {
            return Err(Trip::ContinuousCurrent { thermal_a: thermal_a2.sqrt(), limit_a: self.continuous_current_a });
        }
        Ok(())
    }

    /// Takes note of the current that really flows from this tick on. *In the tick.*
    pub fn note(&mut self, command_a: f64) {
        self.thermal_a2 += self.cooling * (command_a * command_a - self.thermal_a2);
        self.last_command_a = command_a;
    }
}

fn seconds(ns: u64) -> f64 {
    ns as f64 * 1e-9
}
