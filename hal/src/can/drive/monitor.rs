//! Monitors the drive: received frames become status and faults, and determines the frames to send. Without bus and clock.
//!
//! ```text
//!  heartbeat, EMCY, status frame, error frame --handle--> fault; the first one is latched
//!  time --poll--> heartbeat of this program
//!                 heartbeat, status or commands overdue: fault
//!                 after a fault or disable: `disable voltage` until the drive confirms; after the time limit NMT stop and no
//!                 more heartbeats, so that the drive stops by itself
//! ```

use std::sync::Arc;
use std::time::Duration;

use super::super::budget::Exchange;
use super::super::bus::{BusError, BusEvent};
use super::super::cia402::{DISABLE_VOLTAGE, State};
use super::super::frame::{CanFrame, Id};
use super::super::pdo::{self, Direction};
use super::super::{emcy, heartbeat, nmt, sync};
use super::faults;
use super::settings::DriveSettings;
use super::shared::{Intent, Shared};

/// Time between repeats of `disable voltage`.
const REPEAT_NS: u64 = 10_000_000;
/// Time between SYNCs without commands, so that a synchronous drive still sends its status.
const IDLE_SYNC_NS: u64 = 20_000_000;

/// The identifiers that the monitor receives: those that a drive sends without request.
pub(super) fn received_ids(node: u8) -> [Id; 3] {
    [
        heartbeat::cob_id(node),
        emcy::cob_id(node),
        pdo::cob_id(Direction::Transmit, 1, node),
    ]
}

/// The set-point frame.
pub(super) fn set_point(node: u8, controlword: u16, target: i16) -> CanFrame {
    CanFrame::new(
        pdo::cob_id(Direction::Receive, 1, node),
        pdo::pack(controlword, target),
    )
}

/// Monitoring after a disable, until the drive confirms that it is off.
#[derive(Clone, Copy, Debug)]
struct OffWatch {
    since_ns: u64,
    repeat_ns: u64,
    status_count: u32,
    escalated: bool,
}

/// Monitoring while commands are followed.
#[derive(Clone, Copy, Debug)]
struct OnWatch {
    since_ns: u64,
    commands: u32,
    first_command_ns: Option<u64>,
    last_command_ns: u64,
}

impl OnWatch {
    /// Stores the present number of commands.
    fn update(&mut self, commands: u32, now_ns: u64) {
        if commands != self.commands {
            (self.commands, self.last_command_ns) = (commands, now_ns);
            self.first_command_ns = self.first_command_ns.or(Some(now_ns));
        }
    }
}

fn ns(time: Duration) -> u64 {
    time.as_nanos() as u64
}

#[derive(Debug)]
pub(super) struct Monitor {
    shared: Arc<Shared>,
    node: u8,
    own_node: u8,
    is_synchronous: bool,
    heartbeat_timeout_ns: u64,
    own_period_ns: u64,
    status_timeout_ns: u64,
    command_timeout_ns: u64,
    off_timeout_ns: u64,
    heard_ns: u64,
    own_due_ns: u64,
    status_ns: u64,
    idle_sync_ns: u64,
    intent: Intent,
    uses: u32,
    on: Option<OnWatch>,
    off: Option<OffWatch>,
}

impl Monitor {
    pub(super) fn new(settings: &DriveSettings, shared: Arc<Shared>, now_ns: u64) -> Monitor {
        let times = &settings.times;
        Monitor {
            shared,
            node: settings.node,
            own_node: settings.own_node,
            is_synchronous: matches!(settings.exchange, Exchange::Synchronous { .. }),
            heartbeat_timeout_ns: ns(times.heartbeat_timeout),
            own_period_ns: ns(times.own_heartbeat_period),
            status_timeout_ns: ns(times.status_timeout),
            command_timeout_ns: ns(times.command_timeout),
            off_timeout_ns: ns(times.own_heartbeat_timeout).max(3 * REPEAT_NS),
            heard_ns: now_ns,
            own_due_ns: now_ns,
            status_ns: now_ns,
            idle_sync_ns: now_ns,
            intent: Intent::Off,
            uses: 0,
            on: None,
            off: None,
        }
    }

    /// Latches an error of the bus.
    pub(super) fn fail(&mut self, error: BusError) {
        self.shared.latch(faults::of_bus_error(error));
    }

    /// Processes an event of the bus.
    pub(super) fn handle(&mut self, event: &BusEvent, now_ns: u64) {
        match event {
            BusEvent::Condition(condition) => {
                if let Some(code) = faults::of_condition(*condition) {
                    self.shared.latch(code);
                }
            }
            BusEvent::Frame(frame) => self.handle_frame(frame, now_ns),
        }
    }

    fn handle_frame(&mut self, frame: &CanFrame, now_ns: u64) {
        let [heartbeat, emergency, status] = received_ids(self.node);
        if frame.id() == heartbeat {
            self.heartbeat(frame, now_ns);
        } else if frame.id() == emergency {
            self.emergency(frame);
        } else if frame.id() == status {
            self.status(frame, now_ns);
        }
    }

    fn heartbeat(&mut self, frame: &CanFrame, now_ns: u64) {
        let Some(state) = heartbeat::decode(frame.data()) else {
            return self.shared.latch(faults::MALFORMED);
        };
        self.heard_ns = now_ns;
        self.shared.set_nmt(state);
        if state == nmt::State::Operational {
            return;
        }
        self.shared.clear_status();
        if state == nmt::State::BootUp {
            self.off = None; // a drive that has just started is off
            self.shared.set_restarted(true);
            self.shared.latch(faults::RESTARTED);
        } else if self.is_in_use() {
            self.shared.latch(faults::NOT_OPERATIONAL);
        }
    }

    fn emergency(&mut self, frame: &CanFrame) {
        let Some(emergency) = emcy::Emergency::decode(frame.data()) else {
            return self.shared.latch(faults::MALFORMED);
        };
        self.shared.set_emergency(emergency.code);
        let matters = self.is_in_use() || self.shared.fault() == faults::DRIVE_FAULT;
        if emergency.code != 0 && matters {
            self.shared
                .latch(faults::EMERGENCY + u32::from(emergency.code));
        }
    }

    fn status(&mut self, frame: &CanFrame, now_ns: u64) {
        let Some((statusword, actual)) = pdo::unpack(frame.data()) else {
            return self.shared.latch(faults::MALFORMED);
        };
        self.status_ns = now_ns;
        self.shared.set_status(statusword, actual);
        if let Some(code) = self.status_fault(State::decode(statusword)) {
            self.shared.latch(code);
        }
    }

    /// The fault that a status frame shows; while a fault is being reset it shows none.
    fn status_fault(&self, state: Option<State>) -> Option<u32> {
        match (state, self.shared.intent()) {
            (_, Intent::Resetting) => None,
            (Some(State::Fault | State::FaultReactionActive), _) => Some(self.drive_fault()),
            (None, Intent::On) => Some(faults::MALFORMED),
            (Some(State::OperationEnabled), Intent::On) if self.shared.follows() => None,
            (Some(State::OperationEnabled), Intent::On) => Some(faults::TARGET_IGNORED),
            (Some(_), Intent::On) => Some(faults::SWITCHED_OFF),
            _ => None,
        }
    }

    /// State Fault, with the emergency message if there was one.
    fn drive_fault(&self) -> u32 {
        match self.shared.emergency() {
            0 => faults::DRIVE_FAULT,
            code => faults::EMERGENCY + u32::from(code),
        }
    }

    fn is_in_use(&self) -> bool {
        self.shared.intent().is_in_use()
    }

    /// Advances the time; frames to send are passed to `send`.
    pub(super) fn poll(&mut self, now_ns: u64, send: &mut dyn FnMut(CanFrame)) {
        if now_ns.saturating_sub(self.heard_ns) > self.heartbeat_timeout_ns {
            self.shared.latch(faults::HEARTBEAT_LOST);
            self.shared.clear_nmt();
            self.shared.clear_status();
        }
        self.follow_intent(now_ns);
        self.check_command_timeouts(now_ns);
        self.follow_intent(now_ns); // a new fault switches off immediately
        self.ensure_off(now_ns, send);
        self.sync_while_idle(now_ns, send);
        self.send_heartbeat(now_ns, send);
        self.shared.last_pass.set(now_ns);
    }

    /// Follows the intent of the caller; a fault has priority.
    fn follow_intent(&mut self, now_ns: u64) {
        let intent = match self.shared.intent() {
            Intent::Resetting => Intent::Resetting,
            _ if self.shared.fault() != 0 => Intent::Off,
            wanted => wanted,
        };
        let uses = self.shared.uses();
        if (intent, uses) == (self.intent, self.uses) {
            return;
        }
        let was_in_use = self.intent.is_in_use() || uses != self.uses;
        (self.intent, self.uses) = (intent, uses);
        self.on = (intent == Intent::On).then_some(OnWatch {
            since_ns: now_ns,
            commands: self.shared.commands(),
            first_command_ns: None,
            last_command_ns: now_ns,
        });
        self.off = (intent == Intent::Off && was_in_use).then_some(OffWatch {
            since_ns: now_ns,
            repeat_ns: now_ns,
            status_count: self.shared.status_count(),
            escalated: false,
        });
    }

    /// Checks that commands and status frames arrive in time while commands are followed.
    fn check_command_timeouts(&mut self, now_ns: u64) {
        let Some(on) = &mut self.on else { return };
        on.update(self.shared.commands(), now_ns);
        let without_command_ns = now_ns.saturating_sub(on.last_command_ns);
        if on.first_command_ns.is_some() && without_command_ns > self.command_timeout_ns {
            self.shared.latch(faults::COMMANDS_STOPPED);
        }
        // A synchronous drive answers SYNCs, which begin with the first command.
        let since_ns = if self.is_synchronous {
            on.first_command_ns
        } else {
            Some(on.since_ns)
        };
        let Some(since_ns) = since_ns else { return };
        if now_ns.saturating_sub(since_ns.max(self.status_ns)) > self.status_timeout_ns {
            self.shared.latch(faults::STATUS_LOST);
        }
    }

    /// Repeats `disable voltage` until the drive confirms that it is off; after the time limit sends NMT stop and ends the
    /// heartbeat.
    fn ensure_off(&mut self, now_ns: u64, send: &mut dyn FnMut(CanFrame)) {
        let Some(mut watch) = self.off else { return };
        if self.is_confirmed_off(&watch) {
            self.off = None;
            return;
        }
        if now_ns < watch.repeat_ns {
            return;
        }
        watch.repeat_ns = now_ns + REPEAT_NS;
        self.send_disable(send);
        watch.escalated |= now_ns.saturating_sub(watch.since_ns) > self.off_timeout_ns;
        if watch.escalated {
            send(nmt::Command::Stop.frame(self.node));
            self.shared.latch(faults::STILL_ENABLED);
        }
        self.off = Some(watch);
    }

    /// Whether a status frame after the disable reports off.
    fn is_confirmed_off(&self, watch: &OffWatch) -> bool {
        let is_off = matches!(
            self.shared.state(),
            Some(State::SwitchOnDisabled | State::NotReadyToSwitchOn | State::Fault)
        );
        is_off && self.shared.status_count() != watch.status_count
    }

    fn send_disable(&self, send: &mut dyn FnMut(CanFrame)) {
        send(set_point(self.node, DISABLE_VOLTAGE, 0));
        if self.is_synchronous {
            send(sync::FRAME);
        }
    }

    fn sync_while_idle(&mut self, now_ns: u64, send: &mut dyn FnMut(CanFrame)) {
        let is_idle = self.is_synchronous && self.intent == Intent::Off && self.off.is_none();
        if is_idle && now_ns >= self.idle_sync_ns {
            self.idle_sync_ns = now_ns + IDLE_SYNC_NS;
            send(sync::FRAME);
        }
    }

    /// The heartbeat of this program; its end is the last means to stop a drive that does not confirm.
    fn send_heartbeat(&mut self, now_ns: u64, send: &mut dyn FnMut(CanFrame)) {
        let is_silent = self.off.is_some_and(|watch| watch.escalated);
        if !is_silent && now_ns >= self.own_due_ns {
            self.own_due_ns = now_ns + self.own_period_ns;
            send(heartbeat::frame(self.own_node, nmt::State::Operational));
        }
    }
}
