//! The reasons for which the interlocks switch everything off.

use std::fmt;

use bench_hal::{DeviceError, FaultText};

/// Why the interlocks tripped, with the value that crossed its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trip {
    /// |position| beyond the soft limit, both in metres.
    Travel {
        /// The measured position.
        position_m: f64,
        /// The soft limit.
        limit_m: f64,
    },
    /// |command| beyond the peak current.
    PeakCurrent {
        /// The command.
        command_a: f64,
        /// The limit.
        limit_a: f64,
    },
    /// The motor's thermal current (square root of the filtered square) beyond its continuous rating.
    ContinuousCurrent {
        /// The thermal current.
        thermal_a: f64,
        /// The limit.
        limit_a: f64,
    },
    /// The command was NaN or infinite.
    CommandNotFinite,
    /// The probe reported an invalid reading.
    ProbeInvalid,
    /// The reading is older than allowed.
    ProbeStale {
        /// Its age.
        age_s: f64,
        /// The limit.
        limit_s: f64,
    },
    /// The reading did not move while the current did.
    ProbeStuck {
        /// How long.
        unchanged_s: f64,
        /// The limit.
        limit_s: f64,
    },
    /// The measured current does not follow the commands.
    CurrentNotFollowed {
        /// The measured current.
        actual_a: f64,
        /// The nearest commanded current.
        command_a: f64,
    },
    /// Too many ticks missed within one second.
    Overruns {
        /// How many.
        count: u32,
        /// The limit.
        limit: u32,
    },
    /// The amplifier reported a fault or refused a command; the code is the device's own.
    Amplifier {
        /// The device's number.
        code: i64,
        /// Its explanation and remedy by the driver, if known. A recording carries it as text.
        words: Option<FaultText>,
    },
}

impl From<DeviceError> for Trip {
    fn from(error: DeviceError) -> Trip {
        let DeviceError { what, remedy, code } = error;
        Trip::Amplifier {
            code,
            words: Some(FaultText { what, remedy }),
        }
    }
}

impl Trip {
    /// The short reason used in JSON and recordings.
    pub fn reason(&self) -> &'static str {
        match self {
            Trip::Travel { .. } => "travel",
            Trip::PeakCurrent { .. } => "peak_current",
            Trip::ContinuousCurrent { .. } => "continuous_current",
            Trip::CommandNotFinite => "command_not_finite",
            Trip::ProbeInvalid => "probe_invalid",
            Trip::ProbeStale { .. } => "probe_stale",
            Trip::ProbeStuck { .. } => "probe_stuck",
            Trip::CurrentNotFollowed { .. } => "current_not_followed",
            Trip::Overruns { .. } => "overruns",
            Trip::Amplifier { .. } => "amplifier",
        }
    }

    /// What the operator can do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            Trip::Travel { .. } => {
                "check the loop's margins and the amplitude; the limit is interlock.soft_limit_m"
            }
            Trip::PeakCurrent { .. } => {
                "check the loop's margins; the limit is motor.peak_force_n over the force constant"
            }
            Trip::ContinuousCurrent { .. } => "let the motor cool, lower amplitude or duration",
            Trip::CommandNotFinite => "check the controller and its reference",
            Trip::ProbeInvalid => "check the probe's cable, target and range",
            Trip::ProbeStale { .. } => {
                "check the probe's rate and connection; the limit is interlock.probe_stale_s"
            }
            Trip::ProbeStuck { .. } => {
                "check the probe and the motor's connection; the limit is interlock.probe_stuck_s"
            }
            Trip::CurrentNotFollowed { .. } => {
                "check that the drive takes set-points (its mode, another master on the bus); the limits are interlock.current_error_a and current_error_s"
            }
            Trip::Overruns { .. } => {
                "lower loop.rate_hz, give the loop real-time scheduling, or raise interlock.overruns_per_s"
            }
            Trip::Amplifier {
                words: Some(words), ..
            } => words.remedy,
            Trip::Amplifier { .. } => {
                "look up the code in the amplifier's manual, clear its fault, start again"
            }
        }
    }

    /// The value that crossed the limit, and the limit, where there are such.
    pub fn value_and_limit(&self) -> Option<(f64, f64)> {
        match *self {
            Trip::Travel {
                position_m,
                limit_m,
            } => Some((position_m, limit_m)),
            Trip::PeakCurrent { command_a, limit_a } => Some((command_a, limit_a)),
            Trip::ContinuousCurrent { thermal_a, limit_a } => Some((thermal_a, limit_a)),
            Trip::ProbeStale { age_s, limit_s } => Some((age_s, limit_s)),
            Trip::ProbeStuck {
                unchanged_s,
                limit_s,
            } => Some((unchanged_s, limit_s)),
            Trip::CurrentNotFollowed {
                actual_a,
                command_a,
            } => Some((actual_a, command_a)),
            Trip::Overruns { count, limit } => Some((f64::from(count), f64::from(limit))),
            Trip::CommandNotFinite | Trip::ProbeInvalid | Trip::Amplifier { .. } => None,
        }
    }
}

impl fmt::Display for Trip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Trip::Travel {
                position_m,
                limit_m,
            } => {
                let (position_um, limit_um) = (position_m * 1e6, limit_m * 1e6);
                write!(
                    f,
                    "travel: {position_um:.1} um is beyond the soft limit of {limit_um:.1} um"
                )
            }
            Trip::PeakCurrent { command_a, limit_a } => {
                write!(
                    f,
                    "peak current: a command of {command_a:.3} A is beyond {limit_a:.3} A"
                )
            }
            Trip::ContinuousCurrent { thermal_a, limit_a } => write!(
                f,
                "continuous current: the motor's thermal current {thermal_a:.3} A is beyond {limit_a:.3} A"
            ),
            Trip::CommandNotFinite => write!(f, "the command was not a finite number"),
            Trip::Overruns { count, limit } => {
                write!(
                    f,
                    "{count} ticks missed within a second, {limit} are allowed"
                )
            }
            Trip::CurrentNotFollowed {
                actual_a,
                command_a,
            } => write!(
                f,
                "the amplifier measures {actual_a:.3} A; the nearest commanded current is {command_a:.3} A"
            ),
            Trip::ProbeInvalid | Trip::ProbeStale { .. } | Trip::ProbeStuck { .. } => {
                self.fmt_probe(f)
            }
            Trip::Amplifier {
                code,
                words: Some(words),
            } => {
                write!(f, "amplifier: {} (code {code})", words.what)
            }
            Trip::Amplifier { code, words: None } => {
                write!(
                    f,
                    "the amplifier reported a fault or refused a command (code {code})"
                )
            }
        }
    }
}

impl Trip {
    fn fmt_probe(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let milliseconds = self
            .value_and_limit()
            .map(|(value_s, limit_s)| (value_s * 1e3, limit_s * 1e3));
        match (self, milliseconds) {
            (Trip::ProbeStale { .. }, Some((age_ms, limit_ms))) => {
                write!(
                    f,
                    "the probe's reading is {age_ms:.3} ms old, {limit_ms:.3} ms are allowed"
                )
            }
            (Trip::ProbeStuck { .. }, Some((unchanged_ms, limit_ms))) => write!(
                f,
                "the probe's reading did not move for {unchanged_ms:.1} ms ({limit_ms:.1} ms are allowed) while the current did"
            ),
            _ => write!(f, "the probe's reading was not valid"),
        }
    }
}
