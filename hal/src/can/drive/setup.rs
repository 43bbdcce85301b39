//! Configures a drive by SDO and verifies what it accepted.

use std::time::Duration;

use super::super::budget::Exchange;
use super::super::cia402::PROFILE_TORQUE;
use super::super::objects::{
    ABORT_CONNECTION, ACTUAL, CONTROLWORD, HEARTBEAT_CONSUMER, HEARTBEAT_PRODUCER, MAXIMUM, MODE,
    MODE_DISPLAY, RATED_CURRENT, SLOPE, STATUSWORD, SUPPORTED_MODES, TARGET, identity,
};
use super::super::pdo::{ASYNCHRONOUS, Direction, Mapped, OFF, Pdo, Value, number_of, parameters};
use super::super::scale::{Reference, Scale};
use super::super::sdo::{Address, Channel, SdoError};
use super::super::{heartbeat, nmt};
use super::errors::OpenError;
use super::settings::{DriveSettings, milliseconds};

/// Time between reads of the active mode.
const MODE_POLL: Duration = Duration::from_millis(5);

/// Properties of a configured drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Configured {
    pub(super) scale: Scale,
    pub(super) mode: i8,
    /// Vendor, product, revision and serial number, as far as the drive has them.
    pub(super) identity: [Option<u32>; 4],
}

/// The configuration of one drive.
pub(super) struct Setup<'a> {
    pub(super) channel: Channel<'a>,
    pub(super) settings: &'a DriveSettings,
}

impl Setup<'_> {
    /// Configures the drive in the state pre-operational, in which no process data are exchanged.
    pub(super) fn run(&mut self) -> Result<Configured, OpenError> {
        let stop = nmt::Command::EnterPreOperational.frame(self.settings.node);
        self.channel.bus.send(&stop)?;
        let identity = self.check_identity()?;
        self.switch_off()?;
        let scale = self.scale()?;
        self.configure_heartbeats()?;
        self.configure_pdos()?;
        let mode = self.choose_mode()?;
        Ok(Configured {
            scale,
            mode,
            identity,
        })
    }

    fn check_identity(&mut self) -> Result<[Option<u32>; 4], OpenError> {
        let expected = self.settings.identity;
        self.channel.read_u32(identity(1))?; // every CANopen node has it: this shows that the node answers
        Ok([
            self.check_identity_field(1, "the vendor", expected.vendor)?,
            self.check_identity_field(2, "the product code", expected.product)?,
            self.check_identity_field(3, "the revision", expected.revision)?,
            self.check_identity_field(4, "the serial number", expected.serial)?,
        ])
    }

    fn check_identity_field(
        &mut self,
        sub: u8,
        field: &'static str,
        want: Option<u32>,
    ) -> Result<Option<u32>, OpenError> {
        let have = match self.channel.read_u32(identity(sub)) {
            Err(error) if want.is_none() && error.means_absent() => return Ok(None),
            have => have?,
        };
        match want {
            Some(want) if want != have => Err(OpenError::Identity {
                node: self.settings.node,
                field,
                have,
                want,
            }),
            _ => Ok(Some(have)),
        }
    }

    /// Disables the voltage and sets the target to zero.
    fn switch_off(&mut self) -> Result<(), OpenError> {
        self.put(CONTROLWORD, 0, 2)?;
        self.put(TARGET, 0, 2)
    }

    /// The rated current of the drive, which must agree with the configuration to the resolution of 0x6075.
    fn check_rated_current(&mut self) -> Result<f64, OpenError> {
        let (node, want_a) = (self.settings.node, self.settings.rated_current_a);
        let have_a = f64::from(self.channel.read_u32(RATED_CURRENT)?) * 1e-3;
        if (have_a - want_a).abs() < 0.5e-3 {
            return Ok(have_a);
        }
        Err(OpenError::RatedCurrent {
            node,
            have_a,
            want_a,
        })
    }

    /// The scale of the target.
    fn scale(&mut self) -> Result<Scale, OpenError> {
        let rated_a = self.check_rated_current()?;
        let reference_a = match self.settings.reference {
            Reference::Rated => rated_a,
            Reference::Maximum => rated_a * f64::from(self.channel.read_u16(MAXIMUM)?) * 1e-3,
        };
        let limit_a = self.settings.current_limit_a;
        Scale::new(reference_a, limit_a).ok_or_else(|| OpenError::Setting {
            name: "current_limit_a",
            value: format!("{limit_a} A with 1000 counts = {reference_a} A"),
            limit: "positive values, with a limit of at least one count",
        })
    }

    /// Heartbeats in both directions, and the reaction of the drive to a lost heartbeat.
    fn configure_heartbeats(&mut self) -> Result<(), OpenError> {
        let times = &self.settings.times;
        let period_ms = milliseconds(times.heartbeat_period);
        let timeout_ms = milliseconds(times.own_heartbeat_timeout);
        let consumer = heartbeat::consumer_entry(self.settings.own_node, timeout_ms);
        self.put(HEARTBEAT_PRODUCER, u32::from(period_ms), 2)?;
        self.write_stop_object(HEARTBEAT_CONSUMER, consumer, 4)?;
        match self.settings.abort_connection {
            Some(option) => self.write_stop_object(ABORT_CONNECTION, u32::from(option as u16), 2),
            None => Ok(()),
        }
    }

    /// Writes an object without which the drive would not stop when the heartbeat is lost.
    fn write_stop_object(
        &mut self,
        address: Address,
        number: u32,
        bytes: usize,
    ) -> Result<(), OpenError> {
        match self.put(address, number, bytes) {
            Err(OpenError::Sdo(cause)) if cause.means_absent() => Err(OpenError::NoStop {
                node: self.settings.node,
                cause,
            }),
            result => result,
        }
    }

    fn configure_pdos(&mut self) -> Result<(), OpenError> {
        for pdo in self.pdos() {
            self.configure_pdo(&pdo)?;
        }
        (2..=4).try_for_each(|number| self.switch_off_status_pdo(number))
    }

    fn configure_pdo(&mut self, pdo: &Pdo) -> Result<(), OpenError> {
        let present_cob_id = self.channel.read_u32(pdo.cob_id_address())?;
        let sequence = pdo.sequence(present_cob_id);
        for value in &sequence {
            self.write(*value)
                .map_err(|error| self.no_timer(value.address, error))?;
        }
        for value in pdo.layout() {
            self.verify(value)?;
        }
        sequence.last().map_or(Ok(()), |on| self.verify(*on))
    }

    /// If the drive lacks the timer of the status PDO, the error names the exchange that needs none.
    fn no_timer(&self, address: Address, error: OpenError) -> OpenError {
        let is_timer = matches!((address.index, address.sub), (0x1800, 3 | 5));
        match error {
            OpenError::Sdo(cause) if is_timer && cause.means_absent() => OpenError::NoTimer {
                node: self.settings.node,
                cause,
            },
            other => other,
        }
    }

    /// The set-point with controlword and target, and the status with statusword and actual value.
    fn pdos(&self) -> [Pdo; 2] {
        let period_ms = milliseconds(self.settings.status_period());
        let set_point = self.pdo(Direction::Receive, [CONTROLWORD, TARGET]);
        let status = self.pdo(Direction::Transmit, [STATUSWORD, ACTUAL]);
        match self.settings.exchange {
            Exchange::Asynchronous { .. } => [
                set_point,
                Pdo {
                    inhibit_100us: Some(period_ms.saturating_mul(10)),
                    event_timer_ms: Some(period_ms),
                    ..status
                },
            ],
            Exchange::Synchronous { status_every } => [
                Pdo {
                    transmission: 1,
                    ..set_point
                },
                Pdo {
                    transmission: status_every,
                    ..status
                },
            ],
        }
    }

    /// PDO 1, asynchronous, with two objects of 16 bits.
    fn pdo(&self, direction: Direction, objects: [Address; 2]) -> Pdo {
        Pdo {
            direction,
            number: 1,
            node: self.settings.node,
            entries: objects.map(|address| Mapped::new(address, 16)).to_vec(),
            transmission: ASYNCHRONOUS,
            inhibit_100us: None,
            event_timer_ms: None,
        }
    }

    /// Switches off a status PDO that is not part of the bus load, if the drive has it.
    fn switch_off_status_pdo(&mut self, number: u8) -> Result<(), OpenError> {
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
            Err(error) if error.means_absent() => u32::MAX, // an optional object: 0x6061 shows the active mode
            other => other?,
        };
        let mode = self.settings.mode.choose(supported);
        let mode = mode.ok_or(OpenError::Modes { node, supported })?;
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

    /// Waits until the mode is active; some drives need some time to change it.
    fn wait_for_mode(&mut self, want: i8) -> Result<i8, OpenError> {
        let host = self.channel.host;
        let deadline_ns = host.now_ns() + self.settings.times.state_timeout.as_nanos() as u64;
        loop {
            let have = self.channel.read_u8(MODE_DISPLAY)? as i8;
            if have == want {
                return Ok(want);
            }
            if host.now_ns() >= deadline_ns {
                let node = self.settings.node;
                return Err(OpenError::ModeDisplay { node, have, want });
            }
            host.sleep(MODE_POLL);
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
        let bytes = bytes.get(..value.bytes).unwrap_or(&bytes);
        Ok(self.channel.write(value.address, bytes)?)
    }

    fn verify(&mut self, value: Value) -> Result<(), OpenError> {
        let (node, address, want) = (self.settings.node, value.address, value.number);
        let bytes = self.channel.read(address)?;
        if bytes.len() != value.bytes {
            return Err(OpenError::Sdo(SdoError::Length {
                node,
                address,
                have: bytes.len(),
                want: value.bytes,
            }));
        }
        let have = number_of(&bytes);
        if have == want {
            return Ok(());
        }
        Err(OpenError::Verification {
            node,
            address,
            have,
            want,
        })
    }
}
