//! A VESC as a current amplifier (vedderb/bldc, documentation/comm_can.md).
//!
//! ```text
//! 29-bit identifier = command << 8 | node, numbers big endian
//! to the VESC      command 1   SET_CURRENT   i32, mA                         51 A to node 23: 0x0117  00 00 C7 38
//! from the VESC    command 9   STATUS        rpm i32, current i16 in 0.1 A, duty i16 in 1/1000
//! ```
//!
//! A VESC releases the motor after 0.5 s without a command. Only the loop sends commands, so the current is zero when the loop
//! stops.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, Ordering};
use std::task::Poll;
use std::time::Duration;

use super::bus::{BusError, BusEvent, CanBus, Claim, Condition, Host, Task, TaskHandle};
use super::frame::{CanFrame, Id};
use crate::{AmplifierStatus, CurrentAmplifier, DeviceError, FaultText};

/// SET_CURRENT to `node`, in milliamperes.
pub const fn set_current(node: u8, current_ma: i32) -> CanFrame {
    CanFrame::new(Id::extended(1 << 8 | node as u32), current_ma.to_be_bytes())
}

/// Identifier of STATUS from `node`.
pub const fn status_id(node: u8) -> Id {
    Id::extended(9 << 8 | node as u32)
}

/// The motor current of a STATUS frame, in units of 0.1 A.
pub fn status_current(data: &[u8]) -> Option<i16> {
    let &[_, _, _, _, high, low, _, _] = data else {
        return None;
    };
    Some(i16::from_be_bytes([high, low]))
}

/// Settings of a VESC.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VescSettings {
    /// Node number.
    pub node: u8,
    /// Limit of the commands, in amperes.
    pub current_limit_a: f64,
    /// Without STATUS for this time the VESC is lost.
    pub status_timeout: Duration,
}

impl VescSettings {
    fn check(&self) -> Result<(), String> {
        let limit_a = self.current_limit_a;
        match limit_a > 0.0 && limit_a <= 1000.0 {
            true => Ok(()),
            false => Err(format!(
                "current_limit_a = {limit_a} is invalid; set it to a value above 0 and at most 1000"
            )),
        }
    }
}

const SILENT: u32 = 1;
const BUS_OFF: u32 = 2;
const BUS_FAILED: u32 = 3;
const NOT_ARMED: u32 = 4;
const NOT_SENT: u32 = 5;

/// Code, meaning and remedy of each fault.
const FAULTS: [(u32, &str, &str); 5] = [
    (
        SILENT,
        "the VESC sends no STATUS",
        "check its power and cable, and that CAN status 1 is on in VESC Tool",
    ),
    (
        BUS_OFF,
        "the CAN bus is off or passive",
        "check cable, termination and bit rate, then clear the fault",
    ),
    (
        BUS_FAILED,
        "the CAN interface failed",
        "bring the interface up with `ip link set IFACE up`, then clear the fault",
    ),
    (NOT_ARMED, "the VESC is not enabled", "arm first"),
    (
        NOT_SENT,
        "a command could not be sent",
        "check that the VESC is on the bus, or lower the rate",
    ),
];

fn text(code: u32) -> FaultText {
    let fault = FAULTS.iter().find(|(known, ..)| *known == code);
    let &(_, what, remedy) = fault.unwrap_or(&(0, "unknown fault", "report the code"));
    FaultText { what, remedy }
}

fn error(code: u32) -> DeviceError {
    let FaultText { what, remedy } = text(code);
    DeviceError {
        what,
        remedy,
        code: code.into(),
    }
}

/// State that the monitor passes to the tick.
#[derive(Debug, Default)]
struct Shared {
    fault: AtomicU32,
    is_heard: AtomicBool,
    /// Number of STATUS frames.
    status_count: AtomicU32,
    current_tenths: AtomicI32,
}

impl Shared {
    fn latch(&self, code: u32) {
        let _ = self
            .fault
            .compare_exchange(0, code, Ordering::AcqRel, Ordering::Acquire); // the first fault is kept
    }
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
    is_on: bool,
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
        let watch = Watch {
            bus: host.endpoint(&status).map_err(|e| e.to_string())?,
            shared: Arc::clone(&shared),
            timeout_ns: settings.status_timeout.as_nanos() as u64,
            heard_ns: host.now_ns(),
        };
        Ok(Vesc {
            _watch: host
                .start("can-vesc", Box::new(watch))
                .map_err(|e| e.to_string())?,
            bus,
            host,
            shared,
            settings,
            is_on: false,
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

    fn no_fault(&self) -> Result<(), DeviceError> {
        match self.shared.fault.load(Ordering::Acquire) {
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
        self.is_on = self.shared.status_count.load(Ordering::Acquire) != change.status_count;
        let result = match self.no_fault() {
            Ok(()) if self.is_on => Ok(()),
            Ok(()) if self.host.now_ns() < change.deadline_ns => return Poll::Pending,
            Ok(()) => Err(error(SILENT)),
            Err(fault) => Err(fault),
        };
        self.is_on = result.is_ok();
        self.change = None;
        Poll::Ready(result)
    }

    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        if let Err(error) = self.no_fault() {
            self.disable();
            return Err(error);
        }
        if !self.is_on {
            return Err(error(NOT_ARMED));
        }
        let limit_a = self.settings.current_limit_a;
        let current_ma = (current_a.clamp(-limit_a, limit_a) * 1e3) as i32; // rounded towards zero; NaN becomes 0
        self.bus
            .send(&set_current(self.settings.node, current_ma))
            .map_err(|_| error(NOT_SENT))?;
        Ok(f64::from(current_ma) * 1e-3)
    }

    fn disable(&mut self) {
        (self.is_on, self.change) = (false, None);
        let _ = self.bus.send(&set_current(self.settings.node, 0)); // if it is lost, 0.5 s without command have the same effect
    }

    fn status(&self) -> AmplifierStatus {
        match self.shared.fault.load(Ordering::Acquire) {
            0 if self.is_on => AmplifierStatus::Enabled,
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
    fn drop(&mut self) {
        self.disable();
    }
}

/// Receives STATUS and error frames.
struct Watch {
    bus: Box<dyn CanBus>,
    shared: Arc<Shared>,
    timeout_ns: u64,
    heard_ns: u64,
}

impl Watch {
    fn take(&mut self, event: BusEvent, now_ns: u64) {
        match event {
            BusEvent::Condition(Condition::BusOff | Condition::Passive) => {
                self.shared.latch(BUS_OFF)
            }
            BusEvent::Condition(_) => {}
            BusEvent::Frame(frame) => {
                let Some(tenths) = status_current(frame.data()) else {
                    return;
                };
                self.heard_ns = now_ns;
                self.shared
                    .current_tenths
                    .store(i32::from(tenths), Ordering::Release);
                self.shared.is_heard.store(true, Ordering::Release);
                self.shared.status_count.fetch_add(1, Ordering::Release);
            }
        }
    }
}

impl Task for Watch {
    fn step(&mut self, now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        let received = self
            .bus
            .receive(wait)
            .inspect_err(|_| self.shared.latch(BUS_FAILED));
        if let Ok(Some(event)) = received {
            self.take(event, now_ns());
        }
        if now_ns().saturating_sub(self.heard_ns) > self.timeout_ns {
            self.shared.is_heard.store(false, Ordering::Release);
            self.shared.latch(SILENT);
        }
        received.map(|_| ())
    }
}

#[cfg(test)]
mod tests;
