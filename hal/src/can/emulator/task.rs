//! Joins an acting amplifier to a bus.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::super::bus::{BusError, BusEvent, CanBus, Host, Task, TaskHandle};
use super::super::frame::CanFrame;
use super::EmulatedAmplifier;

/// Frames taken in one step, so that a flooded bus cannot stop time.
const MOST_FRAMES: usize = 256;

/// The moment in which an acting device has just heard a frame, or has let time pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// The host's clock.
    pub now_ns: u64,
    /// Frames heard since the start.
    pub received: u64,
    /// Frames sent since the start.
    pub sent: u64,
}

/// Sees the device after every frame and every step of time, in the device's thread.
pub type Observer = Box<dyn FnMut(FrameCounts, &mut dyn EmulatedAmplifier) + Send>;

/// An acting amplifier on a bus. The device is shared: a test asks it for its current and makes it misbehave.
pub struct AmplifierTask {
    bus: Box<dyn CanBus>,
    device: Arc<Mutex<dyn EmulatedAmplifier>>,
    follow: Observer,
    passed: FrameCounts,
    out: Vec<CanFrame>,
}

impl AmplifierTask {
    /// Starts `device` on the bus of `host`; it runs until the handle is dropped.
    pub fn start<D: EmulatedAmplifier + 'static>(
        host: &dyn Host,
        device: Arc<Mutex<D>>,
    ) -> std::io::Result<TaskHandle> {
        AmplifierTask::start_observed(host, device, Box::new(|_, _| {}))
    }

    /// The same; `follow` sees what the device does, so that a motor can be moved by it.
    pub fn start_observed(
        host: &dyn Host,
        device: Arc<Mutex<dyn EmulatedAmplifier>>,
        follow: Observer,
    ) -> std::io::Result<TaskHandle> {
        let bus = host.endpoint(&[]).map_err(std::io::Error::other)?;
        let task = AmplifierTask {
            bus,
            device,
            follow,
            passed: FrameCounts::default(),
            out: Vec::new(),
        };
        host.start("can-device", Box::new(task))
    }

    /// Takes what has come, the first within `wait`.
    fn take(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        let mut event = self.bus.receive(wait)?;
        for _ in 0..MOST_FRAMES {
            match event {
                Some(BusEvent::Frame(frame)) => self.hear(&frame, now_ns()),
                Some(BusEvent::Condition(_)) => {}
                None => break,
            }
            event = self.bus.receive(Duration::ZERO)?;
        }
        Ok(())
    }

    fn hear(&mut self, frame: &CanFrame, now_ns: u64) {
        let mut device = lock(&self.device);
        device.handle(frame, now_ns, &mut self.out);
        self.passed.received += 1;
        self.passed.now_ns = now_ns;
        (self.follow)(self.passed, &mut *device);
    }

    fn poll(&mut self, now_ns: u64) {
        let mut device = lock(&self.device);
        device.poll(now_ns, &mut self.out);
        self.passed.now_ns = now_ns;
        (self.follow)(self.passed, &mut *device);
    }
}

impl Task for AmplifierTask {
    fn step(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        let taken = self.take(now_ns, wait);
        self.poll(now_ns());
        let (bus, passed) = (&mut self.bus, &mut self.passed);
        let sent = self
            .out
            .drain(..)
            .try_for_each(|frame| bus.send(&frame).map(|()| passed.sent += 1));
        taken.and(sent)
    }
}

fn lock<'a>(
    device: &'a Mutex<dyn EmulatedAmplifier + 'static>,
) -> MutexGuard<'a, dyn EmulatedAmplifier + 'static> {
    device.lock().unwrap_or_else(PoisonError::into_inner)
}
