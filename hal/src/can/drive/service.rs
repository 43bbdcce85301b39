//! The service thread: connects the monitor to a bus.

use std::time::Duration;

use super::super::bus::{BusError, CanBus, Task};
use super::monitor::Monitor;

/// Largest number of events per step, so that the heartbeat is sent on a flooded bus as well.
const EVENTS_MAX: usize = 256;

pub(super) struct Service {
    pub(super) bus: Box<dyn CanBus>,
    pub(super) monitor: Monitor,
}

impl Service {
    fn receive(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        let mut next = self.bus.receive(wait)?;
        for _ in 0..EVENTS_MAX {
            let Some(event) = next else { break };
            self.monitor.handle(&event, now_ns());
            next = self.bus.receive(Duration::ZERO)?;
        }
        Ok(())
    }
}

impl Task for Service {
    fn step(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        let received = self.receive(now_ns, wait);
        if let Err(error) = received {
            self.monitor.fail(error);
        }
        let bus = &mut self.bus;
        // An error of `send` is not reported here: the monitor notices that the frame had no effect.
        self.monitor.poll(now_ns(), &mut |frame| {
            let _ = bus.send(&frame);
        });
        received
    }
}
