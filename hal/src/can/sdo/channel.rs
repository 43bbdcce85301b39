//! Successive transfers over a bus, with a time limit for each answer.

use std::time::Duration;

use thiserror::Error;

use super::super::bus::{BusError, BusEvent, CanBus, Host};
use super::super::frame::CanFrame;
use super::{AbortCode, Address, Client, Failure, Progress, answer_id, request_id};

/// A transfer that failed.
#[derive(Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum SdoError {
    /// The node aborted the transfer.
    #[error(
        "node {node} refuses {address}: {code}; check that the drive supports this object and its value"
    )]
    Aborted {
        /// The node.
        node: u8,
        /// The object.
        address: Address,
        /// The abort code.
        code: AbortCode,
    },
    /// The node violated the protocol.
    #[error(
        "node {node} violates the SDO protocol for {address}: {code}; look for a second node with the same number"
    )]
    Protocol {
        /// The node.
        node: u8,
        /// The object.
        address: Address,
        /// The violated rule.
        code: AbortCode,
    },
    /// The node did not answer.
    #[error(
        "node {node} did not answer to {address} within {timeout_ms} ms; check its power, node number, bit rate and the bus termination"
    )]
    Timeout {
        /// The node.
        node: u8,
        /// The object.
        address: Address,
        /// The limit, in milliseconds.
        timeout_ms: u128,
    },
    /// The value of an object has the wrong length.
    #[error(
        "node {node} sent {have} bytes for {address}, expected {want}; check the type of the drive"
    )]
    Length {
        /// The node.
        node: u8,
        /// The object.
        address: Address,
        /// Bytes received.
        have: usize,
        /// Bytes expected.
        want: usize,
    },
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
}

impl SdoError {
    /// Whether the node does not have the object.
    pub fn means_absent(&self) -> bool {
        matches!(self, SdoError::Aborted { code, .. } if code.means_absent())
    }
}

/// The SDO connection to one node. `bus` must receive [`answer_id`] of the node.
pub struct Channel<'a> {
    /// The bus.
    pub bus: &'a mut dyn CanBus,
    /// The host, for its clock.
    pub host: &'a dyn Host,
    /// The node.
    pub node: u8,
    /// Time limit of each answer.
    pub timeout: Duration,
}

impl Channel<'_> {
    /// Reads the bytes of an object.
    pub fn read(&mut self, address: Address) -> Result<Vec<u8>, SdoError> {
        let (client, first) = Client::upload(address);
        self.transfer(client, first, address)
    }

    /// Reads an unsigned number of `N` bytes.
    fn read_number<const N: usize>(&mut self, address: Address) -> Result<[u8; N], SdoError> {
        let bytes = self.read(address)?;
        let have = bytes.len();
        bytes.try_into().map_err(|_| SdoError::Length {
            node: self.node,
            address,
            have,
            want: N,
        })
    }

    /// Reads a u8.
    pub fn read_u8(&mut self, address: Address) -> Result<u8, SdoError> {
        self.read_number(address).map(u8::from_le_bytes)
    }

    /// Reads a u16.
    pub fn read_u16(&mut self, address: Address) -> Result<u16, SdoError> {
        self.read_number(address).map(u16::from_le_bytes)
    }

    /// Reads a u32.
    pub fn read_u32(&mut self, address: Address) -> Result<u32, SdoError> {
        self.read_number(address).map(u32::from_le_bytes)
    }

    /// Writes the bytes of an object.
    pub fn write(&mut self, address: Address, data: &[u8]) -> Result<(), SdoError> {
        let (client, first) = Client::download(address, data);
        self.transfer(client, first, address).map(|_| ())
    }

    fn transfer(
        &mut self,
        mut client: Client,
        first: [u8; 8],
        address: Address,
    ) -> Result<Vec<u8>, SdoError> {
        self.discard_earlier_answers()?;
        self.send(first)?;
        let mut deadline_ns = self.deadline_ns();
        loop {
            let Some(frame) = self.receive(deadline_ns)? else {
                self.send(client.time_out())?;
                return Err(SdoError::Timeout {
                    node: self.node,
                    address,
                    timeout_ms: self.timeout.as_millis(),
                });
            };
            match client.answer(frame.data()) {
                Progress::Send(next) => {
                    self.send(next)?;
                    deadline_ns = self.deadline_ns();
                }
                Progress::Done(data) => return Ok(data),
                Progress::Ignored => {}
                Progress::Failed(failure, abort) => {
                    return Err(self.fail(failure, abort, address));
                }
            }
        }
    }

    fn fail(&mut self, failure: Failure, abort: Option<[u8; 8]>, address: Address) -> SdoError {
        let node = self.node;
        if let Some(bytes) = abort {
            let _ = self.send(bytes); // the transfer has failed already; if this is lost, the node times out
        }
        match failure {
            Failure::Aborted(code) => SdoError::Aborted {
                node,
                address,
                code,
            },
            Failure::Protocol(code) => SdoError::Protocol {
                node,
                address,
                code,
            },
        }
    }

    /// Discards answers that arrived after their time limit. Their number is limited, because a faulty node may send without end.
    fn discard_earlier_answers(&mut self) -> Result<(), SdoError> {
        for _ in 0..1000 {
            if self.bus.receive(Duration::ZERO)?.is_none() {
                break;
            }
        }
        Ok(())
    }

    fn deadline_ns(&self) -> u64 {
        self.host
            .now_ns()
            .saturating_add(self.timeout.as_nanos() as u64)
    }

    fn send(&mut self, bytes: [u8; 8]) -> Result<(), SdoError> {
        Ok(self
            .bus
            .send(&CanFrame::new(request_id(self.node), bytes))?)
    }

    /// The next answer of the node before the deadline.
    fn receive(&mut self, deadline_ns: u64) -> Result<Option<CanFrame>, SdoError> {
        loop {
            let left = Duration::from_nanos(deadline_ns.saturating_sub(self.host.now_ns()));
            match self.bus.receive(left)? {
                Some(BusEvent::Frame(frame)) if frame.id() == answer_id(self.node) => {
                    return Ok(Some(frame));
                }
                _ if self.host.now_ns() >= deadline_ns => return Ok(None),
                _ => {}
            }
        }
    }
}
