//! The reasons for which the interlocks switch everything off.

use std::fmt;

use bench_hal::{DeviceError, FaultText};
use serde::{Deserialize, Serialize};

/// Why the interlocks tripped, with the value that crossed its limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
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
    /// The amplifier accepted a set-point that is not between the previous one and the one sent.
    SetPointNotAccepted {
        /// The accepted set-point.
        accepted_a: f64,
        /// The set-point sent, limited to the current limit of the amplifier.
        expected_a: f64,
    },
    /// The measured current does not follow the commands.
    CurrentNotFollowed {
        /// The measured current.
        actual_a: f64,
        /// The nearest commanded current.
        command_a: f64,
    },
    /// The measured position does not answer the current as the model does, all in metres from the rest position.
    ModelError {
        /// The low-pass filtered difference between the position and the modelled one. The position is the measured one, or in
        /// closed loop also the one that the applied current gives by the model of the plant.
        error_m: f64,
        /// The modelled position.
        modelled_m: f64,
        /// The limit of the difference.
        limit_m: f64,
    },
    /// Too many ticks missed within one second.
    Overruns {
        /// How many.
        count: u32,
        /// The limit.
        limit: u32,
    },
    /// The amplifier reported itself disabled during a run.
    AmplifierDisabled,
    /// The amplifier reported a fault or refused a command; the code is the device's own.
    Amplifier {
        /// The device's number.
        code: i64,
        /// Meaning and remedy, if the driver knows them. A recording stores them as text.
        #[serde(with = "fault_text")]
        text: Option<FaultText>,
    },
}

/// Transfer of a [`FaultText`] to another process.
mod fault_text {
    use bench_hal::FaultText;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(
        text: &Option<FaultText>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        text.map(|text| (text.what, text.remedy))
            .serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<FaultText>, D::Error> {
        let text = Option::<(String, String)>::deserialize(deserializer)?;
        // The texts of drivers are static. A process receives a trip at the end of a run, and ends soon after it.
        Ok(text.map(|(what, remedy)| FaultText {
            what: what.leak(),
            remedy: remedy.leak(),
        }))
    }
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

impl Trip {
    /// Short reason and remedy.
    fn reason_and_remedy(&self) -> (&'static str, &'static str) {
        match self {
            Trip::Travel { .. } => (
                "travel",
                "check the loop's margins and the amplitude; the limit is interlock.soft_limit_m",
            ),
            Trip::PeakCurrent { .. } => (
                "peak_current",
                "check the loop's margins; the limit is motor.peak_force_n over the force constant",
            ),
            Trip::ContinuousCurrent { .. } => (
                "continuous_current",
                "let the motor cool, lower amplitude or duration",
            ),
            Trip::CommandNotFinite => (
                "command_not_finite",
                "check the controller and its reference",
            ),
            Trip::ProbeInvalid => ("probe_invalid", "check the probe's cable, target and range"),
            Trip::ProbeStale { .. } => (
                "probe_stale",
                "check the probe's rate and connection; the limit is interlock.probe_stale_s",
            ),
            Trip::ProbeStuck { .. } => (
                "probe_stuck",
                "check the probe and the motor's connection; the limit is interlock.probe_stuck_s",
            ),
            Trip::SetPointNotAccepted { .. } => (
                "set_point_not_accepted",
                "check the scale and the current limit of the drive against amplifier.current_limit_a; \
                 the limit of the difference is interlock.current_error_a",
            ),
            Trip::CurrentNotFollowed { .. } => (
                "current_not_followed",
                "check that the drive takes set-points (its mode, another master on the bus); \
                 the limits are interlock.current_error_a and current_error_s",
            ),
            Trip::ModelError { .. } => (
                "model_error",
                "check the probe and its target, the leads and the cable of the motor, the controller, and the model of the stage; \
                 the limits are interlock.model_error_ratio and interlock.model_error_share, and for an unknown stage \
                 interlock.model_error_off = \"REASON\" switches the comparison off",
            ),
            Trip::Overruns { .. } => (
                "overruns",
                "lower loop.rate_hz, give the loop real-time scheduling, or raise interlock.overruns_per_s",
            ),
            Trip::AmplifierDisabled => (
                "amplifier_disabled",
                "check the enable input and the supply of the drive, and whether another master disabled it",
            ),
            Trip::Amplifier { text, .. } => {
                const UNKNOWN: &str =
                    "look up the code in the amplifier's manual, clear its fault, start again";
                ("amplifier", text.map_or(UNKNOWN, |text| text.remedy))
            }
        }
    }

    /// The short reason used in JSON and recordings.
    pub fn reason(&self) -> &'static str {
        self.reason_and_remedy().0
    }

    /// What the operator can do about it.
    pub fn remedy(&self) -> &'static str {
        self.reason_and_remedy().1
    }

    /// The value that crossed the limit, and the limit; `None` for a reason without a limit.
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
            Trip::SetPointNotAccepted {
                accepted_a,
                expected_a,
            } => Some((accepted_a, expected_a)),
            Trip::CurrentNotFollowed {
                actual_a,
                command_a,
            } => Some((actual_a, command_a)),
            Trip::ModelError {
                error_m, limit_m, ..
            } => Some((error_m, limit_m)),
            Trip::Overruns { count, limit } => Some((f64::from(count), f64::from(limit))),
            Trip::CommandNotFinite
            | Trip::ProbeInvalid
            | Trip::AmplifierDisabled
            | Trip::Amplifier { .. } => None,
        }
    }
}

impl fmt::Display for Trip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Trip::Travel {
                position_m,
                limit_m,
            } => write!(
                f,
                "travel: {:.1} um is beyond the soft limit of {:.1} um",
                position_m * 1e6,
                limit_m * 1e6
            ),
            Trip::PeakCurrent { command_a, limit_a } => write!(
                f,
                "peak current: a command of {command_a:.3} A is beyond {limit_a:.3} A"
            ),
            Trip::ContinuousCurrent { thermal_a, limit_a } => write!(
                f,
                "continuous current: the motor's thermal current {thermal_a:.3} A is beyond {limit_a:.3} A"
            ),
            Trip::CommandNotFinite => f.write_str("the command was not a finite number"),
            Trip::ProbeInvalid => f.write_str("the probe's reading was not valid"),
            Trip::ProbeStale { age_s, limit_s } => write!(
                f,
                "the probe's reading is {:.3} ms old, {:.3} ms are allowed",
                age_s * 1e3,
                limit_s * 1e3
            ),
            Trip::ProbeStuck {
                unchanged_s,
                limit_s,
            } => write!(
                f,
                "the probe's reading did not move for {:.1} ms ({:.1} ms are allowed) while the current did",
                unchanged_s * 1e3,
                limit_s * 1e3
            ),
            Trip::SetPointNotAccepted {
                accepted_a,
                expected_a,
            } => write!(
                f,
                "the amplifier accepted a set-point of {accepted_a:.3} A where {expected_a:.3} A was expected"
            ),
            Trip::CurrentNotFollowed {
                actual_a,
                command_a,
            } => write!(
                f,
                "the amplifier measures {actual_a:.3} A, but the nearest commanded current is {command_a:.3} A"
            ),
            Trip::ModelError {
                error_m,
                modelled_m,
                limit_m,
            } => write!(
                f,
                "the position does not answer the current: it differs by {:.1} um from the modelled {:.1} um, \
                 and {:.1} um are allowed",
                error_m.abs() * 1e6,
                modelled_m * 1e6,
                limit_m * 1e6
            ),
            Trip::Overruns { count, limit } => write!(
                f,
                "{count} ticks missed within a second, {limit} are allowed"
            ),
            Trip::AmplifierDisabled => {
                f.write_str("the amplifier reports itself disabled during the run")
            }
            Trip::Amplifier {
                code,
                text: Some(text),
            } => write!(f, "amplifier: {} (code {code})", text.what),
            Trip::Amplifier { code, text: None } => write!(
                f,
                "the amplifier reported a fault or refused a command (code {code})"
            ),
        }
    }
}
