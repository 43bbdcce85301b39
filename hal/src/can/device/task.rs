//! Joins the simulated drive to a bus.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::super::bus::{BusError, BusEvent, CanBus, Host, Running, Task};
use super::super::frame::CanFrame;
use super::Device;

/// Frames taken in one step, so that a flooded bus cannot stop time.
const MOST_FRAMES: usize = 256;

/// A simulated drive on a bus. The device is shared: a test asks it for its current and makes it misbehave.
pub struct DeviceTask {
    bus: Box<dyn CanBus>,
    device: Arc<Mutex<Device>>,
    out: Vec<CanFrame>,
}

impl DeviceTask {
    /// Starts `device` on the bus of `host`; it runs until the handle is dropped.
    pub fn start(host: &dyn Host, device: Arc<Mutex<Device>>) -> std::io::Result<Running> {
        let bus = host.endpoint(&[]).map_err(std::io::Error::other)?;
        host.start("can-device", Box::new(DeviceTask { bus, device, out: Vec::new() }))
    }

    /// Takes what has come, the first within `wait`.
    fn take(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        let mut event = self.bus.receive(wait)?;
        for _ in 0..MOST_FRAMES {
            match event {
                Some(BusEvent::Frame(frame)) => lock(&self.device).handle(&frame, now_ns(), &mut self.out),
                Some(BusEvent::Condition(_)) => {}
                None => break,
            }
            event = self.bus.receive(Duration::ZERO)?;
        }
        Ok(())
    }
}

impl Task for DeviceTask {
    fn step(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        let taken = self.take(now_ns, wait);
        lock(&self.device).poll(now_ns(), &mut self.out);
        let bus = &mut self.bus;
        let sent = self.out.drain(..).try_for_each(|frame| bus.send(&frame));
        taken.and(sent)
    }
}

fn lock(device: &Mutex<Device>) -> MutexGuard<'_, Device> {
    device.lock().unwrap_or_else(PoisonError::into_inner)
}
