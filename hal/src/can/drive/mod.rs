//! A CANopen drive as a current amplifier.
//!
//! ```text
//!   loop's thread   enable  command  disable  status        service thread            reset thread
//!                     |        |        |       ^             |  (monitor)               |  SDO, NMT
//!                 set-points   |        |       |  atomics    |  status, EMCY,           |  fault reset
//!                     v        v        v       +-------------+  heartbeat, errors,      |
//!                                                             |  `disable voltage`       |
//!   =========================================== bus ============================================
//! ```
//!
//! Each thread has its own connection to the bus, with its own filters. The state of the drive is judged by received frames,
//! never by the result of a write. The drive monitors the heartbeat of this program. The service thread ends this heartbeat if
//! the drive does not confirm that it is off. Thus the current is stopped whichever part fails: loop, process, cable or drive.

mod access;
mod errors;
pub mod faults;
mod inspect;
mod monitor;
mod reset;
mod service;
mod settings;
mod setup;
mod shared;
mod transitions;

use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::Poll;

pub use errors::OpenError;
pub use faults::fault_text;
pub use inspect::{ABORT_CONNECTION, Inspection, REQUIRED_OBJECTS, inspect};
pub use settings::{DriveSettings, DriveTimes, ExpectedIdentity, TorqueMode};

use self::access::{channel, configure, exchange, wait_for};
use self::monitor::{Monitor, received_ids};
use self::reset::{ResetOutcome, ResetTask};
use self::service::Service;
use self::setup::Configured;
use self::shared::{Intent, Shared};
use super::bus::{CanBus, Claim, Host, TaskHandle};
use super::cia402::{DISABLE_VOLTAGE, ENABLE_OPERATION};
use super::nmt;
use super::objects::HEARTBEAT_CONSUMER;
use super::sdo::answer_id;
use crate::{AmplifierStatus, CurrentAmplifier, DeviceError, FaultText};

/// Times of a transition to Operation Enabled, on the clock of the host.
#[derive(Clone, Copy, Debug, Default)]
struct Enabling {
    deadline_ns: u64,
    /// When the next controlword is due.
    step_ns: u64,
}

/// A CANopen drive in torque mode. The module documentation describes how it is monitored.
pub struct CanopenDrive {
    service: TaskHandle, // first, so that it ends before the claim does
    reset: TaskHandle,
    bus: Box<dyn CanBus>,
    host: Arc<dyn Host>,
    shared: Arc<Shared>,
    settings: DriveSettings,
    configured: Configured,
    enabling: Enabling,
    is_resetting: bool,
    outcomes: Receiver<ResetOutcome>,
    last_error: Arc<Mutex<Option<OpenError>>>,
    _claim: Claim,
}

impl CanopenDrive {
    /// Claims the node, configures the drive and verifies the configuration. Afterwards the drive is operational and off.
    pub fn open(settings: DriveSettings, host: Box<dyn Host>) -> Result<CanopenDrive, OpenError> {
        settings.check()?;
        let host: Arc<dyn Host> = Arc::from(host);
        let claim = host.claim(settings.node)?;
        let answers = [answer_id(settings.node)];
        let mut bus = host.endpoint(&answers)?;
        let watched = host.endpoint(&received_ids(settings.node))?;
        let configured = configure(&settings, bus.as_mut(), host.as_ref())?;
        let shared = Arc::new(Shared::default());
        let service = start_service(&settings, watched, &shared, host.as_ref())?;
        shared.set_restarted(false);
        let (sender, outcomes) = sync_channel(1);
        let last_error = Arc::default();
        let mut reset = ResetTask {
            bus: host.endpoint(&answers)?,
            host: Arc::clone(&host),
            shared: Arc::clone(&shared),
            settings: settings.clone(),
            configured,
            last_error: Arc::clone(&last_error),
            outcomes: sender,
            done: 0,
        };
        reset.start()?;
        let reset = host.start("can-reset", Box::new(reset));
        Ok(CanopenDrive {
            service,
            reset: reset.map_err(OpenError::Thread)?,
            bus,
            host,
            shared,
            settings,
            configured,
            enabling: Enabling::default(),
            is_resetting: false,
            outcomes,
            last_error,
            _claim: claim,
        })
    }

    /// The active mode of operation: 10 is cyclic synchronous torque, 4 is profile torque.
    pub fn mode(&self) -> i8 {
        self.configured.mode
    }

    /// Vendor, product, revision and serial number (0x1018), as far as the drive has them.
    pub fn identity(&self) -> [Option<u32>; 4] {
        self.configured.identity
    }

    /// The smallest step of the current, in amperes.
    pub fn step_a(&self) -> f64 {
        self.configured.scale.step_a()
    }

    /// Why the drive did not accept its configuration again. It complements [`DeviceError`], which has static text only.
    /// Not for the tick: it locks and allocates.
    pub fn last_error(&self) -> Option<String> {
        let last = self.last_error.lock();
        let last = last.unwrap_or_else(PoisonError::into_inner);
        last.as_ref().map(OpenError::to_string)
    }

    /// Sends a set-point, and SYNC if the exchange is synchronous. Called in the tick: must not allocate or block.
    fn exchange(&mut self, controlword: u16, target: i16) -> Result<(), DeviceError> {
        exchange(self.bus.as_mut(), &self.settings, controlword, target)
    }

    /// The outcome of the reset, if it has ended.
    fn take_outcome(&mut self) -> Option<u32> {
        let ResetOutcome { code, configured } = self.outcomes.try_recv().ok()?;
        self.is_resetting = false;
        self.configured = configured;
        Some(code)
    }

    /// Code of the fault, 0 if there is none. If the service thread hangs, the stored state is outdated, which is a fault as well.
    /// Called in the tick: must not allocate or block.
    fn fault(&self) -> u32 {
        let (now_ns, timeout) = (self.host.now_ns(), self.settings.times.pass_timeout);
        match self.shared.fault() {
            0 if self.shared.last_pass.is_overdue(now_ns, timeout) => faults::SERVICE_HUNG,
            code => code,
        }
    }

    fn no_fault(&self) -> Result<(), DeviceError> {
        match self.fault() {
            0 => Ok(()),
            code => Err(faults::device_error(code)),
        }
    }

    /// Switches the drive off, ends its monitoring of the heartbeat, and enters pre-operational.
    fn shut_down(&mut self) {
        self.disable();
        let limit = self.settings.times.state_timeout;
        let is_off = wait_for(self.host.as_ref(), &self.shared, limit, Shared::has_settled);
        if is_off && self.shared.fault() == 0 {
            let mut channel = channel(&self.settings, self.bus.as_mut(), self.host.as_ref());
            let _ = channel.write(HEARTBEAT_CONSUMER, &[0; 4]); // if it fails, the drive only reports a lost heartbeat
            let stop = nmt::Command::EnterPreOperational.frame(self.settings.node);
            let _ = self.bus.send(&stop); // the drive is off already
        }
    }
}

fn start_service(
    settings: &DriveSettings,
    bus: Box<dyn CanBus>,
    shared: &Arc<Shared>,
    host: &dyn Host,
) -> Result<TaskHandle, OpenError> {
    let now_ns = host.now_ns();
    shared.last_pass.set(now_ns);
    let monitor = Monitor::new(settings, Arc::clone(shared), now_ns);
    let service = Service { bus, monitor };
    host.start("can-service", Box::new(service))
        .map_err(OpenError::Thread)
}

impl CurrentAmplifier for CanopenDrive {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        self.take_outcome();
        if self.is_resetting {
            return Err(faults::device_error(faults::RESETTING));
        }
        self.no_fault()?;
        if !self.shared.is_operational() {
            return Err(faults::device_error(faults::NOT_OPERATIONAL));
        }
        self.begin_transition();
        Ok(())
    }

    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        let progress = self.step_towards_enabled();
        match progress {
            Poll::Pending => {}
            Poll::Ready(Ok(())) => self.shared.set_intent(Intent::On),
            Poll::Ready(Err(_)) => self.disable(),
        }
        progress
    }

    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        self.no_fault()?;
        if self.shared.intent() != Intent::On {
            return Err(faults::device_error(faults::NOT_ARMED));
        }
        if !current_a.is_finite() {
            return Err(faults::device_error(faults::NOT_FINITE));
        }
        let counts = self.configured.scale.counts(current_a);
        self.exchange(ENABLE_OPERATION, counts)?;
        self.shared.note_command();
        Ok(self.configured.scale.amperes(counts))
    }

    fn rounded_a(&self, current_a: f64) -> f64 {
        let scale = &self.configured.scale;
        scale.amperes(scale.counts(current_a))
    }

    fn disable(&mut self) {
        self.shared.set_intent(Intent::Off);
        let _ = self.exchange(DISABLE_VOLTAGE, 0); // the service repeats it until the drive confirms
    }

    fn status(&self) -> AmplifierStatus {
        match (self.fault(), self.shared.intent()) {
            (0, Intent::On) => AmplifierStatus::Enabled,
            (0, _) => AmplifierStatus::Disabled,
            (code, _) => AmplifierStatus::Fault(code),
        }
    }

    fn actual_current_a(&self) -> Option<f64> {
        let counts = self.shared.actual()?;
        Some(self.configured.scale.amperes(counts))
    }

    fn begin_reset(&mut self) -> Result<(), DeviceError> {
        self.take_outcome();
        if !self.is_resetting {
            self.is_resetting = true;
            self.disable();
            self.shared.request_reset();
        }
        Ok(())
    }

    fn poll_reset(&mut self) -> Poll<Result<(), DeviceError>> {
        match self.take_outcome() {
            Some(0) => Poll::Ready(Ok(())),
            Some(code) => Poll::Ready(Err(faults::device_error(code))),
            None if self.is_resetting => Poll::Pending,
            None => Poll::Ready(self.no_fault()),
        }
    }

    fn explain(&self, code: u32) -> Option<FaultText> {
        Some(fault_text(code))
    }
}

impl Drop for CanopenDrive {
    fn drop(&mut self) {
        self.reset = TaskHandle::default(); // ends within the time limits of a reset
        self.shut_down();
        self.service = TaskHandle::default();
    }
}

#[cfg(test)]
mod tests;
