//! SocketCAN: raw sockets with filters and error frames.

use std::time::Duration;

use socketcan::{
    CanDataFrame, CanErrorFrame, CanFilter, CanFrame as Raw, CanSocket, EmbeddedFrame, Frame,
    Socket, SocketOptions,
};
use thiserror::Error;

use super::super::frame::{CanFrame, Id};
use super::{
    BusError, BusEvent, CanBus, Claim, Condition, Interface, InterfaceError, NodeInUse, Port,
};

/// A SocketCAN interface.
#[derive(Clone, Debug)]
pub struct SocketPort {
    interface: String,
    /// A virtual interface has no controller and no bus: frames only reach other sockets of this computer.
    is_virtual: bool,
}

/// An interface that cannot be used in its present state.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PortError {
    /// It does not exist, or its state cannot be read.
    #[error(transparent)]
    Interface(#[from] InterfaceError),
    /// It is down.
    #[error(
        "CAN interface {name} is down; bring it up with `ip link set {name} up type can bitrate {bit_rate}`"
    )]
    Down {
        /// Its name.
        name: String,
        /// The configured bit rate, in bit/s.
        bit_rate: u32,
    },
    /// It runs at another bit rate than configured.
    #[error(
        "CAN interface {name} runs at {have} bit/s, but {want} is configured; set the bit rate with `ip link set {name} down` and `ip link set {name} up type can bitrate {want}`, or change the configuration"
    )]
    BitRate {
        /// Its name.
        name: String,
        /// Its bit rate, in bit/s.
        have: u32,
        /// The configured bit rate, in bit/s.
        want: u32,
    },
    /// Its controller does not take part in the bus.
    #[error(
        "the controller of CAN interface {name} is in state {state}; check cable, termination and bit rate, then `ip link set {name} down` and up again"
    )]
    Unhealthy {
        /// Its name.
        name: String,
        /// Its state.
        state: &'static str,
    },
}

impl SocketPort {
    /// The interface `name`, which must be up and healthy and run at `bit_rate` (a virtual interface has none).
    pub fn open(name: &str, bit_rate: u32) -> Result<SocketPort, PortError> {
        let interface = Interface::read(name)?;
        let name = name.to_owned();
        match (interface.is_up, interface.bit_rate, interface.is_healthy) {
            (false, ..) => Err(PortError::Down { name, bit_rate }),
            (_, Some(have), _) if have != bit_rate => Err(PortError::BitRate {
                name,
                have,
                want: bit_rate,
            }),
            (_, _, false) => Err(PortError::Unhealthy {
                name,
                state: interface.state.unwrap_or("unknown"),
            }),
            (_, bit_rate, _) => Ok(SocketPort {
                interface: name,
                is_virtual: bit_rate.is_none(),
            }),
        }
    }
}

impl Port for SocketPort {
    fn endpoint(&self, ids: &[Id]) -> Result<Box<dyn CanBus>, BusError> {
        let io = |error: std::io::Error| BusError::from_io(&error);
        let socket = CanSocket::open(&self.interface).map_err(io)?;
        if !ids.is_empty() {
            let filters: Vec<CanFilter> = ids.iter().copied().map(filter).collect();
            socket.set_filters(&filters).map_err(io)?;
        }
        socket.set_error_filter_accept_all().map_err(io)?;
        socket.set_nonblocking(true).map_err(io)?;
        Ok(Box::new(SocketEndpoint { socket }))
    }

    fn claim(&self, node: u8) -> Result<Claim, NodeInUse> {
        Claim::new(&self.interface, node)
    }

    /// On a virtual interface only: on a real bus the error frame would be sent as a data frame.
    fn inject_condition(&self, condition: Condition) -> Result<(), BusError> {
        if !self.is_virtual {
            return Err(BusError::Other(libc::EOPNOTSUPP));
        }
        let io = |error: std::io::Error| BusError::from_io(&error);
        let (class, data) = condition.encode();
        let frame =
            CanErrorFrame::new_error(class, &data).map_err(|_| BusError::Other(libc::EINVAL))?;
        CanSocket::open(&self.interface)
            .and_then(|socket| socket.write_frame(&frame))
            .map_err(io)
    }
}

/// Exactly this identifier in exactly this format, data frames only.
fn filter(id: Id) -> CanFilter {
    let (format, width) = if id.is_extended() {
        (libc::CAN_EFF_FLAG, libc::CAN_EFF_MASK)
    } else {
        (0, libc::CAN_SFF_MASK)
    };
    CanFilter::new(
        id.raw() | format,
        width | libc::CAN_EFF_FLAG | libc::CAN_RTR_FLAG,
    )
}

struct SocketEndpoint {
    socket: CanSocket,
}

impl CanBus for SocketEndpoint {
    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        let raw = to_socketcan(frame).ok_or(BusError::Other(libc::EINVAL))?;
        self.socket
            .write_frame(&raw)
            .map_err(|error| BusError::from_io(&error))
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<BusEvent>, BusError> {
        let read = if timeout.is_zero() {
            self.socket.read_frame()
        } else {
            self.socket.read_frame_timeout(timeout)
        };
        match read {
            Ok(raw) => Ok(from_socketcan(&raw)),
            Err(error) if is_no_frame(&error) => Ok(None),
            Err(error) => Err(BusError::from_io(&error)),
        }
    }
}

/// Whether no frame arrived in time, which is not an error.
fn is_no_frame(error: &std::io::Error) -> bool {
    use std::io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), WouldBlock | TimedOut | Interrupted)
}

fn to_socketcan(frame: &CanFrame) -> Option<CanDataFrame> {
    let id = frame.id();
    let id: socketcan::Id = if id.is_extended() {
        socketcan::ExtendedId::new(id.raw())?.into()
    } else {
        socketcan::StandardId::new(id.raw() as u16)?.into()
    };
    CanDataFrame::new(id, frame.data())
}

/// Remote frames are ignored.
fn from_socketcan(raw: &Raw) -> Option<BusEvent> {
    match raw {
        Raw::Data(data) => {
            let id = if data.is_extended() {
                Id::extended(data.raw_id())
            } else {
                Id::standard(data.raw_id() as u16)
            };
            CanFrame::from_slice(id, data.data()).map(BusEvent::Frame)
        }
        Raw::Error(error) => Some(BusEvent::Condition(Condition::decode(
            error.error_bits(),
            error.data(),
        ))),
        Raw::Remote(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conversion_to_socketcan_and_back_preserves_frames() {
        for id in [
            Id::standard(0x7FF),
            Id::standard(5),
            Id::extended(5),
            Id::extended(0x1FFF_FFFF),
        ] {
            for length in 0..=8 {
                let frame = CanFrame::from_slice(id, &[0xA5; 8][..length]).unwrap();
                let raw = Raw::Data(to_socketcan(&frame).unwrap());
                assert_eq!(from_socketcan(&raw), Some(BusEvent::Frame(frame)));
            }
        }
    }

    #[test]
    fn error_frames_become_conditions() {
        let off = socketcan::CanErrorFrame::new_error(0x040, &[]).unwrap();
        assert_eq!(
            from_socketcan(&Raw::Error(off)),
            Some(BusEvent::Condition(Condition::BusOff))
        );
    }

    #[test]
    fn names_a_missing_interface() {
        let error = SocketPort::open("no-such-can", 1_000_000)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("no-such-can") && error.contains("ip link"),
            "{error}"
        );
    }

    #[test]
    fn rejects_a_network_interface_of_another_kind() {
        let error = SocketPort::open("lo", 1_000_000).unwrap_err().to_string();
        assert!(
            error.starts_with("CAN interface lo: this is another kind of network interface"),
            "{error}"
        );
    }
}
