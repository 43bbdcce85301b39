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

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, Ordering};
use std::task::Poll;
use std::time::Duration;

use super::bus::{BusError, BusEvent, CanBus, Claim, Condition, Host, Task, TaskHandle};
use super::frame::{CanFrame, Id};
use super::last_pass::LastPass;
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
    /// If the loop sends no command for this time while the VESC is enabled, the current is switched off.
    pub command_timeout: Duration,
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
const COMMANDS_STOPPED: u32 = 6;
const THREAD_HUNG: u32 = 7;

/// Code, meaning and remedy of each fault.
const FAULTS: [(u32, &str, &str); 7] = [
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
    (
        COMMANDS_STOPPED,
        "the loop sent no more commands and the current was switched off",
        "look for overruns, then clear the fault",
    ),
    (
        THREAD_HUNG,
        "the thread that monitors the VESC has not run for 20 ms",
        "stop programs that use all processors, then clear the fault; if it remains, start the program again",
    ),
];

/// Time between repeats of SET_CURRENT 0.
const REPEAT_NS: u64 = 10_000_000;
/// Longest time of the repeats: twice the time after which a VESC releases the motor without a command.
const REPEATS_END_NS: u64 = 1_000_000_000;
/// Largest current that counts as none, in units of 0.1 A.
const NO_CURRENT_TENTHS: u32 = 2;
/// Longest time that closing the driver waits until the current is confirmed to be zero: five periods of STATUS.
const CLOSE_TIMEOUT_NS: u64 = 100_000_000;

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

fn amperes(current_ma: i32) -> f64 {
    f64::from(current_ma) * 1e-3
}

/// State that the tick and the thread of the driver share.
#[derive(Debug, Default)]
struct Shared {
    /// Whether commands are followed. Written by the tick.
    is_on: AtomicBool,
    /// How often the VESC was enabled, so that a short use is noticed as well. Written by the tick.
    uses: AtomicU32,
    /// Number of commands since it was enabled. Written by the tick.
    commands: AtomicU32,
    /// The value of `uses` for which the repeats of SET_CURRENT 0 have ended. Written by the thread.
    ended_uses: AtomicU32,
    fault: AtomicU32,
    is_heard: AtomicBool,
    /// Number of STATUS frames.
    status_count: AtomicU32,
    current_tenths: AtomicI32,
    /// Written by the thread. Without a recent pass its fields are outdated.
    last_pass: LastPass,
}

impl Shared {
    fn latch(&self, code: u32) {
        let _ = self
            .fault
            .compare_exchange(0, code, Ordering::AcqRel, Ordering::Acquire); // the first fault is kept
    }

    fn switch(&self, is_on: bool) {
        if is_on {
            self.commands.store(0, Ordering::Release);
            self.uses.fetch_add(1, Ordering::Release);
        }
        self.is_on.store(is_on, Ordering::Release);
    }

    /// Whether the VESC is off and zero current is no longer repeated.
    fn has_settled(&self) -> bool {
        self.ended_uses.load(Ordering::Acquire) == self.uses.load(Ordering::Acquire)
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
        match self.shared.fault.load(Ordering::Acquire) {
            0 if self.shared.last_pass.is_overdue(self.host.now_ns()) => THREAD_HUNG,
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

/// The use of the VESC as the thread of the driver sees it.
#[derive(Clone, Copy, Debug)]
enum UseState {
    /// No current was commanded, or its end is confirmed.
    Off,
    /// The VESC follows commands.
    On(OnWatch),
    /// SET_CURRENT 0 is repeated.
    Ending(OffWatch),
}

/// Monitoring of the commands.
#[derive(Clone, Copy, Debug, Default)]
struct OnWatch {
    commands: u32,
    /// When the last command was noticed; `None` before the first.
    last_command_ns: Option<u64>,
}

impl OnWatch {
    /// The state with the present number of commands.
    fn updated(self, commands: u32, now_ns: u64) -> OnWatch {
        match commands == self.commands {
            true => self,
            false => OnWatch {
                commands,
                last_command_ns: Some(now_ns),
            },
        }
    }

    fn is_overdue(self, timeout_ns: u64, now_ns: u64) -> bool {
        let last_ns = self.last_command_ns;
        last_ns.is_some_and(|last_ns| now_ns.saturating_sub(last_ns) > timeout_ns)
    }
}

/// Monitoring after a disable or a fault, until the current is gone.
#[derive(Clone, Copy, Debug)]
struct OffWatch {
    since_ns: u64,
    repeat_ns: u64,
    status_count: u32,
}

/// The thread of the driver: receives STATUS and error frames, watches the commands, and repeats zero current.
struct Watch {
    bus: Box<dyn CanBus>,
    shared: Arc<Shared>,
    node: u8,
    status_timeout_ns: u64,
    command_timeout_ns: u64,
    heard_ns: u64,
    use_state: UseState,
    /// The value of [`Shared::uses`] that `use_state` belongs to.
    uses: u32,
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

    fn check_status(&self, now_ns: u64) {
        if now_ns.saturating_sub(self.heard_ns) > self.status_timeout_ns {
            self.shared.is_heard.store(false, Ordering::Release);
            self.shared.latch(SILENT);
        }
    }

    /// Follows the use by the tick. A fault ends it.
    fn follow_use(&mut self, now_ns: u64) {
        let has_fault = self.shared.fault.load(Ordering::Acquire) != 0;
        let is_on = self.shared.is_on.load(Ordering::Acquire) && !has_fault;
        let uses = self.shared.uses.load(Ordering::Acquire);
        let is_new = uses != self.uses;
        self.uses = uses;
        self.use_state = match (self.use_state, is_on) {
            (UseState::On(_), true) if !is_new => return,
            (_, true) => UseState::On(OnWatch::default()),
            (UseState::On(_), false) => UseState::Ending(self.off_watch(now_ns)),
            (UseState::Off | UseState::Ending(_), false) if is_new => {
                UseState::Ending(self.off_watch(now_ns))
            }
            (UseState::Off | UseState::Ending(_), false) => return,
        };
    }

    fn off_watch(&self, now_ns: u64) -> OffWatch {
        OffWatch {
            since_ns: now_ns,
            repeat_ns: now_ns,
            status_count: self.shared.status_count.load(Ordering::Acquire),
        }
    }

    /// A loop that sends no more commands is a fault.
    fn check_commands(&mut self, now_ns: u64) {
        let UseState::On(watch) = self.use_state else {
            return;
        };
        let watch = watch.updated(self.shared.commands.load(Ordering::Acquire), now_ns);
        self.use_state = UseState::On(watch);
        if watch.is_overdue(self.command_timeout_ns, now_ns) {
            self.shared.latch(COMMANDS_STOPPED);
        }
    }

    /// Repeats zero current until the VESC reports it, or for [`REPEATS_END_NS`].
    fn ensure_zero(&mut self, now_ns: u64) {
        let UseState::Ending(mut watch) = self.use_state else {
            return;
        };
        let is_overdue = now_ns.saturating_sub(watch.since_ns) > REPEATS_END_NS;
        if is_overdue || self.is_confirmed(watch) {
            self.use_state = UseState::Off;
            return self.shared.ended_uses.store(self.uses, Ordering::Release);
        }
        if now_ns >= watch.repeat_ns {
            watch.repeat_ns = now_ns.saturating_add(REPEAT_NS);
            let _ = self.bus.send(&set_current(self.node, 0)); // the next repeat follows
        }
        self.use_state = UseState::Ending(watch);
    }

    /// Whether the second or a later STATUS after the end shows no current: the first may have been measured before it.
    fn is_confirmed(&self, watch: OffWatch) -> bool {
        let count = self.shared.status_count.load(Ordering::Acquire);
        let tenths = self.shared.current_tenths.load(Ordering::Acquire);
        count.wrapping_sub(watch.status_count) >= 2 && tenths.unsigned_abs() <= NO_CURRENT_TENTHS
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
        let now_ns = now_ns();
        self.check_status(now_ns);
        self.follow_use(now_ns);
        self.check_commands(now_ns);
        self.follow_use(now_ns); // a new fault ends the use at once
        self.ensure_zero(now_ns);
        self.shared.last_pass.set(now_ns);
        received.map(|_| ())
    }
}

#[cfg(test)]
mod tests;
