//! Access to a CAN bus, the clock, and the threads of a driver.
//!
//! A driver uses a [`Host`]. [`SystemHost`] has the system's clock and threads around a [`Port`], which is a SocketCAN
//! interface ([`SocketPort`]) or a bus in memory ([`MemoryBus`]). [`SimulatedHost`] is a bus in memory with a simulated clock:
//! tests with it are fast and repeatable.

mod claim;
mod condition;
mod interface;
mod kernel;
mod memory;
mod simulated_host;
mod socket;
mod system_host;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use thiserror::Error;

pub use claim::{Claim, NodeInUse};
pub use condition::Condition;
pub use interface::{Interface, InterfaceError};
pub use kernel::{KernelError, check_can_support};
pub use memory::{MemoryBus, MemoryEndpoint};
pub use simulated_host::SimulatedHost;
pub use socket::{PortError, SocketPort};
pub use system_host::SystemHost;

use super::frame::{CanFrame, Id};

/// Something received from a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusEvent {
    /// A frame of another node.
    Frame(CanFrame),
    /// A condition of the bus or of the controller (an error frame of SocketCAN).
    Condition(Condition),
}

/// Error of a bus. Small and static, because it is created in the tick.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum BusError {
    /// The transmit queue is full: no other node acknowledges the frames, or there are too many.
    #[error(
        "the transmit queue of the CAN interface is full; check that another node is on the bus and powered"
    )]
    QueueFull,
    /// The interface is down.
    #[error("the CAN interface is down; bring it up with `ip link set IFACE up`")]
    Down,
    /// The interface is gone.
    #[error("the CAN interface is gone; plug the adapter in again")]
    Gone,
    /// Another error, with the number of the system.
    #[error("the CAN interface failed with errno {0}; read the messages of the kernel (dmesg)")]
    Other(i32),
}

impl BusError {
    /// Converts a system error.
    pub fn from_io(error: &std::io::Error) -> BusError {
        match error.raw_os_error() {
            Some(libc::ENOBUFS | libc::EAGAIN) => BusError::QueueFull,
            Some(libc::ENETDOWN) => BusError::Down,
            Some(libc::ENODEV | libc::ENXIO) => BusError::Gone,
            number => BusError::Other(number.unwrap_or(0)),
        }
    }
}

/// A connection to a bus. It does not receive its own frames.
pub trait CanBus: Send {
    /// Queues a frame without waiting; called in the tick. Success means only that the frame was queued.
    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError>;

    /// The next event that arrives within `timeout`; `None` if there is none.
    fn receive(&mut self, timeout: Duration) -> Result<Option<BusEvent>, BusError>;
}

/// Creates connections to a bus.
pub trait Port: Send + Sync {
    /// A connection that receives the identifiers `ids` (all if empty) and all conditions.
    fn endpoint(&self, ids: &[Id]) -> Result<Box<dyn CanBus>, BusError>;

    /// Claims a node of this bus for this process. The error names the process that has it.
    fn claim(&self, node: u8) -> Result<Claim, NodeInUse> {
        let _ = node;
        Ok(Claim::none())
    }

    /// Sends a condition to every endpoint as if its controller had detected it, for rehearsals. Not supported by every bus.
    fn inject_condition(&self, condition: Condition) -> Result<(), BusError> {
        let _ = condition;
        Err(BusError::Other(libc::EOPNOTSUPP))
    }
}

/// A task that runs in its own thread, in parallel with the loop.
pub trait Task: Send {
    /// Processes received events, waiting up to `wait` for the first, then does what is due. `now_ns` is the clock of the host.
    /// After an error the host pauses before the next step.
    fn step(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError>;
}

/// A bus with a clock and threads.
pub trait Host: Port {
    /// Time since a fixed moment, in nanoseconds.
    fn now_ns(&self) -> u64;

    /// Blocks the caller for `time`; must not be called in the tick.
    fn sleep(&self, time: Duration);

    /// Runs a task until the handle is dropped.
    fn start(&self, name: &str, task: Box<dyn Task>) -> std::io::Result<TaskHandle>;
}

/// A running task; dropping the handle ends the task and waits for its end.
#[derive(Debug, Default)]
pub struct TaskHandle {
    stop: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Drop for TaskHandle {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // a panic was reported by the task itself
        }
    }
}

#[cfg(test)]
mod tests;
