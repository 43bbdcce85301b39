//! The thread of the driver.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use super::super::bus::{BusError, BusEvent, CanBus, Condition, Task};
use super::faults::{BUS_FAILED, BUS_OFF, COMMANDS_STOPPED, SILENT};
use super::frames::{set_current, status_current};
use super::shared::Shared;

/// Time between repeats of SET_CURRENT 0.
const REPEAT_NS: u64 = 10_000_000;
/// Longest time of the repeats: twice the time after which a VESC releases the motor without a command.
const REPEATS_END_NS: u64 = 1_000_000_000;
/// Largest current that counts as none, in units of 0.1 A.
const NO_CURRENT_TENTHS: u32 = 2;

/// The use of the VESC as the thread of the driver sees it.
#[derive(Clone, Copy, Debug)]
pub(super) enum UseState {
    /// No current was commanded, or its end is confirmed.
    Off,
    /// The VESC follows commands.
    On(OnWatch),
    /// SET_CURRENT 0 is repeated.
    Ending(OffWatch),
}

/// Monitoring of the commands.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OnWatch {
    commands: u32,
    /// When the last command was noticed; `None` before the first.
    last_command_ns: Option<u64>,
}

impl OnWatch {
    /// The state with the present number of commands.
    fn updated(self, commands: u32, now_ns: u64) -> OnWatch {
        if commands == self.commands {
            self
        } else {
            OnWatch {
                commands,
                last_command_ns: Some(now_ns),
            }
        }
    }

    fn is_overdue(self, timeout_ns: u64, now_ns: u64) -> bool {
        let last_ns = self.last_command_ns;
        last_ns.is_some_and(|last_ns| now_ns.saturating_sub(last_ns) > timeout_ns)
    }
}

/// Monitoring after a disable or a fault, until the current is gone.
#[derive(Clone, Copy, Debug)]
pub(super) struct OffWatch {
    since_ns: u64,
    repeat_ns: u64,
    status_count: u32,
}

/// The thread of the driver: receives STATUS and error frames, watches the commands, and repeats zero current.
pub(super) struct Watch {
    pub(super) bus: Box<dyn CanBus>,
    pub(super) shared: Arc<Shared>,
    pub(super) node: u8,
    pub(super) status_timeout_ns: u64,
    pub(super) command_timeout_ns: u64,
    pub(super) heard_ns: u64,
    pub(super) use_state: UseState,
    /// The value of [`Shared::uses`] that `use_state` belongs to.
    pub(super) uses: u32,
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
