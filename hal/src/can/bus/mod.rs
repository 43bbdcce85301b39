//! Where frames go and come from, whose clock it is, and who runs the service task.
//!
//! A [`Host`] is all a driver needs of the world. [`SystemHost`] is the real one: the system's clock and threads around a
//! [`Port`], which is a SocketCAN interface ([`SocketPort`]) or a bus in memory ([`MemoryBus`]). [`SimulatedHost`] is a bus in
//! memory with a clock of its own: tests run through it in no time and always alike.

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

/// What comes from a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusEvent {
    /// A frame of another node.
    Frame(CanFrame),
    /// The controller tells of the bus or of itself (an error frame of SocketCAN).
    Condition(Condition),
}

/// A bus did not do as told. Small and static: it is made inside the tick.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum BusError {
    /// The transmit queue is full: nobody takes the frames, or there are too many.
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
    /// Anything else, with the system's number.
    #[error("the CAN interface failed with errno {0}")]
    Other(i32),
}

impl BusError {
    /// From a system error.
    pub fn from_io(error: &std::io::Error) -> BusError {
        match error.raw_os_error() {
            Some(libc::ENOBUFS | libc::EAGAIN) => BusError::QueueFull,
            Some(libc::ENETDOWN) => BusError::Down,
            Some(libc::ENODEV | libc::ENXIO) => BusError::Gone,
            number => BusError::Other(number.unwrap_or(0)),
        }
    }
}

/// One connection to a bus. It does not hear itself.
pub trait CanBus: Send {
    /// Queues a frame; never waits. *In the tick.* Success says only that the frame was queued.
    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError>;

    /// The next event, waiting up to `timeout` for it; `None` if there was none.
    fn receive(&mut self, timeout: Duration) -> Result<Option<BusEvent>, BusError>;
}

/// Makes connections to one bus.
pub trait Port: Send + Sync {
    /// A connection that hears the identifiers `ids` (all, if there are none) and all conditions.
    fn endpoint(&self, ids: &[Id]) -> Result<Box<dyn CanBus>, BusError>;

    /// Claims a node of this bus for this process, or names the process that has it.
    fn claim(&self, node: u8) -> Result<Claim, NodeInUse> {
        let _ = node;
        Ok(Claim::none())
    }

    /// Tells every endpoint of a condition that its controller did not find, for rehearsals. Not every bus can.
    fn tell(&self, condition: Condition) -> Result<(), BusError> {
        let _ = condition;
        Err(BusError::Other(libc::EOPNOTSUPP))
    }
}

/// Work that goes on beside the tick.
pub trait Task: Send {
    /// Takes what has come, waiting up to `wait` for it, then does what is due. `now_ns` is the host's clock. An error
    /// makes the host pause before the next step.
    fn step(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError>;
}

/// The world of a driver.
pub trait Host: Port {
    /// Time since some fixed moment, in nanoseconds.
    fn now_ns(&self) -> u64;

    /// Lets time pass. Not in the tick.
    fn sleep(&self, time: Duration);

    /// Runs a task until the handle is dropped.
    fn start(&self, name: &str, task: Box<dyn Task>) -> std::io::Result<TaskHandle>;
}

/// A task at work; dropping it ends the task and waits for its end.
#[derive(Debug, Default)]
pub struct TaskHandle {
    stop: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Drop for TaskHandle {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // a task that panicked has said so already
        }
    }
}

#[cfg(test)]
mod tests;
