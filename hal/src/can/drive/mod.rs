//! A CANopen drive as a current amplifier.
//!
//! ```text
//!   loop's thread   enable  command  disable  status        service thread
//!        |            |        |        |       ^             |  (monitor)
//!        |  SDO   set-points, NMT       |       |  atomics    |  status, EMCY, heartbeat, error frames
//!        v            v        v        v       +-------------+  our heartbeat, `disable voltage`
//!   ==================================== bus ==================================
//! ```
//!
//! Both threads have a connection of their own with filters of their own. Health is what comes in, never the result of
//! a write. The drive watches our heartbeat, which the service sends only as long as it has no reason to want the drive
//! silent; so whichever of loop, process, cable and drive fails, somebody is left who stops the current.

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
pub use settings::{DriveSettings, ExpectedIdentity, TorqueMode};

use self::monitor::{Monitor, heard_ids, set_point};
use self::service::Service;
use self::setup::{Configured, Setup};
use self::shared::{Intent, Shared};
use super::budget::Exchange;
use super::bus::{CanBus, Claim, Host, TaskHandle};
use super::cia402::{CYCLIC_TORQUE, DISABLE_VOLTAGE, ENABLE_OPERATION, State};
use super::scale::Scale;
use super::sdo::{Address, Channel, answer_id};
use super::{nmt, sync};
use crate::{AmplifierStatus, CurrentAmplifier, DeviceError, FaultText};

/// Time between looks at the drive while it changes its state.
const LOOK: Duration = Duration::from_millis(2);

/// A CANopen drive in torque mode. See the module for who watches whom.
pub struct CanopenDrive {
    service: TaskHandle, // first, so that it ends before the claim does
    bus: Box<dyn CanBus>,
    host: Box<dyn Host>,
    shared: Arc<Shared>,
    settings: DriveSettings,
    scale: Scale,
    mode: i8,
    identity: [Option<u32>; 4],
    last_error: Option<OpenError>,
    _claim: Claim,
}

impl CanopenDrive {
    /// Claims the node, configures the drive and verifies what it took. Afterwards it is operational and off.
    pub fn open(settings: DriveSettings, host: Box<dyn Host>) -> Result<CanopenDrive, OpenError> {
        settings.check()?;
        let node = settings.node;
        let claim = host.claim(node)?;
        let mut bus = host.endpoint(&[answer_id(node)])?;
        let watched = host.endpoint(&heard_ids(node))?;
        let configured = configure(&settings, bus.as_mut(), host.as_ref())?;
        let shared = Arc::new(Shared::default());
        let monitor = Monitor::new(&settings, Arc::clone(&shared), host.now_ns());
        let task = Box::new(Service {
            bus: watched,
            monitor,
        });
        let service = host.start("can-service", task).map_err(OpenError::Thread)?;
        let Configured {
            scale,
            mode,
            identity,
        } = configured;
        let last_error = None;
        let mut drive = CanopenDrive {
            service,
            bus,
            host,
            shared,
            settings,
            scale,
            mode,
            identity,
            last_error,
            _claim: claim,
        };
        drive.shared.set_restarted(false);
        drive.start()?;
        Ok(drive)
    }

    /// Mode of operation in force: 10 cyclic synchronous torque, 4 profile torque.
    pub fn mode(&self) -> i8 {
        self.mode
    }

    /// Vendor, product, revision and serial number (0x1018), as far as the drive says.
    pub fn identity(&self) -> [Option<u32>; 4] {
        self.identity
    }

    /// The smallest step of the current, in amperes.
    pub fn step_a(&self) -> f64 {
        self.scale.step_a()
    }

    /// Why the drive did not take its configuration again, in full; [`DeviceError`] has room for static text only.
    pub fn last_error(&self) -> Option<&OpenError> {
        self.last_error.as_ref()
    }

    /// NMT start, and wait until the drive's heartbeat says operational.
    fn start(&mut self) -> Result<(), OpenError> {
        self.shared.set_must_follow(self.mode == CYCLIC_TORQUE);
        self.bus
            .send(&nmt::Command::Start.frame(self.settings.node))?;
        let operational = |shared: &Shared| shared.nmt() == Some(nmt::State::Operational);
        if self.wait_for(self.settings.state_timeout, operational) {
            return Ok(());
        }
        let (node, timeout) = (self.settings.node, self.settings.state_timeout);
        Err(OpenError::NotOperational {
            node,
            timeout_ms: timeout.as_millis(),
        })
    }

    /// Everything that a restart or another master has undone.
    fn configure_again(&mut self) -> Result<(), OpenError> {
        self.shared.set_restarted(false);
        self.shared.forget_nmt();
        let configured = configure(&self.settings, self.bus.as_mut(), self.host.as_ref())?;
        (self.scale, self.mode) = (configured.scale, configured.mode);
        self.start()
    }

    /// Looks until `condition` holds, `false` if it does not within `limit`.
    fn wait_for(&self, limit: Duration, condition: impl Fn(&Shared) -> bool) -> bool {
        let deadline_ns = self.host.now_ns().saturating_add(limit.as_nanos() as u64);
        while !condition(&self.shared) {
            if self.host.now_ns() >= deadline_ns {
                return false;
            }
            self.host.sleep(LOOK);
        }
        true
    }

    fn deadline_ns(&self) -> u64 {
        self.host
            .now_ns()
            .saturating_add(self.settings.state_timeout.as_nanos() as u64)
    }

    /// One set-point, with SYNC if the exchange has it. *In the tick.*
    fn exchange(&mut self, controlword: u16, target: i16) -> Result<(), DeviceError> {
        let frame = set_point(self.settings.node, controlword, target);
        let sent = self
            .bus
            .send(&frame)
            .and_then(|()| match self.settings.exchange {
                Exchange::Asynchronous { .. } => Ok(()),
                Exchange::Synchronous { .. } => self.bus.send(&sync::FRAME),
            });
        sent.map_err(|error| faults::device_error(faults::of_bus_error(error)))
    }

    fn no_fault(&self) -> Result<(), DeviceError> {
        match self.shared.fault() {
            0 => Ok(()),
            code => Err(faults::device_error(code)),
        }
    }

    /// Off, no longer watched by the drive, pre-operational.
    fn leave_in_order(&mut self) {
        self.disable();
        let settled =
            |shared: &Shared| shared.state().is_none_or(State::is_off) || shared.fault() != 0;
        let is_off = self.wait_for(self.settings.state_timeout, settled);
        if is_off && self.shared.fault() == 0 {
            let mut channel = channel(&self.settings, self.bus.as_mut(), self.host.as_ref());
            let _ = channel.write(Address::new(0x1016, 1), &[0; 4]); // else it will miss us and say so: no harm
            let _ = self
                .bus
                .send(&nmt::Command::EnterPreOperational.frame(self.settings.node));
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
        timeout: settings.sdo_timeout,
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
        if self.shared.nmt() != Some(nmt::State::Operational) {
            return Err(faults::device_error(faults::NOT_OPERATIONAL));
        }
        self.shared.set_intent(Intent::Enabling);
        let reached = self.climb();
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
        let counts = self.scale.counts(current_a);
        self.exchange(ENABLE_OPERATION, counts)?;
        self.shared.note_command();
        Ok(self.scale.amperes(counts))
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
        self.shared
            .actual()
            .map(|counts| self.scale.amperes(counts))
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
        self.host.sleep(self.settings.heartbeat_timeout); // a cause that persists shows within this time
        self.no_fault()
    }

    fn explain(&self, code: u32) -> Option<FaultText> {
        Some(fault_text(code))
    }
}

impl Drop for CanopenDrive {
    fn drop(&mut self) {
        self.leave_in_order();
        self.service = TaskHandle::default();
    }
}

#[cfg(test)]
mod tests;
