//! A VESC as a current amplifier (vedderb/bldc, documentation/comm_can.md).
//!
//! ```text
//! 29-bit identifier = command << 8 | node, numbers big endian
//! to the VESC      command 1   SET_CURRENT   i32, mA                         51 A to node 23: 0x0117  00 00 C7 38
//! from the VESC    command 9   STATUS        rpm i32, current i16 in 0.1 A, duty i16 in 1/1000
//! ```
//!
//! A VESC releases the motor after 0.5 s without a command. The driver does not rely on it: after a disable or a fault its thread
//! sends SET_CURRENT 0 every 10 ms until two STATUS have arrived and the last shows at most 0.2 A, for 1 s at most. If the loop sends
//! no command for [`VescSettings::command_timeout`] while the VESC is enabled, this is a fault.

mod faults;
mod frames;
mod settings;
mod shared;
mod watch;

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::task::Poll;
use std::time::Duration;

pub use frames::{set_current, status_current, status_id};
pub use settings::VescSettings;

use self::faults::{NOT_ARMED, NOT_SENT, SILENT, THREAD_HUNG, error, text};
use self::shared::Shared;
use self::watch::{UseState, Watch};
use super::bus::{CanBus, Claim, Host, TaskHandle};
use super::last_pass::PASS_TIMEOUT;
use crate::{AmplifierStatus, CurrentAmplifier, DeviceError, FaultText};

/// Longest time that closing the driver waits until the current is confirmed to be zero: five periods of STATUS.
const CLOSE_TIMEOUT_NS: u64 = 100_000_000;

fn amperes(current_ma: i32) -> f64 {
    f64::from(current_ma) * 1e-3
}

/// A change of state that has begun.
#[derive(Clone, Copy, Debug)]
struct Change {
    /// Number of STATUS frames at its beginning.
    status_count: u32,
    deadline_ns: u64,
}

/// A VESC in current control.
pub struct Vesc {
    _watch: TaskHandle,
    bus: Box<dyn CanBus>,
    host: Box<dyn Host>,
    shared: Arc<Shared>,
    settings: VescSettings,
    change: Option<Change>,
    _claim: Claim,
}

impl Vesc {
    /// Claims the VESC and starts to monitor its STATUS.
    pub fn open(settings: VescSettings, host: Box<dyn Host>) -> Result<Vesc, String> {
        settings.check()?;
        let claim = host.claim(settings.node).map_err(|e| e.to_string())?;
        let status = [status_id(settings.node)];
        let bus = host.endpoint(&status).map_err(|e| e.to_string())?;
        let shared = Arc::new(Shared::default());
        shared.last_pass.set(host.now_ns());
        let watch = Watch {
            bus: host.endpoint(&status).map_err(|e| e.to_string())?,
            shared: Arc::clone(&shared),
            node: settings.node,
            status_timeout_ns: settings.status_timeout.as_nanos() as u64,
            command_timeout_ns: settings.command_timeout.as_nanos() as u64,
            heard_ns: host.now_ns(),
            use_state: UseState::Off,
            uses: 0,
        };
        Ok(Vesc {
            _watch: host
                .start("can-vesc", Box::new(watch))
                .map_err(|e| e.to_string())?,
            bus,
            host,
            shared,
            settings,
            change: None,
            _claim: claim,
        })
    }

    /// A change of state that begins now, with the time limit `status_timeout`.
    fn change(&self) -> Change {
        let limit_ns = self.settings.status_timeout.as_nanos() as u64;
        Change {
            status_count: self.shared.status_count.load(Ordering::Acquire),
            deadline_ns: self.host.now_ns().saturating_add(limit_ns),
        }
    }

    /// A limited current in milliamperes, rounded towards zero; 0 for NaN.
    fn current_ma(&self, current_a: f64) -> i32 {
        let limit_a = self.settings.current_limit_a;
        (current_a.clamp(-limit_a, limit_a) * 1e3) as i32
    }

    fn is_on(&self) -> bool {
        self.shared.is_on.load(Ordering::Acquire)
    }

    /// Code of the fault, 0 if there is none. If the thread of the driver hangs, the stored state is outdated, which is a fault as
    /// well. Called in the tick: must not allocate or block.
    fn fault(&self) -> u32 {
        let now_ns = self.host.now_ns();
        match self.shared.fault.load(Ordering::Acquire) {
            0 if self.shared.last_pass.is_overdue(now_ns, PASS_TIMEOUT) => THREAD_HUNG,
            code => code,
        }
    }

    fn no_fault(&self) -> Result<(), DeviceError> {
        match self.fault() {
            0 => Ok(()),
            code => Err(error(code)),
        }
    }
}

impl CurrentAmplifier for Vesc {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        self.no_fault()?;
        self.change = Some(self.change());
        Ok(())
    }

    /// A VESC needs no preparation. It is ready with the first STATUS after the beginning.
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        let Some(change) = self.change else {
            return Poll::Ready(Err(error(NOT_ARMED)));
        };
        let has_answered = self.shared.status_count.load(Ordering::Acquire) != change.status_count;
        let result = match self.no_fault() {
            Ok(()) if has_answered => Ok(()),
            Ok(()) if self.host.now_ns() < change.deadline_ns => return Poll::Pending,
            Ok(()) => Err(error(SILENT)),
            Err(fault) => Err(fault),
        };
        self.shared.switch(result.is_ok());
        self.change = None;
        Poll::Ready(result)
    }

    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        if let Err(error) = self.no_fault() {
            self.disable();
            return Err(error);
        }
        if !self.is_on() {
            return Err(error(NOT_ARMED));
        }
        let current_ma = self.current_ma(current_a);
        self.bus
            .send(&set_current(self.settings.node, current_ma))
            .map_err(|_| error(NOT_SENT))?;
        self.shared.commands.fetch_add(1, Ordering::Release);
        Ok(amperes(current_ma))
    }

    fn rounded_a(&self, current_a: f64) -> f64 {
        amperes(self.current_ma(current_a))
    }

    fn disable(&mut self) {
        self.change = None;
        self.shared.switch(false);
        let _ = self.bus.send(&set_current(self.settings.node, 0)); // if it is lost, the thread of the driver repeats it
    }

    fn status(&self) -> AmplifierStatus {
        match self.fault() {
            0 if self.is_on() => AmplifierStatus::Enabled,
            0 => AmplifierStatus::Disabled,
            code => AmplifierStatus::Fault(code),
        }
    }

    fn actual_current_a(&self) -> Option<f64> {
        let is_heard = self.shared.is_heard.load(Ordering::Acquire);
        is_heard.then(|| f64::from(self.shared.current_tenths.load(Ordering::Acquire)) * 0.1)
    }

    fn begin_reset(&mut self) -> Result<(), DeviceError> {
        self.disable();
        self.shared.fault.store(0, Ordering::Release);
        self.change = Some(self.change());
        Ok(())
    }

    /// A cause that persists shows within `status_timeout`.
    fn poll_reset(&mut self) -> Poll<Result<(), DeviceError>> {
        match self.change {
            Some(change) if self.host.now_ns() < change.deadline_ns => Poll::Pending,
            Some(_) | None => {
                self.change = None;
                Poll::Ready(self.no_fault())
            }
        }
    }

    fn explain(&self, code: u32) -> Option<FaultText> {
        Some(text(code))
    }
}

impl Drop for Vesc {
    /// Waits until the thread of the driver has seen the current gone.
    fn drop(&mut self) {
        self.disable();
        let end_ns = self.host.now_ns().saturating_add(CLOSE_TIMEOUT_NS);
        while !self.shared.has_settled() && self.host.now_ns() < end_ns {
            self.host.sleep(Duration::from_millis(1));
        }
    }
}

#[cfg(test)]
mod tests;
