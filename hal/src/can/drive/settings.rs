//! Settings of a CANopen drive.

use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::budget::{Exchange, Traffic};
use super::super::cia402::{CYCLIC_TORQUE, PROFILE_TORQUE};
use super::super::last_pass::PASS_TIMEOUT;
use super::super::scale::Reference;
use super::errors::OpenError;

/// The mode of operation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TorqueMode {
    /// Cyclic synchronous torque if the drive supports it, otherwise profile torque.
    #[default]
    CyclicElseProfile,
    /// Cyclic synchronous torque (10).
    Cyclic,
    /// Profile torque (4), with the slope [`DriveSettings::torque_slope`].
    Profile,
}

impl TorqueMode {
    /// The mode to use with a drive that has the `supported` modes of 0x6502 (bit n-1 is mode n), if there is one.
    pub fn choose(self, supported: u32) -> Option<i8> {
        let candidates: &[i8] = match self {
            TorqueMode::CyclicElseProfile => &[CYCLIC_TORQUE, PROFILE_TORQUE],
            TorqueMode::Cyclic => &[CYCLIC_TORQUE],
            TorqueMode::Profile => &[PROFILE_TORQUE],
        };
        candidates
            .iter()
            .copied()
            .find(|mode| supported >> (mode - 1) & 1 == 1)
    }
}

/// Expected values of the identity object 0x1018; `None` is not checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExpectedIdentity {
    /// Sub-index 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vendor: Option<u32>,
    /// Sub-index 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub product: Option<u32>,
    /// Sub-index 3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub revision: Option<u32>,
    /// Sub-index 4.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub serial: Option<u32>,
}

impl ExpectedIdentity {
    /// Vendor, product, revision and serial number: the expected values, or those of `other` where nothing is expected.
    pub fn or(&self, other: [u32; 4]) -> [u32; 4] {
        let expected = [self.vendor, self.product, self.revision, self.serial];
        std::array::from_fn(|field| expected[field].unwrap_or(other[field]))
    }
}

/// Settings of a CANopen drive.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveSettings {
    /// Node number of the drive, 1 to 127.
    pub node: u8,
    /// Node number of this program, 1 to 127. The drive monitors the heartbeat of this node.
    pub own_node: u8,
    /// Bit rate of the bus, in bit/s.
    pub bit_rate: u32,
    /// Set-points per second.
    pub rate_hz: f64,
    /// Set-points with or without SYNC.
    pub exchange: Exchange,
    /// Largest permitted load of the bus, as a fraction.
    pub load_limit: f64,
    /// Mode of operation.
    pub mode: TorqueMode,
    /// Slope 0x6087 in profile torque, in per mille of the rated torque per second.
    pub torque_slope: u32,
    /// The current that 1000 counts of the target stand for.
    pub reference: Reference,
    /// Rated current of the drive (0x6075), in amperes.
    pub rated_current_a: f64,
    /// Limit of the commands, in amperes.
    pub current_limit_a: f64,
    /// Expected identity of the drive.
    pub identity: ExpectedIdentity,
    /// Reaction of the drive to a lost connection (0x6007): 1 fault, 2 disable voltage, 3 quick stop. `None` leaves the drive's
    /// own reaction, for drives without this object; then disconnect the bus once to verify that the drive stops.
    pub abort_connection: Option<i16>,
    /// Periods and time limits.
    pub times: DriveTimes,
}

/// Periods and time limits of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveTimes {
    /// Time between heartbeats of the drive.
    pub heartbeat_period: Duration,
    /// Without a heartbeat for this time the drive is lost.
    pub heartbeat_timeout: Duration,
    /// Time between heartbeats of this program.
    pub own_heartbeat_period: Duration,
    /// Without a heartbeat of this program for this time the drive stops.
    pub own_heartbeat_timeout: Duration,
    /// Without a status frame for this time an enabled drive is lost.
    pub status_timeout: Duration,
    /// Without a command for this time an enabled drive is switched off.
    pub command_timeout: Duration,
    /// Time limit of each answer to an SDO request.
    pub sdo_timeout: Duration,
    /// Time limit of a change of state: enable, disable, reset.
    pub state_timeout: Duration,
    /// If the thread of the driver has not run for this time, the state that it wrote is outdated: a fault.
    pub pass_timeout: Duration,
}

impl Default for DriveSettings {
    fn default() -> Self {
        DriveSettings {
            node: 5,
            own_node: 0x7F,
            bit_rate: 1_000_000,
            rate_hz: 1000.0,
            exchange: Exchange::Asynchronous { status_hz: 500.0 },
            load_limit: 0.8,
            mode: TorqueMode::default(),
            torque_slope: u32::MAX,
            reference: Reference::Rated,
            rated_current_a: 4.0,
            current_limit_a: 4.0,
            identity: ExpectedIdentity::default(),
            abort_connection: Some(2),
            times: DriveTimes::default(),
        }
    }
}

impl Default for DriveTimes {
    fn default() -> Self {
        DriveTimes {
            heartbeat_period: Duration::from_millis(20),
            heartbeat_timeout: Duration::from_millis(70),
            own_heartbeat_period: Duration::from_millis(20),
            own_heartbeat_timeout: Duration::from_millis(70),
            status_timeout: Duration::from_millis(20),
            command_timeout: Duration::from_millis(20),
            sdo_timeout: Duration::from_millis(500),
            state_timeout: Duration::from_secs(2),
            pass_timeout: PASS_TIMEOUT,
        }
    }
}

fn invalid_setting(name: &'static str, value: impl ToString, limit: &'static str) -> OpenError {
    let value = value.to_string();
    OpenError::Setting { name, value, limit }
}

impl DriveTimes {
    /// The heartbeats have times of 16 bits in milliseconds.
    fn check_range(&self) -> Result<(), OpenError> {
        let times = [
            ("heartbeat_period", self.heartbeat_period),
            ("heartbeat_timeout", self.heartbeat_timeout),
            ("own_heartbeat_period", self.own_heartbeat_period),
            ("own_heartbeat_timeout", self.own_heartbeat_timeout),
        ];
        for (name, time) in times {
            if !(1..=u128::from(u16::MAX)).contains(&time.as_millis()) {
                return Err(invalid_setting(
                    name,
                    format!("{time:?}"),
                    "1 ms to 65.535 s",
                ));
            }
        }
        Ok(())
    }
}

/// A time in milliseconds, limited to 16 bits.
pub(super) fn milliseconds(time: Duration) -> u16 {
    u16::try_from(time.as_millis()).unwrap_or(u16::MAX)
}

impl DriveSettings {
    /// The frames that this configuration sends over the bus.
    pub fn traffic(&self) -> Traffic {
        let periods = [self.times.heartbeat_period, self.times.own_heartbeat_period];
        Traffic {
            bit_rate: self.bit_rate,
            rate_hz: self.rate_hz,
            exchange: self.exchange,
            heartbeat_hz: periods
                .map(|period| 1.0 / period.as_secs_f64())
                .iter()
                .sum(),
            load_limit: self.load_limit,
        }
    }

    /// Refuses invalid settings. The error states value and limit.
    pub fn check(&self) -> Result<(), OpenError> {
        self.check_nodes()?;
        self.check_exchange()?;
        self.times.check_range()?;
        self.check_timeouts()?;
        self.traffic().check()?;
        Ok(())
    }

    fn check_nodes(&self) -> Result<(), OpenError> {
        if !(1..=127).contains(&self.node) {
            return Err(invalid_setting("node", self.node, "1 to 127"));
        }
        if !(1..=127).contains(&self.own_node) || self.own_node == self.node {
            let limit = "1 to 127, and not that of the drive";
            return Err(invalid_setting("own_node", self.own_node, limit));
        }
        Ok(())
    }

    fn check_exchange(&self) -> Result<(), OpenError> {
        match self.exchange {
            Exchange::Asynchronous { status_hz } if !(1.0..=1000.0).contains(&status_hz) => {
                let limit = "1 to 1000 Hz, since a drive's event timer counts milliseconds";
                Err(invalid_setting("status_hz", status_hz, limit))
            }
            Exchange::Synchronous { status_every } if !(1..=240).contains(&status_every) => {
                Err(invalid_setting("status_every", status_every, "1 to 240"))
            }
            _ if !(1.0..=1e6).contains(&self.rate_hz) => {
                Err(invalid_setting("rate_hz", self.rate_hz, "1 to 1000000 Hz"))
            }
            _ if !(self.load_limit > 0.0 && self.load_limit <= 1.0) => Err(invalid_setting(
                "load_limit",
                self.load_limit,
                "above 0, at most 1",
            )),
            _ => Ok(()),
        }
    }

    /// Each time limit must be at least twice the period that it monitors.
    fn check_timeouts(&self) -> Result<(), OpenError> {
        let t = &self.times;
        let command_period = Duration::from_secs_f64(1.0 / self.rate_hz);
        let monitored = [
            ("heartbeat_timeout", t.heartbeat_timeout, t.heartbeat_period),
            (
                "own_heartbeat_timeout",
                t.own_heartbeat_timeout,
                t.own_heartbeat_period,
            ),
            ("status_timeout", t.status_timeout, self.status_period()),
            ("command_timeout", t.command_timeout, command_period),
        ];
        for (name, timeout, period) in monitored {
            if timeout < 2 * period {
                let limit = "at least twice the period, or one late frame is a fault";
                return Err(invalid_setting(name, format!("{timeout:?}"), limit));
            }
        }
        Ok(())
    }

    /// Time between status frames; in whole milliseconds if a timer of the drive determines it.
    pub(super) fn status_period(&self) -> Duration {
        match self.exchange {
            Exchange::Asynchronous { status_hz } => {
                Duration::from_millis((1000.0 / status_hz).ceil() as u64)
            }
            Exchange::Synchronous { status_every } => {
                Duration::from_secs_f64(f64::from(status_every) / self.rate_hz)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(change: impl FnOnce(&mut DriveSettings)) -> String {
        let mut settings = DriveSettings::default();
        change(&mut settings);
        settings.check().unwrap_err().to_string()
    }

    #[test]
    fn rejects_invalid_settings_with_value_and_limit() {
        assert!(DriveSettings::default().check().is_ok());
        assert_eq!(
            refusal(|s| s.node = 0),
            "node = 0 is invalid; set it to 1 to 127"
        );
        assert!(refusal(|s| s.own_node = 5).contains("not that of the drive"));
        assert!(
            refusal(|s| s.times.heartbeat_timeout = Duration::from_millis(30))
                .contains("at least twice the period")
        );
        assert!(
            refusal(|s| s.times.own_heartbeat_period = Duration::ZERO).contains("1 ms to 65.535 s")
        );
        assert!(
            refusal(|s| s.exchange = Exchange::Synchronous { status_every: 0 })
                .contains("1 to 240")
        );
        for rate_hz in [f64::NAN, 0.0, 1e-300, f64::INFINITY] {
            assert!(
                refusal(|s| s.rate_hz = rate_hz).contains("1 to 1000000 Hz"),
                "{rate_hz}"
            );
        }
        let exchange = Exchange::Synchronous { status_every: 1 };
        let refused = refusal(|s| (s.rate_hz, s.exchange) = (5000.0, exchange));
        assert!(refused.contains("245 us of the 200 us"), "{refused}");
    }

    #[test]
    fn prefers_cyclic_torque_and_falls_back_to_profile_torque() {
        let (profile, cyclic) = (1 << 3, 1 << 9);
        assert_eq!(
            TorqueMode::CyclicElseProfile.choose(profile | cyclic),
            Some(CYCLIC_TORQUE)
        );
        assert_eq!(
            TorqueMode::CyclicElseProfile.choose(profile),
            Some(PROFILE_TORQUE)
        );
        assert_eq!(TorqueMode::Cyclic.choose(profile), None);
        assert_eq!(
            TorqueMode::Profile.choose(profile | cyclic),
            Some(PROFILE_TORQUE)
        );
    }
}
