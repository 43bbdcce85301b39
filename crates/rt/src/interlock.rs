//! The interlocks. They check every reading before the control law receives it, and every command after the control law.
//!
//! The functions here check a reading, a tick or a command; the arming machine latches the trip. A command that is not finite
//! is a trip; it is not limited.

use std::collections::VecDeque;

use bench_hal::{Reading, Tick, Validity};

use super::arming::Trip;
use super::following_error::FollowingError;
use super::program::Decision;
use super::residual::Residuals;
use bench_base::numeric::is_within;
use bench_config::{AmplifierSettings, InterlockSettings, LoopSettings, MotorSettings};

/// The limits, and the state that their checks need.
pub struct Interlocks {
    limits: Limits,
    thermal_a2: f64,
    last_command_a: f64,
    /// The set-point that the amplifier accepted last.
    last_accepted_a: f64,
    /// The current that heats the motor since the last tick.
    heating_a: f64,
    fresh: Freshness,
    overruns: Overruns,
    following: FollowingError,
    residuals: Option<Residuals>,
}

/// The limits of the configuration.
#[derive(Clone, Copy, Debug)]
struct Limits {
    soft_limit_m: f64,
    /// Metres of the stage per metre of the probe, which the driver has applied.
    mounting_gain: f64,
    peak_current_a: f64,
    amplifier_limit_a: f64,
    accepted_error_a: f64,
    continuous_current_a: f64,
    /// Sampling period over the thermal time constant of the motor.
    cooling: f64,
    stale_ns: u64,
    stuck_ns: u64,
    stuck_current_a: f64,
    overruns_per_s: u32,
}

/// The missed ticks within the last second. Its memory is allocated once: a second has no more entries than ticks, and
/// none are needed beyond the limit.
#[derive(Clone, Debug)]
struct Overruns {
    when: VecDeque<(u64, u32)>,
    room: usize,
    count: u64,
}

/// Since when the probe has returned the same sequence number and the same position.
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
    /// Interlocks with a cold motor.
    pub fn new(
        settings: &InterlockSettings,
        amplifier: &AmplifierSettings,
        motor: &MotorSettings,
        servo: &LoopSettings,
    ) -> Self {
        let window_ns = nanoseconds(settings.current_error_s);
        Interlocks {
            limits: Limits {
                soft_limit_m: settings.soft_limit_m,
                mounting_gain: 1.0,
                peak_current_a: motor.peak_current_a(),
                amplifier_limit_a: amplifier.current_limit_a,
                accepted_error_a: settings.current_error_a,
                continuous_current_a: motor.continuous_current_a(),
                cooling: servo.period_s() / motor.thermal_time_constant_s,
                stale_ns: nanoseconds(settings.probe_stale_s),
                stuck_ns: nanoseconds(settings.probe_stuck_s),
                stuck_current_a: settings.probe_stuck_current_a,
                overruns_per_s: settings.overruns_per_s,
            },
            thermal_a2: 0.0,
            last_command_a: 0.0,
            last_accepted_a: 0.0,
            heating_a: 0.0,
            fresh: Freshness::default(),
            following: FollowingError::new(settings.current_error_a, window_ns),
            overruns: Overruns::new(settings.overruns_per_s, servo.rate_hz),
            residuals: None,
        }
    }

    /// The interlocks with a motor that is warm from earlier runs: `thermal_a2` is its thermal state in A^2.
    pub fn with_thermal_state(mut self, thermal_a2: f64) -> Self {
        self.thermal_a2 = thermal_a2;
        self
    }

    /// The interlocks of a probe whose driver multiplies its readings by `gain`: the travel is judged in the metres of the probe
    /// as well.
    pub fn with_mounting_gain(mut self, gain: f64) -> Self {
        self.limits.mounting_gain = gain;
        self
    }

    /// The interlocks with a monitor of the residuals between measured and modelled motion.
    pub fn with_residuals(mut self, residuals: Option<Residuals>) -> Self {
        self.residuals = residuals;
        self
    }

    /// Begins a run. Runs in the tick: must not allocate or block.
    pub fn begin_run(&mut self) {
        if let Some(residuals) = &mut self.residuals {
            residuals.begin();
        }
    }

    /// Checks whether the position of a tick of a run answers the current. Runs in the tick: must not allocate or block.
    pub fn check_motion(&mut self, position_m: f64, missed: u32) -> Result<(), Trip> {
        match &mut self.residuals {
            Some(residuals) => residuals.check(position_m, missed),
            None => Ok(()),
        }
    }

    /// Takes the decision of a tick of a run, its factor of the loop gain, and the current that it gave. Runs in the tick: must not allocate or block.
    pub fn record_motion(&mut self, decision: &Decision, gain: f64, applied_a: f64) {
        if let Some(residuals) = &mut self.residuals {
            residuals.record(decision, gain, applied_a);
        }
    }

    /// The thermal state of the motor in A^2: the low-pass filtered square of the current.
    pub fn thermal_a2(&self) -> f64 {
        self.thermal_a2
    }

    /// Checks a reading. Runs in the tick: must not allocate or block.
    pub fn check_reading(&mut self, reading: &Reading, now: Tick) -> Result<(), Trip> {
        self.fresh.update(reading, self.last_command_a, now);
        if reading.validity != Validity::Valid || !reading.position_m.is_finite() {
            return Err(Trip::ProbeInvalid);
        }
        self.check_age(reading, now)?;
        self.check_travel(reading.position_m)?;
        self.check_travel(self.travel_at_probe_m(reading))?;
        self.check_stuck(now)
    }

    /// Distance from the rest position in the metres of the probe, before the gain of its mounting. The driver gives
    /// position = gain * raw + offset, and the raw value at the rest position is -offset/gain.
    fn travel_at_probe_m(&self, reading: &Reading) -> f64 {
        reading.position_m / self.limits.mounting_gain
    }

    /// Checks a position against the soft limit. Runs in the tick: must not allocate or block.
    pub fn check_travel(&self, position_m: f64) -> Result<(), Trip> {
        let limit_m = self.limits.soft_limit_m;
        if !position_m.is_finite() {
            return Err(Trip::ProbeInvalid);
        }
        if is_within(position_m.abs(), limit_m) {
            Ok(())
        } else {
            Err(Trip::Travel {
                position_m,
                limit_m,
            })
        }
    }

    fn check_age(&self, reading: &Reading, now: Tick) -> Result<(), Trip> {
        let limit_ns = self.limits.stale_ns;
        let unchanged_ns = now.scheduled_ns.saturating_sub(self.fresh.sequence_ns);
        match reading.age_ns.max(unchanged_ns) {
            age_ns if age_ns > limit_ns => Err(Trip::ProbeStale {
                age_s: seconds(age_ns),
                limit_s: seconds(limit_ns),
            }),
            _ => Ok(()),
        }
    }

    fn check_stuck(&self, now: Tick) -> Result<(), Trip> {
        let Limits {
            stuck_ns,
            stuck_current_a,
            ..
        } = self.limits;
        let unchanged_ns = now.scheduled_ns.saturating_sub(self.fresh.position_ns);
        let moved_a = self.fresh.highest_a - self.fresh.lowest_a;
        if unchanged_ns > stuck_ns && moved_a > stuck_current_a {
            return Err(Trip::ProbeStuck {
                unchanged_s: seconds(unchanged_ns),
                limit_s: seconds(stuck_ns),
            });
        }
        Ok(())
    }

    /// Checks how many ticks were missed within the last second. During them the last current kept flowing. Runs in
    /// the tick: must not allocate or block.
    pub fn check_timing(&mut self, missed: u32, now: Tick) -> Result<(), Trip> {
        if missed == 0 {
            return Ok(());
        }
        self.heat(self.heating_a, f64::from(missed));
        let count = self.overruns.add(missed, now.scheduled_ns);
        let limit = self.limits.overruns_per_s;
        if count > limit {
            Err(Trip::Overruns { count, limit })
        } else {
            Ok(())
        }
    }

    /// Checks whether the current that the amplifier measures follows the commands. `None`, where it measures none or
    /// is off, resets the check. Runs in the tick: must not allocate or block.
    pub fn check_current(&mut self, actual_a: Option<f64>, now: Tick) -> Result<(), Trip> {
        match actual_a {
            Some(actual_a) => self.following.check(self.last_command_a, actual_a, now),
            None => {
                self.following.reset();
                Ok(())
            }
        }
    }

    /// Checks a command before it is sent. The thermal model of the motor is thermal' = (i^2 - thermal)/tau. Runs in
    /// the tick: must not allocate or block.
    pub fn check_command(&mut self, command_a: f64) -> Result<(), Trip> {
        if !command_a.is_finite() {
            return Err(Trip::CommandNotFinite);
        }
        if !is_within(command_a.abs(), self.limits.peak_current_a) {
            return Err(Trip::PeakCurrent {
                command_a,
                limit_a: self.limits.peak_current_a,
            });
        }
        let thermal_a2 =
            self.thermal_a2 + self.limits.cooling * (command_a * command_a - self.thermal_a2);
        let limit_a2 = self.limits.continuous_current_a * self.limits.continuous_current_a;
        if !is_within(thermal_a2, limit_a2) {
            return Err(Trip::ContinuousCurrent {
                thermal_a: thermal_a2.sqrt(),
                limit_a: self.limits.continuous_current_a,
            });
        }
        Ok(())
    }

    /// Checks the set-point that the amplifier accepted: it must lie between the previous one and the one sent, because an
    /// amplifier may limit its size and its slope. Runs in the tick: must not allocate or block.
    pub fn check_accepted(&self, set_point_a: f64, accepted_a: f64) -> Result<(), Trip> {
        let limit_a = self.limits.amplifier_limit_a;
        let expected_a = set_point_a.max(-limit_a).min(limit_a);
        let lowest_a = expected_a.min(self.last_accepted_a) - self.limits.accepted_error_a;
        let highest_a = expected_a.max(self.last_accepted_a) + self.limits.accepted_error_a;
        if (lowest_a..=highest_a).contains(&accepted_a) {
            Ok(())
        } else {
            Err(Trip::SetPointNotAccepted {
                accepted_a,
                expected_a,
            })
        }
    }

    /// Stores the current that flows from this tick on, and the set-point of the amplifier that gives it. The motor is heated by
    /// the larger of both: one of them is wrong if they differ. Runs in the tick: must not allocate or block.
    pub fn record_current(&mut self, command_a: f64, set_point_a: f64) {
        self.last_accepted_a = set_point_a;
        self.heating_a = command_a.abs().max(set_point_a.abs());
        self.heat(self.heating_a, 1.0);
        self.last_command_a = command_a;
    }

    fn heat(&mut self, current_a: f64, periods: f64) {
        self.thermal_a2 +=
            (self.limits.cooling * periods).min(1.0) * (current_a * current_a - self.thermal_a2);
    }
}

impl Freshness {
    /// Updates when sequence and position last changed, and the range of the commands since the position changed.
    fn update(&mut self, reading: &Reading, command_a: f64, now: Tick) {
        let is_first = self.sequence.is_none();
        if self.sequence != Some(reading.sequence) {
            (self.sequence, self.sequence_ns) = (Some(reading.sequence), now.scheduled_ns);
        }
        if is_first || self.position_m.to_bits() != reading.position_m.to_bits() {
            (self.position_m, self.position_ns) = (reading.position_m, now.scheduled_ns);
            (self.lowest_a, self.highest_a) = (command_a, command_a);
        }
        self.lowest_a = self.lowest_a.min(command_a);
        self.highest_a = self.highest_a.max(command_a);
    }
}

impl Overruns {
    fn new(limit: u32, rate_hz: f64) -> Self {
        let room = (f64::from(limit).min(rate_hz) as usize).saturating_add(2);
        Overruns {
            when: VecDeque::with_capacity(room),
            room,
            count: 0,
        }
    }

    /// The number missed within the second before `now_ns`, those of this tick included.
    fn add(&mut self, missed: u32, now_ns: u64) -> u32 {
        while self.when.len() == self.room
            || self
                .when
                .front()
                .is_some_and(|(ns, _)| is_past(*ns, now_ns))
        {
            let (_, gone) = self.when.pop_front().unwrap_or_default();
            self.count -= u64::from(gone);
        }
        self.when.push_back((now_ns, missed));
        self.count += u64::from(missed);
        u32::try_from(self.count).unwrap_or(u32::MAX)
    }
}

fn is_past(ns: u64, now_ns: u64) -> bool {
    now_ns.saturating_sub(ns) > 1_000_000_000
}

fn nanoseconds(seconds: f64) -> u64 {
    (seconds * 1e9) as u64
}

fn seconds(ns: u64) -> f64 {
    ns as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_missed_exactly_one_second_ago_still_counts() {
        assert!(!is_past(5, 1_000_000_005));
        assert!(is_past(5, 1_000_000_006));
    }
}
