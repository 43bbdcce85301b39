//! Connects an emulated amplifier to a bus.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::super::bus::{BusError, BusEvent, CanBus, Host, Task, TaskHandle};
use super::super::frame::CanFrame;
use super::amplifier::EmulatedAmplifier;

/// Largest number of frames per step, so that the time also advances on a flooded bus.
const FRAMES_MAX: usize = 256;

/// Time and counts after a frame was received or the time was advanced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// Time of the host's clock.
    pub now_ns: u64,
    /// Frames received since the start.
    pub received: u64,
    /// Frames sent since the start.
    pub sent: u64,
}

/// Called after every frame and every step of the time, in the thread of the device.
pub type Observer = Box<dyn FnMut(FrameCounts, &mut dyn EmulatedAmplifier) + Send>;

/// An emulated amplifier on a bus. The device is shared, so that a test can read its current and inject faults.
pub struct AmplifierTask {
    bus: Box<dyn CanBus>,
    device: Arc<Mutex<dyn EmulatedAmplifier>>,
    observer: Observer,
    counts: FrameCounts,
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

    /// As [`start`](AmplifierTask::start), with an observer, for example a simulated motor that is driven by the device.
    pub fn start_observed(
        host: &dyn Host,
        device: Arc<Mutex<dyn EmulatedAmplifier>>,
        observer: Observer,
    ) -> std::io::Result<TaskHandle> {
        let bus = host.endpoint(&[]).map_err(std::io::Error::other)?;
        let task = AmplifierTask {
            bus,
            device,
            observer,
            counts: FrameCounts::default(),
            out: Vec::new(),
        };
        host.start("can-emulator", Box::new(task))
    }

    /// Receives all frames, waiting up to `wait` for the first.
    fn receive(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        let mut event = self.bus.receive(wait)?;
        for _ in 0..FRAMES_MAX {
            match event {
                Some(BusEvent::Frame(frame)) => self.handle(&frame, now_ns()),
                Some(BusEvent::Condition(_)) => {}
                None => break,
            }
            event = self.bus.receive(Duration::ZERO)?;
        }
        Ok(())
    }

    fn handle(&mut self, frame: &CanFrame, now_ns: u64) {
        let mut device = lock(&self.device);
        device.handle(frame, now_ns, &mut self.out);
        self.counts.received += 1;
        self.counts.now_ns = now_ns;
        (self.observer)(self.counts, &mut *device);
    }

    fn poll(&mut self, now_ns: u64) {
        let mut device = lock(&self.device);
        device.poll(now_ns, &mut self.out);
        self.counts.now_ns = now_ns;
        (self.observer)(self.counts, &mut *device);
    }

    fn send(&mut self) -> Result<(), BusError> {
        for frame in self.out.drain(..) {
            self.bus.send(&frame)?;
            self.counts.sent += 1;
        }
        Ok(())
    }
}

impl Task for AmplifierTask {
    fn step(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        let received = self.receive(now_ns, wait);
        self.poll(now_ns());
        let sent = self.send();
        received.and(sent)
    }
}

fn lock<'a>(
    device: &'a Mutex<dyn EmulatedAmplifier + 'static>,
) -> MutexGuard<'a, dyn EmulatedAmplifier + 'static> {
    device.lock().unwrap_or_else(PoisonError::into_inner)
}
