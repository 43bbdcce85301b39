//! A bus in memory that joins any number of endpoints, for tests and rehearsal.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::super::frame::{CanFrame, Id};
use super::{BusError, BusEvent, CanBus, Condition, Port};

/// Largest number of events in the queue of an endpoint; further ones are lost, as in a socket that is not read.
const QUEUE_MAX: usize = 10_000;

/// A bus; clones are the same bus.
#[derive(Clone, Debug, Default)]
pub struct MemoryBus {
    wire: Arc<Mutex<Wire>>,
}

#[derive(Debug, Default)]
struct Wire {
    mailboxes: Vec<Arc<Mailbox>>,
    is_down: bool,
}

#[derive(Debug)]
struct Mailbox {
    ids: Vec<Id>,
    queue: Mutex<VecDeque<BusEvent>>,
    arrived: Condvar,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl MemoryBus {
    /// A new endpoint that receives `ids`, or all identifiers if empty.
    pub fn connect(&self, ids: &[Id]) -> MemoryEndpoint {
        let mailbox = Arc::new(Mailbox {
            ids: ids.to_vec(),
            queue: Mutex::default(),
            arrived: Condvar::new(),
        });
        lock(&self.wire).mailboxes.push(Arc::clone(&mailbox));
        MemoryEndpoint {
            bus: self.clone(),
            mailbox,
        }
    }

    /// Sends a condition to all endpoints, as their controllers would do.
    pub fn inject_condition(&self, condition: Condition) {
        for mailbox in &lock(&self.wire).mailboxes {
            mailbox.put(BusEvent::Condition(condition));
        }
    }

    /// Sets the interface down or up; while it is down all endpoints fail.
    pub fn set_down(&self, is_down: bool) {
        lock(&self.wire).is_down = is_down;
    }

    fn deliver(&self, frame: &CanFrame, from: &Arc<Mailbox>) -> Result<(), BusError> {
        let wire = lock(&self.wire);
        if wire.is_down {
            return Err(BusError::Down);
        }
        let others = wire
            .mailboxes
            .iter()
            .filter(|mailbox| !Arc::ptr_eq(mailbox, from));
        others
            .filter(|mailbox| mailbox.accepts(frame.id()))
            .for_each(|mailbox| mailbox.put(BusEvent::Frame(*frame)));
        Ok(())
    }
}

impl Port for MemoryBus {
    fn endpoint(&self, ids: &[Id]) -> Result<Box<dyn CanBus>, BusError> {
        Ok(Box::new(self.connect(ids)))
    }

    fn inject_condition(&self, condition: Condition) -> Result<(), BusError> {
        MemoryBus::inject_condition(self, condition);
        Ok(())
    }
}

impl Mailbox {
    fn accepts(&self, id: Id) -> bool {
        self.ids.is_empty() || self.ids.contains(&id)
    }

    fn put(&self, event: BusEvent) {
        let mut queue = lock(&self.queue);
        if queue.len() < QUEUE_MAX {
            queue.push_back(event);
            self.arrived.notify_one();
        }
    }
}

/// A connection to a [`MemoryBus`].
#[derive(Debug)]
pub struct MemoryEndpoint {
    bus: MemoryBus,
    mailbox: Arc<Mailbox>,
}

impl CanBus for MemoryEndpoint {
    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        self.bus.deliver(frame, &self.mailbox)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<BusEvent>, BusError> {
        if lock(&self.bus.wire).is_down {
            return Err(BusError::Down);
        }
        let queue = lock(&self.mailbox.queue);
        let waiting = self
            .mailbox
            .arrived
            .wait_timeout_while(queue, timeout, |queue| queue.is_empty());
        let (mut queue, _) = waiting.unwrap_or_else(PoisonError::into_inner);
        Ok(queue.pop_front())
    }
}

impl Drop for MemoryEndpoint {
    fn drop(&mut self) {
        lock(&self.bus.wire)
            .mailboxes
            .retain(|mailbox| !Arc::ptr_eq(mailbox, &self.mailbox));
    }
}
