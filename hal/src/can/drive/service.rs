//! The monitor on a bus.

use std::time::Duration;

use super::super::bus::{BusError, BusEvent, CanBus, Task};
use super::monitor::Monitor;

/// Events taken in one step, so that a flooded bus cannot keep our heartbeat from going out.
const MOST_EVENTS: usize = 256;

pub(super) struct Service {
    pub(super) bus: Box<dyn CanBus>,
    pub(super) monitor: Monitor,
}

impl Service {
    fn take(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        let mut event: Option<BusEvent> = self.bus.receive(wait)?;
        for _ in 0..MOST_EVENTS {
            let Some(came) = event else { break };
            self.monitor.handle(&came, now_ns());
            event = self.bus.receive(Duration::ZERO)?;
        }
        Ok(())
    }
}

impl Task for Service {
    fn step(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        let taken = self.take(now_ns, wait);
        if let Err(error) = taken {
            self.monitor.fail(error);
        }
        let bus = &mut self.bus;
        // A frame that does not go out needs no notice here: what it should have caused is watched.
        self.monitor.poll(now_ns(), &mut |frame| {
            let _ = bus.send(&frame);
        });
        taken
    }
}
