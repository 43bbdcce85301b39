//! A bus in memory with a simulated clock.
//!
//! The time advances only while a caller sleeps or waits for a frame, in steps of 100 us. Each step runs all tasks in the
//! order in which they were started. Tests are therefore fast, repeatable and independent of the load of the machine.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::super::frame::{CanFrame, Id};
use super::{
    BusError, BusEvent, CanBus, Condition, Host, MemoryBus, MemoryEndpoint, Port, Task, TaskHandle,
};

const STEP_NS: u64 = 100_000;

/// A started task.
struct Slot {
    name: String,
    stop: Arc<AtomicBool>,
    /// Whether the task is skipped.
    hangs: bool,
    /// `None` while the task runs, and after its end.
    task: Option<Box<dyn Task>>,
}

/// A host with a simulated clock; clones share bus and clock.
#[derive(Clone, Default)]
pub struct SimulatedHost {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    bus: MemoryBus,
    now_ns: AtomicU64,
    tasks: Mutex<Vec<Slot>>,
}

impl SimulatedHost {
    /// The bus.
    pub fn bus(&self) -> &MemoryBus {
        &self.shared.bus
    }

    /// Lets all tasks with this name hang, as if their threads were blocked, or continue.
    pub fn set_hung(&self, name: &str, hangs: bool) {
        let mut tasks = self.tasks();
        let named = tasks.iter_mut().filter(|slot| slot.name == name);
        named.for_each(|slot| slot.hangs = hangs);
    }

    /// Advances the time by one step, then each task. A task may sleep: the other tasks advance meanwhile.
    fn advance(&self, deadline_ns: u64) {
        let now_ns = self.now_ns();
        let next_ns = deadline_ns.min(now_ns + STEP_NS).max(now_ns);
        self.shared.now_ns.store(next_ns, Ordering::Release);
        let count = self.tasks().len();
        for index in 0..count {
            let Some(mut task) = self.take_task(index) else {
                continue;
            };
            let _ = task.step(&|| self.now_ns(), Duration::ZERO); // a pause after an error is needed in real time only
            self.put_back(index, task);
        }
    }

    /// The task in a slot, unless it is running or hangs. A task that was stopped is dropped, after the list is unlocked.
    fn take_task(&self, index: usize) -> Option<Box<dyn Task>> {
        let (is_stopped, task) = {
            let mut tasks = self.tasks();
            let slot = tasks.get_mut(index).filter(|slot| !slot.hangs)?;
            (slot.stop.load(Ordering::Acquire), slot.task.take())
        };
        task.filter(|_| !is_stopped)
    }

    fn put_back(&self, index: usize, task: Box<dyn Task>) {
        if let Some(slot) = self.tasks().get_mut(index) {
            slot.task = Some(task);
        }
    }

    fn tasks(&self) -> std::sync::MutexGuard<'_, Vec<Slot>> {
        self.shared
            .tasks
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl Port for SimulatedHost {
    fn endpoint(&self, ids: &[Id]) -> Result<Box<dyn CanBus>, BusError> {
        Ok(Box::new(SimulatedEndpoint {
            host: self.clone(),
            inner: self.shared.bus.connect(ids),
        }))
    }

    fn inject_condition(&self, condition: Condition) -> Result<(), BusError> {
        Port::inject_condition(self.bus(), condition)
    }
}

impl Host for SimulatedHost {
    fn now_ns(&self) -> u64 {
        self.shared.now_ns.load(Ordering::Acquire)
    }

    fn sleep(&self, time: Duration) {
        let deadline_ns = self.now_ns().saturating_add(time.as_nanos() as u64);
        while self.now_ns() < deadline_ns {
            self.advance(deadline_ns);
        }
    }

    fn start(&self, name: &str, task: Box<dyn Task>) -> std::io::Result<TaskHandle> {
        let running = TaskHandle::default();
        self.tasks().push(Slot {
            name: name.into(),
            stop: Arc::clone(&running.stop),
            hangs: false,
            task: Some(task),
        });
        Ok(running)
    }
}

struct SimulatedEndpoint {
    host: SimulatedHost,
    inner: MemoryEndpoint,
}

impl CanBus for SimulatedEndpoint {
    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        self.inner.send(frame)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<BusEvent>, BusError> {
        let deadline_ns = self.host.now_ns().saturating_add(timeout.as_nanos() as u64);
        loop {
            match self.inner.receive(Duration::ZERO)? {
                None if self.host.now_ns() < deadline_ns => self.host.advance(deadline_ns),
                event => return Ok(event),
            }
        }
    }
}
