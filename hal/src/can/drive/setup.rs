//! Tells a drive how to work, and checks that it listens: everything that goes by SDO.

use std::time::Duration;

use super::super::budget::Exchange;
use super::super::cia402::PROFILE_TORQUE;
use super::super::pdo::{ASYNCHRONOUS, Direction, Mapped, OFF, Pdo, Value, parameters};
use super::super::scale::{Reference, Scale};
use super::super::sdo::{Address, Channel, SdoError};
use super::super::{heartbeat, nmt};
use super::OpenError;
use super::settings::{DriveSettings, milliseconds};

const IDENTITY: u16 = 0x1018;
const HEARTBEAT_CONSUMER: Address = Address::new(0x1016, 1);
const HEARTBEAT_PRODUCER: Address = Address::new(0x1017, 0);
const ABORT_CONNECTION: Address = Address::new(0x6007, 0);
const CONTROLWORD: Address = Address::new(0x6040, 0);
const STATUSWORD: Address = Address::new(0x6041, 0);
const MODE: Address = Address::new(0x6060, 0);
const MODE_DISPLAY: Address = Address::new(0x6061, 0);
const TARGET: Address = Address::new(0x6071, 0);
const MAXIMUM: Address = Address::new(0x6072, 0);
const RATED_CURRENT: Address = Address::new(0x6075, 0);
const ACTUAL: Address = Address::new(0x6077, 0);
const SLOPE: Address = Address::new(0x6087, 0);
const SUPPORTED_MODES: Address = Address::new(0x6502, 0);

/// What the drive turned out to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Configured {
    pub(super) scale: Scale,
    pub(super) mode: i8,
    /// Vendor, product, revision and serial number, as far as the drive says.
    pub(super) identity: [Option<u32>; 4],
}

/// A drive to be set up.
pub(super) struct Setup<'a> {
    pub(super) channel: Channel<'a>,
    pub(super) settings: &'a DriveSettings,
}

impl Setup<'_> {
    /// All of it, in pre-operational: nothing moves and no process data flow.
    pub(super) fn run(&mut self) -> Result<Configured, OpenError> {
        self.channel
            .bus
            .send(&nmt::Command::EnterPreOperational.frame(self.settings.node))?;
        let identity = self.check_identity()?;
        self.switch_off()?;
        let scale = self.scale()?;
        self.watch_each_other()?;
        self.map()?;
        let mode = self.choose_mode()?;
        Ok(Configured {
            scale,
            mode,
            identity,
        })
    }

    fn check_identity(&mut self) -> Result<[Option<u32>; 4], OpenError> {
        let identity = self.settings.identity;
        let fields = [
            (1, "the vendor", identity.vendor),
            (2, "the product code", identity.product),
            (3, "the revision", identity.revision),
            (4, "the serial number", identity.serial),
        ];
        self.channel.read_u32(Address::new(IDENTITY, 1))?; // every CANopen node has it: a node that answers is there
        let mut identity = [None; 4];
        for ((sub, field, want), said) in fields.into_iter().zip(&mut identity) {
            let have = match (self.channel.read_u32(Address::new(IDENTITY, sub)), want) {
                (Err(error), None) if error.means_absent() => continue,
                (have, _) => have?,
            };
            if let Some(want) = want.filter(|want| *want != have) {
                return Err(OpenError::Identity {
                    node: self.settings.node,
                    field,
                    have,
                    want,
                });
            }
            *said = Some(have);
        }
        Ok(identity)
    }

    /// No voltage, no target: whatever came before.
    fn switch_off(&mut self) -> Result<(), OpenError> {
        self.put(CONTROLWORD, 0, 2)?;
        self.put(TARGET, 0, 2)
    }

    /// Rated current as configured, to the milliampere of 0x6075; and what 1000 counts are.
    fn scale(&mut self) -> Result<Scale, OpenError> {
        let (node, want_a) = (self.settings.node, self.settings.rated_current_a);
        let have_a = f64::from(self.channel.read_u32(RATED_CURRENT)?) * 1e-3;
        let agrees = (have_a - want_a).abs() < 0.5e-3;
        if !agrees {
            return Err(OpenError::RatedCurrent {
                node,
                have_a,
                want_a,
            });
        }
        let reference_a = match self.settings.reference {
            Reference::Rated => have_a,
            Reference::Maximum => have_a * f64::from(self.channel.read_u16(MAXIMUM)?) * 1e-3,
        };
        Scale::new(reference_a, self.settings.current_limit_a).ok_or(OpenError::Setting {
            name: "current_limit_a",
            value: format!(
                "{} A with 1000 counts = {reference_a} A",
                self.settings.current_limit_a
            ),
            limit: "both positive, the limit at least one count",
        })
    }

    /// Heartbeats both ways, and what the drive does when it hears none.
    fn watch_each_other(&mut self) -> Result<(), OpenError> {
        let (settings, node) = (self.settings, self.settings.node);
        let own_timeout_ms = milliseconds(settings.own_heartbeat_timeout);
        let entry = heartbeat::consumer_entry(settings.own_node, own_timeout_ms);
        self.put(
            HEARTBEAT_PRODUCER,
            u32::from(milliseconds(settings.heartbeat_period)),
            2,
        )?;
        let no_stop = |error| match error {
            OpenError::Sdo(cause) if cause.means_absent() => OpenError::NoStop { node, cause },
            other => other,
        };
        self.put(HEARTBEAT_CONSUMER, entry, 4).map_err(no_stop)?;
        match settings.abort_connection {
            Some(option) => self
                .put(ABORT_CONNECTION, u32::from(option as u16), 2)
                .map_err(no_stop),
            None => Ok(()),
        }
    }

    fn map(&mut self) -> Result<(), OpenError> {
        for pdo in self.pdos() {
            let cob_id_now = self.channel.read_u32(pdo.cob_id_address())?;
            for value in pdo.sequence(cob_id_now) {
                self.write(value)
                    .map_err(|error| self.no_timer(value.address, error))?;
            }
            for value in pdo.layout() {
                self.verify(value)?;
            }
            let on = pdo.sequence(cob_id_now).last().copied();
            on.map_or(Ok(()), |value| self.verify(value))?;
        }
        (2..=4).try_for_each(|number| self.silence(number))
    }

    /// Says which other exchange does without the times that a drive missing_objects.
    fn no_timer(&self, address: Address, error: OpenError) -> OpenError {
        let is_time = matches!((address.index, address.sub), (0x1800, 3 | 5));
        match error {
            OpenError::Sdo(cause) if is_time && cause.means_absent() => OpenError::NoTimer {
                node: self.settings.node,
                cause,
            },
            other => other,
        }
    }

    /// Set-point: controlword and target. Status: statusword and actual value.
    fn pdos(&self) -> [Pdo; 2] {
        let node = self.settings.node;
        let period_ms = milliseconds(self.settings.status_period());
        let (set_point, status, timer_ms) = match self.settings.exchange {
            Exchange::Asynchronous { .. } => (ASYNCHRONOUS, ASYNCHRONOUS, Some(period_ms)),
            Exchange::Synchronous { status_every } => (1, status_every, None),
        };
        let pdo = |direction, entries: [Address; 2], transmission, timer_ms: Option<u16>| Pdo {
            direction,
            number: 1,
            node,
            entries: entries.map(|address| Mapped::new(address, 16)).to_vec(),
            transmission,
            inhibit_100us: timer_ms.map(|timer_ms| timer_ms.saturating_mul(10)),
            event_timer_ms: timer_ms,
        };
        [
            pdo(Direction::Receive, [CONTROLWORD, TARGET], set_point, None),
            pdo(Direction::Transmit, [STATUSWORD, ACTUAL], status, timer_ms),
        ]
    }

    /// Switches a status PDO off that is not in the budget, if the drive has it.
    fn silence(&mut self, number: u8) -> Result<(), OpenError> {
        let address = Address::new(parameters(Direction::Transmit, number), 1);
        match self.channel.read_u32(address) {
            Ok(cob_id) if cob_id & OFF == 0 => self.put(address, cob_id | OFF, 4),
            Err(error) if !error.means_absent() => Err(error.into()),
            _ => Ok(()),
        }
    }

    fn choose_mode(&mut self) -> Result<i8, OpenError> {
        let node = self.settings.node;
        let supported = match self.channel.read_u32(SUPPORTED_MODES) {
            Err(error) if error.means_absent() => u32::MAX, // optional: then 0x6061 tells
            other => other?,
        };
        let mode = self
            .settings
            .mode
            .choose(supported)
            .ok_or(OpenError::Modes { node, supported })?;
        if mode == PROFILE_TORQUE {
            self.put(SLOPE, self.settings.torque_slope, 4)?;
        }
        self.write(Value {
            address: MODE,
            number: u32::from(mode as u8),
            bytes: 1,
        })?;
        self.wait_for_mode(mode)
    }

    /// Some drives need a moment to change their mode.
    fn wait_for_mode(&mut self, want: i8) -> Result<i8, OpenError> {
        let deadline_ns =
            self.channel.host.now_ns() + self.settings.state_timeout.as_nanos() as u64;
        loop {
            let have = self.channel.read_u8(MODE_DISPLAY)? as i8;
            if have == want {
                return Ok(want);
            }
            if self.channel.host.now_ns() >= deadline_ns {
                return Err(OpenError::ModeDisplay {
                    node: self.settings.node,
                    have,
                    want,
                });
            }
            self.channel.host.sleep(Duration::from_millis(5));
        }
    }

    /// Writes and verifies a number.
    fn put(&mut self, address: Address, number: u32, bytes: usize) -> Result<(), OpenError> {
        let value = Value {
            address,
            number,
            bytes,
        };
        self.write(value)?;
        self.verify(value)
    }

    fn write(&mut self, value: Value) -> Result<(), OpenError> {
        let bytes = value.number.to_le_bytes();
        Ok(self
            .channel
            .write(value.address, bytes.get(..value.bytes).unwrap_or(&bytes))?)
    }

    fn verify(&mut self, value: Value) -> Result<(), OpenError> {
        let bytes = self.channel.read(value.address)?;
        let (node, address, have) = (self.settings.node, value.address, bytes.len());
        if have != value.bytes {
            return Err(SdoError::Length {
                node,
                address,
                have,
                want: value.bytes,
            }
            .into());
        }
        let have = bytes
            .iter()
            .rev()
            .fold(0, |number, byte| number << 8 | u32::from(*byte));
        let want = value.number;
        if have == want {
            Ok(())
        } else {
            Err(OpenError::Verification {
                node,
                address,
                have,
                want,
            })
        }
    }
}
