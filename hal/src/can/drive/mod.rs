//! A CANopen drive as a current amplifier.
//!
//! ```text
//!   loop's thread   enable  command  disable  status        service thread
//!        |            |        |        |       ^             |  (monitor)
//!        |  SDO   set-points, NMT       |       |  atomics    |  status, EMCY, heartbeat, error frames
//!        v            v        v        v       +-------------+  heartbeat, `disable voltage`
//!   ==================================== bus ==================================
//! ```
//!
//! Each thread has its own connection to the bus, with its own filters. The state of the drive is judged by received frames,
//! never by the result of a write. The drive monitors the heartbeat of this program. The service thread ends this heartbeat if
//! the drive does not confirm that it is off. Thus the current is stopped whichever part fails: loop, process, cable or drive.

mod errors;
pub mod faults;
mod inspect;
mod monitor;
mod service;
mod settings;
mod setup;
mod shared;
mod transitions;

use std::sync::Arc;
use std::time::Duration;

pub use errors::OpenError;
pub use faults::fault_text;
pub use inspect::{ABORT_CONNECTION, Inspection, REQUIRED_OBJECTS, inspect};
pub use settings::{DriveSettings, DriveTimes, ExpectedIdentity, TorqueMode};

use self::monitor::{Monitor, received_ids, set_point};
use self::service::Service;
use self::setup::{Configured, Setup};
use self::shared::{Intent, Shared};
use super::budget::Exchange;
use super::bus::{CanBus, Claim, Host, TaskHandle};
use super::cia402::{CYCLIC_TORQUE, DISABLE_VOLTAGE, ENABLE_OPERATION};
use super::objects::HEARTBEAT_CONSUMER;
use super::sdo::{Channel, answer_id};
use super::{nmt, sync};
use crate::{AmplifierStatus, CurrentAmplifier, DeviceError, FaultText};

/// Time between checks of the state of the drive while it changes.
const STATE_POLL: Duration = Duration::from_millis(2);

/// A CANopen drive in torque mode. The module documentation describes how it is monitored.
pub struct CanopenDrive {
    service: TaskHandle, // first, so that it ends before the claim does
    bus: Box<dyn CanBus>,
    host: Box<dyn Host>,
    shared: Arc<Shared>,
    settings: DriveSettings,
    configured: Configured,
    last_error: Option<OpenError>,
    _claim: Claim,
}

impl CanopenDrive {
    /// Claims the node, configures the drive and verifies the configuration. Afterwards the drive is operational and off.
    pub fn open(settings: DriveSettings, host: Box<dyn Host>) -> Result<CanopenDrive, OpenError> {
        settings.check()?;
        let node = settings.node;
        let claim = host.claim(node)?;
        let mut bus = host.endpoint(&[answer_id(node)])?;
        let watched = host.endpoint(&received_ids(node))?;
        let configured = configure(&settings, bus.as_mut(), host.as_ref())?;
        let shared = Arc::new(Shared::default());
        let monitor = Monitor::new(&settings, Arc::clone(&shared), host.now_ns());
        let service = Service {
            bus: watched,
            monitor,
        };
        let service = host.start("can-service", Box::new(service));
        let mut drive = CanopenDrive {
            service: service.map_err(OpenError::Thread)?,
            bus,
            host,
            shared,
            settings,
            configured,
            last_error: None,
            _claim: claim,
        };
        drive.shared.set_restarted(false);
        drive.start()?;
        Ok(drive)
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
    pub fn last_error(&self) -> Option<&OpenError> {
        self.last_error.as_ref()
    }

    /// Sends NMT start and waits until the heartbeat of the drive reports operational.
    fn start(&mut self) -> Result<(), OpenError> {
        self.shared
            .set_must_follow(self.configured.mode == CYCLIC_TORQUE);
        self.bus
            .send(&nmt::Command::Start.frame(self.settings.node))?;
        let timeout = self.settings.times.state_timeout;
        if self.wait_for(timeout, Shared::is_operational) {
            return Ok(());
        }
        Err(OpenError::NotOperational {
            node: self.settings.node,
            timeout_ms: timeout.as_millis(),
        })
    }

    /// Restores the configuration after a restart of the drive or the intervention of another master.
    fn configure_again(&mut self) -> Result<(), OpenError> {
        self.shared.set_restarted(false);
        self.shared.clear_nmt();
        let configured = configure(&self.settings, self.bus.as_mut(), self.host.as_ref())?;
        self.configured = Configured {
            identity: self.configured.identity,
            ..configured
        };
        self.start()
    }

    /// Waits until `condition` holds; `false` if it does not within `limit`.
    fn wait_for(&self, limit: Duration, condition: impl Fn(&Shared) -> bool) -> bool {
        let deadline_ns = self.host.now_ns().saturating_add(limit.as_nanos() as u64);
        while !condition(&self.shared) {
            if self.host.now_ns() >= deadline_ns {
                return false;
            }
            self.host.sleep(STATE_POLL);
        }
        true
    }

    fn deadline_ns(&self) -> u64 {
        self.host
            .now_ns()
            .saturating_add(self.settings.times.state_timeout.as_nanos() as u64)
    }

    /// Sends a set-point, and SYNC if the exchange is synchronous. Called in the tick: must not allocate or block.
    fn exchange(&mut self, controlword: u16, target: i16) -> Result<(), DeviceError> {
        let frame = set_point(self.settings.node, controlword, target);
        let mut sent = self.bus.send(&frame);
        if sent.is_ok() && matches!(self.settings.exchange, Exchange::Synchronous { .. }) {
            sent = self.bus.send(&sync::FRAME);
        }
        sent.map_err(|error| faults::device_error(faults::of_bus_error(error)))
    }

    fn no_fault(&self) -> Result<(), DeviceError> {
        match self.shared.fault() {
            0 => Ok(()),
            code => Err(faults::device_error(code)),
        }
    }

    /// Switches the drive off, ends its monitoring of the heartbeat, and enters pre-operational.
    fn shut_down(&mut self) {
        self.disable();
        let is_off = self.wait_for(self.settings.times.state_timeout, Shared::has_settled);
        if is_off && self.shared.fault() == 0 {
            let mut channel = channel(&self.settings, self.bus.as_mut(), self.host.as_ref());
            let _ = channel.write(HEARTBEAT_CONSUMER, &[0; 4]); // if it fails, the drive only reports a lost heartbeat
            let stop = nmt::Command::EnterPreOperational.frame(self.settings.node);
            let _ = self.bus.send(&stop); // the drive is off already
        }
    }
}

fn channel<'a>(
    settings: &DriveSettings,
    bus: &'a mut dyn CanBus,
    host: &'a dyn Host,
) -> Channel<'a> {
    Channel {
        bus,
        host,
        node: settings.node,
        timeout: settings.times.sdo_timeout,
    }
}

fn configure(
    settings: &DriveSettings,
    bus: &mut dyn CanBus,
    host: &dyn Host,
) -> Result<Configured, OpenError> {
    Setup {
        channel: channel(settings, bus, host),
        settings,
    }
    .run()
}

impl CurrentAmplifier for CanopenDrive {
    fn enable(&mut self) -> Result<(), DeviceError> {
        self.no_fault()?;
        if !self.shared.is_operational() {
            return Err(faults::device_error(faults::NOT_OPERATIONAL));
        }
        self.shared.set_intent(Intent::Enabling);
        let reached = self.enable_stepwise();
        match reached {
            Ok(()) => self.shared.set_intent(Intent::On),
            Err(_) => self.disable(),
        }
        reached
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

    fn disable(&mut self) {
        self.shared.set_intent(Intent::Off);
        let _ = self.exchange(DISABLE_VOLTAGE, 0); // the service repeats it until the drive confirms
    }

    fn status(&self) -> AmplifierStatus {
        match (self.shared.fault(), self.shared.intent()) {
            (0, Intent::On) => AmplifierStatus::Enabled,
            (0, _) => AmplifierStatus::Disabled,
            (code, _) => AmplifierStatus::Fault(code),
        }
    }

    fn actual_current_a(&self) -> Option<f64> {
        let counts = self.shared.actual()?;
        Some(self.configured.scale.amperes(counts))
    }

    fn reset_fault(&mut self) -> Result<(), DeviceError> {
        let before = self.shared.fault();
        self.disable();
        self.shared.set_intent(Intent::Resetting);
        let acknowledged = self.acknowledge();
        if acknowledged.is_ok() {
            self.shared.clear_fault();
            self.shared.set_emergency(0);
        }
        self.shared.set_intent(Intent::Off);
        acknowledged.map_err(|code| {
            self.shared.latch(if before == 0 { code } else { before });
            faults::device_error(code)
        })?;
        self.host.sleep(self.settings.times.heartbeat_timeout); // a cause that persists shows within this time
        self.no_fault()
    }

    fn explain(&self, code: u32) -> Option<FaultText> {
        Some(fault_text(code))
    }
}

impl Drop for CanopenDrive {
    fn drop(&mut self) {
        self.shut_down();
        self.service = TaskHandle::default();
    }
}

#[cfg(test)]
mod tests;
