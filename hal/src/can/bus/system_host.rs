//! A port with the clock and the threads of the system.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::super::frame::Id;
use super::{BusError, CanBus, Claim, Condition, Host, NodeInUse, Port, Task, TaskHandle};

/// How long a task waits for a frame before it reads the clock again.
const WAIT: Duration = Duration::from_millis(1);

/// A port with the clock and the threads of the system.
pub struct SystemHost<P> {
    port: P,
    start: Instant,
    prepare: Arc<dyn Fn() + Send + Sync>,
}

impl<P: Port> SystemHost<P> {
    /// A host whose clock is 0 at this call.
    pub fn new(port: P) -> SystemHost<P> {
        SystemHost::since(port, Instant::now())
    }

    /// A host whose clock was 0 at `start`; hosts with the same `start` share a clock.
    pub fn since(port: P, start: Instant) -> SystemHost<P> {
        SystemHost {
            port,
            start,
            prepare: Arc::new(|| {}),
        }
    }

    /// `prepare` runs first in each thread that is started, to give it a priority or a processor.
    #[must_use]
    pub fn prepared(self, prepare: impl Fn() + Send + Sync + 'static) -> SystemHost<P> {
        SystemHost {
            prepare: Arc::new(prepare),
            ..self
        }
    }
}

fn since_ns(start: Instant) -> u64 {
    start.elapsed().as_nanos() as u64
}

impl<P: Port> Port for SystemHost<P> {
    fn endpoint(&self, ids: &[Id]) -> Result<Box<dyn CanBus>, BusError> {
        self.port.endpoint(ids)
    }

    fn claim(&self, node: u8) -> Result<Claim, NodeInUse> {
        self.port.claim(node)
    }

    fn inject_condition(&self, condition: Condition) -> Result<(), BusError> {
        self.port.inject_condition(condition)
    }
}

impl<P: Port> Host for SystemHost<P> {
    fn now_ns(&self) -> u64 {
        since_ns(self.start)
    }

    fn sleep(&self, time: Duration) {
        std::thread::sleep(time);
    }

    fn start(&self, name: &str, mut task: Box<dyn Task>) -> std::io::Result<TaskHandle> {
        let mut running = TaskHandle::default();
        let (stop, start) = (Arc::clone(&running.stop), self.start);
        let prepare = Arc::clone(&self.prepare);
        let builder = std::thread::Builder::new().name(name.to_owned());
        let thread = builder.spawn(move || {
            prepare();
            while !stop.load(Ordering::Acquire) {
                if task.step(&|| since_ns(start), WAIT).is_err() {
                    std::thread::sleep(WAIT); // an interface that is down fails without waiting
                }
            }
        });
        running.thread = Some(thread?);
        Ok(running)
    }
}
