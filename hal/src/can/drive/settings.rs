//! What is configured of a drive.

use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::budget::{Exchange, Traffic};
use super::super::cia402::{CYCLIC_TORQUE, PROFILE_TORQUE};
use super::super::scale::Reference;
use super::errors::OpenError;

/// Which mode of operation the drive shall run in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TorqueMode {
    /// Cyclic synchronous torque if the drive has it, else profile torque.
    #[default]
    CyclicElseProfile,
    /// Cyclic synchronous torque (10).
    Cyclic,
    /// Profile torque (4), with the slope [`DriveSettings::torque_slope`].
    Profile,
}

impl TorqueMode {
    /// The mode for a drive with the supported modes of 0x6502 (bit n-1: mode n), if there is one.
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

/// What the identity object 0x1018 must say; `None` is not checked.
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

/// What is configured of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveSettings {
    /// Node number of the drive, 1 to 127.
    pub node: u8,
    /// Our node number, 1 to 127, whose heartbeat the drive watches.
    pub own_node: u8,
    /// Bit rate of the bus, in bit/s.
    pub bit_rate: u32,
    /// Commands in a second.
    pub rate_hz: f64,
    /// Set-points as they come or with SYNC.
    pub exchange: Exchange,
    /// Largest load of the bus, as a fraction.
    pub load_limit: f64,
    /// Mode of operation.
    pub mode: TorqueMode,
    /// Slope 0x6087 in profile torque, per mille of rated a second; the largest that the drive takes.
    pub torque_slope: u32,
    /// What 1000 counts of the target are.
    pub reference: Reference,
    /// Rated current of the drive (0x6075), in amperes.
    pub rated_current_a: f64,
    /// Commands beyond this are limited, in amperes.
    pub current_limit_a: f64,
    /// Who the drive must be.
    pub identity: ExpectedIdentity,
    /// Reaction of the drive to a lost connection (0x6007): 1 fault, 2 disable voltage, 3 quick stop. `None` leaves
    /// the drive's own reaction, for drives without this object: prove by unplugging the bus that it stops.
    pub abort_connection: Option<i16>,
    /// Time between heartbeats of the drive.
    pub heartbeat_period: Duration,
    /// The drive is lost after this time without heartbeat.
    pub heartbeat_timeout: Duration,
    /// Time between our heartbeats.
    pub own_heartbeat_period: Duration,
    /// The drive stops after this time without ours.
    pub own_heartbeat_timeout: Duration,
    /// While enabled, the drive is lost after this time without a status frame.
    pub status_timeout: Duration,
    /// While enabled, the drive is switched off after this time without a command.
    pub command_timeout: Duration,
    /// Limit for each answer to an SDO request.
    pub sdo_timeout: Duration,
    /// Limit for a change of state: enable, disable, reset.
    pub state_timeout: Duration,
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
            heartbeat_period: Duration::from_millis(20),
            heartbeat_timeout: Duration::from_millis(70),
            own_heartbeat_period: Duration::from_millis(20),
            own_heartbeat_timeout: Duration::from_millis(70),
            status_timeout: Duration::from_millis(20),
            command_timeout: Duration::from_millis(20),
            sdo_timeout: Duration::from_millis(500),
            state_timeout: Duration::from_secs(2),
        }
    }
}

/// A time as a count of milliseconds.
pub(super) fn milliseconds(time: Duration) -> u16 {
    u16::try_from(time.as_millis()).unwrap_or(u16::MAX)
}

impl DriveSettings {
    /// What goes over the bus.
    pub fn traffic(&self) -> Traffic {
        let beats = |period: Duration| 1.0 / period.as_secs_f64();
        Traffic {
            bit_rate: self.bit_rate,
            rate_hz: self.rate_hz,
            exchange: self.exchange,
            heartbeat_hz: beats(self.heartbeat_period) + beats(self.own_heartbeat_period),
            load_limit: self.load_limit,
        }
    }

    /// Refuses what cannot be, with value and limit.
    pub fn check(&self) -> Result<(), OpenError> {
        let refuse = |name, value: String, limit| Err(OpenError::Setting { name, value, limit });
        if !(1..=127).contains(&self.node) {
            return refuse("node", self.node.to_string(), "1 to 127");
        }
        if !(1..=127).contains(&self.own_node) || self.own_node == self.node {
            return refuse(
                "own_node",
                self.own_node.to_string(),
                "1 to 127, and not that of the drive",
            );
        }
        self.check_exchange()?;
        self.check_times()?;
        self.traffic().check()?;
        Ok(())
    }

    fn check_exchange(&self) -> Result<(), OpenError> {
        let refuse = |name, value: String, limit| Err(OpenError::Setting { name, value, limit });
        match self.exchange {
            Exchange::Asynchronous { status_hz } if !(1.0..=1000.0).contains(&status_hz) => refuse(
                "status_hz",
                status_hz.to_string(),
                "1 to 1000 Hz, since a drive's event timer counts milliseconds",
            ),
            Exchange::Synchronous { status_every } if !(1..=240).contains(&status_every) => {
                refuse("status_every", status_every.to_string(), "1 to 240")
            }
            _ if !(1.0..=1e6).contains(&self.rate_hz) => {
                refuse("rate_hz", self.rate_hz.to_string(), "1 to 1000000 Hz")
            }
            _ if !(self.load_limit > 0.0 && self.load_limit <= 1.0) => refuse(
                "load_limit",
                self.load_limit.to_string(),
                "above 0, at most 1",
            ),
            _ => Ok(()),
        }
    }

    fn check_times(&self) -> Result<(), OpenError> {
        let times = [
            ("heartbeat_period", self.heartbeat_period),
            ("heartbeat_timeout", self.heartbeat_timeout),
            ("own_heartbeat_period", self.own_heartbeat_period),
            ("own_heartbeat_timeout", self.own_heartbeat_timeout),
        ];
        let unfit =
            |time: &Duration| time.as_millis() == 0 || time.as_millis() > u128::from(u16::MAX);
        if let Some((name, time)) = times.iter().find(|(_, time)| unfit(time)) {
            return Err(OpenError::Setting {
                name,
                value: format!("{time:?}"),
                limit: "1 ms to 65.535 s",
            });
        }
        let twice = "at least twice the period, or one late heartbeat is a fault";
        let timeouts = [
            (
                "heartbeat_timeout",
                self.heartbeat_period,
                self.heartbeat_timeout,
            ),
            (
                "own_heartbeat_timeout",
                self.own_heartbeat_period,
                self.own_heartbeat_timeout,
            ),
            ("status_timeout", self.status_period(), self.status_timeout),
            (
                "command_timeout",
                Duration::from_secs_f64(1.0 / self.rate_hz),
                self.command_timeout,
            ),
        ];
        match timeouts
            .iter()
            .find(|(_, period, timeout)| *timeout < 2 * *period)
        {
            Some((name, _, timeout)) => Err(OpenError::Setting {
                name,
                value: format!("{timeout:?}"),
                limit: twice,
            }),
            None => Ok(()),
        }
    }

    /// Time between status frames: in whole milliseconds where the drive's timer makes it.
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
    fn settings_that_cannot_be_are_refused_with_value_and_limit() {
        assert!(DriveSettings::default().check().is_ok());
        assert_eq!(
            refusal(|s| s.node = 0),
            "node = 0 is invalid: expected 1 to 127"
        );
        assert!(refusal(|s| s.own_node = 5).contains("not that of the drive"));
        assert!(
            refusal(|s| s.heartbeat_timeout = Duration::from_millis(30))
                .contains("at least twice the period")
        );
        assert!(refusal(|s| s.own_heartbeat_period = Duration::ZERO).contains("1 ms to 65.535 s"));
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
    fn cyclic_torque_comes_first_and_profile_torque_is_the_fallback() {
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
