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
        /// Meaning and remedy, if the driver knows them. A recording stores them as text.
        text: Option<FaultText>,
    },
}

impl From<DeviceError> for Trip {
    fn from(error: DeviceError) -> Trip {
        let DeviceError { what, remedy, code } = error;
        Trip::Amplifier {
            code,
            text: Some(FaultText { what, remedy }),
        }
    }
}

/// Name and remedy of a kind of trip.
struct Kind {
    /// The short reason used in JSON and recordings.
    reason: &'static str,
    /// What the operator can do.
    remedy: &'static str,
}

const TRAVEL: Kind = Kind {
    reason: "travel",
    remedy: "check the loop's margins and the amplitude; the limit is interlock.soft_limit_m",
};
const PEAK_CURRENT: Kind = Kind {
    reason: "peak_current",
    remedy: "check the loop's margins; the limit is motor.peak_force_n over the force constant",
};
const CONTINUOUS_CURRENT: Kind = Kind {
    reason: "continuous_current",
    remedy: "let the motor cool, lower amplitude or duration",
};
const COMMAND_NOT_FINITE: Kind = Kind {
    reason: "command_not_finite",
    remedy: "check the controller and its reference",
};
const PROBE_INVALID: Kind = Kind {
    reason: "probe_invalid",
    remedy: "check the probe's cable, target and range",
};
const PROBE_STALE: Kind = Kind {
    reason: "probe_stale",
    remedy: "check the probe's rate and connection; the limit is interlock.probe_stale_s",
};
const PROBE_STUCK: Kind = Kind {
    reason: "probe_stuck",
    remedy: "check the probe and the motor's connection; the limit is interlock.probe_stuck_s",
};
const CURRENT_NOT_FOLLOWED: Kind = Kind {
    reason: "current_not_followed",
    remedy: "check that the drive takes set-points (its mode, another master on the bus); \
             the limits are interlock.current_error_a and current_error_s",
};
const OVERRUNS: Kind = Kind {
    reason: "overruns",
    remedy: "lower loop.rate_hz, give the loop real-time scheduling, or raise interlock.overruns_per_s",
};
const AMPLIFIER: Kind = Kind {
    reason: "amplifier",
    remedy: "look up the code in the amplifier's manual, clear its fault, start again",
};

impl Trip {
    fn kind(&self) -> Kind {
        match self {
            Trip::Travel { .. } => TRAVEL,
            Trip::PeakCurrent { .. } => PEAK_CURRENT,
            Trip::ContinuousCurrent { .. } => CONTINUOUS_CURRENT,
            Trip::CommandNotFinite => COMMAND_NOT_FINITE,
            Trip::ProbeInvalid => PROBE_INVALID,
            Trip::ProbeStale { .. } => PROBE_STALE,
            Trip::ProbeStuck { .. } => PROBE_STUCK,
            Trip::CurrentNotFollowed { .. } => CURRENT_NOT_FOLLOWED,
            Trip::Overruns { .. } => OVERRUNS,
            Trip::Amplifier { .. } => AMPLIFIER,
        }
    }

    /// The short reason used in JSON and recordings.
    pub fn reason(&self) -> &'static str {
        self.kind().reason
    }

    /// What the operator can do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            Trip::Amplifier {
                text: Some(text), ..
            } => text.remedy,
            _ => self.kind().remedy,
        }
    }

    /// The value that crossed the limit, and the limit, where there are such.
    pub fn value_and_limit(&self) -> Option<(f64, f64)> {
        use Trip::*;
        match *self {
            Travel {
                position_m: value,
                limit_m: limit,
            }
            | PeakCurrent {
                command_a: value,
                limit_a: limit,
            }
            | ContinuousCurrent {
                thermal_a: value,
                limit_a: limit,
            }
            | ProbeStale {
                age_s: value,
                limit_s: limit,
            }
            | ProbeStuck {
                unchanged_s: value,
                limit_s: limit,
            }
            | CurrentNotFollowed {
                actual_a: value,
                command_a: limit,
            } => Some((value, limit)),
            Overruns { count, limit } => Some((f64::from(count), f64::from(limit))),
            CommandNotFinite | ProbeInvalid | Amplifier { .. } => None,
        }
    }

    fn fmt_reading(&self, f: &mut fmt::Formatter<'_>, value: f64, limit: f64) -> fmt::Result {
        let (value_ms, limit_ms) = (value * 1e3, limit * 1e3);
        let (value_um, limit_um) = (value * 1e6, limit * 1e6);
        match self {
            Trip::Travel { .. } => write!(
                f,
                "travel: {value_um:.1} um is beyond the soft limit of {limit_um:.1} um"
            ),
            Trip::ProbeStale { .. } => write!(
                f,
                "the probe's reading is {value_ms:.3} ms old, {limit_ms:.3} ms are allowed"
            ),
            Trip::ProbeStuck { .. } => write!(
                f,
                "the probe's reading did not move for {value_ms:.1} ms ({limit_ms:.1} ms are allowed) while the current did"
            ),
            _ => f.write_str("the probe's reading was not valid"),
        }
    }

    fn fmt_current(&self, f: &mut fmt::Formatter<'_>, value_a: f64, limit_a: f64) -> fmt::Result {
        match self {
            Trip::PeakCurrent { .. } => write!(
                f,
                "peak current: a command of {value_a:.3} A is beyond {limit_a:.3} A"
            ),
            Trip::ContinuousCurrent { .. } => write!(
                f,
                "continuous current: the motor's thermal current {value_a:.3} A is beyond {limit_a:.3} A"
            ),
            Trip::CurrentNotFollowed { .. } => write!(
                f,
                "the amplifier measures {value_a:.3} A; the nearest commanded current is {limit_a:.3} A"
            ),
            _ => f.write_str("the command was not a finite number"),
        }
    }
}

impl fmt::Display for Trip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use Trip::*;
        let (value, limit) = self.value_and_limit().unwrap_or_default();
        match self {
            Travel { .. } | ProbeInvalid | ProbeStale { .. } | ProbeStuck { .. } => {
                self.fmt_reading(f, value, limit)
            }
            PeakCurrent { .. } | ContinuousCurrent { .. } => self.fmt_current(f, value, limit),
            CommandNotFinite | CurrentNotFollowed { .. } => self.fmt_current(f, value, limit),
            Overruns { .. } => write!(
                f,
                "{value} ticks missed within a second, {limit} are allowed"
            ),
            Amplifier { code, text } => fmt_fault(f, *code, *text),
        }
    }
}

fn fmt_fault(f: &mut fmt::Formatter<'_>, code: i64, text: Option<FaultText>) -> fmt::Result {
    match text {
        Some(text) => write!(f, "amplifier: {} (code {code})", text.what),
        None => write!(
            f,
            "the amplifier reported a fault or refused a command (code {code})"
        ),
    }
}
