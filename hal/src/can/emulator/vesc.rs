//! An emulated VESC: takes SET_CURRENT, sends STATUS, and releases the motor after 0.5 s without a command.
//!
//! Source: vedderb/bldc, documentation/comm_can.md; frames as in [`crate::can::vesc`].

use std::collections::VecDeque;

use super::super::frame::{CanFrame, Id};
use super::super::vesc::{set_current, status_id};
use super::amplifier::EmulatedAmplifier;
use super::fault::DeviceFault;

/// Time between STATUS frames: 50 Hz, the factory setting.
const STATUS_PERIOD_NS: u64 = 20_000_000;
/// Time without a command after which the motor is released.
const COMMAND_TIMEOUT_NS: u64 = 500_000_000;

/// An emulated VESC in current control.
#[derive(Debug)]
pub struct EmulatedVesc {
    node: u8,
    target_ma: i32,
    measured_a: Option<f64>,
    last_command_ns: Option<u64>,
    next_status_ns: u64,
    now_ns: u64,
    fault: DeviceFault,
    outbox: VecDeque<(u64, CanFrame)>,
}

impl EmulatedVesc {
    /// A VESC after power-on.
    pub fn new(node: u8) -> EmulatedVesc {
        EmulatedVesc {
            node,
            target_ma: 0,
            measured_a: None,
            last_command_ns: None,
            next_status_ns: 0,
            now_ns: 0,
            fault: DeviceFault::None,
            outbox: VecDeque::new(),
        }
    }

    /// The identifier of its commands.
    pub fn command_id(&self) -> Id {
        set_current(self.node, 0).id()
    }

    fn ignores_commands(&self) -> bool {
        matches!(
            self.fault,
            DeviceFault::Unplugged | DeviceFault::SetPointsIgnored | DeviceFault::CommandsIgnored
        )
    }

    fn release_without_command(&mut self) {
        let last_ns = self.last_command_ns;
        if last_ns.is_some_and(|last_ns| self.now_ns.saturating_sub(last_ns) > COMMAND_TIMEOUT_NS) {
            self.target_ma = 0;
            self.last_command_ns = None;
        }
    }

    fn send_due_status(&mut self) {
        if self.now_ns >= self.next_status_ns {
            self.next_status_ns = self.now_ns + STATUS_PERIOD_NS;
            self.send(self.status());
        }
    }

    /// STATUS with the current in units of 0.1 A.
    fn status(&self) -> [u8; 8] {
        let current_a = self.measured_a.unwrap_or(self.current_a());
        let [high, low] = ((current_a * 10.0) as i16).to_be_bytes();
        [0, 0, 0, 0, high, low, 0, 0]
    }

    fn send(&mut self, status: [u8; 8]) {
        let (length, delay_ms) = match self.fault {
            DeviceFault::Mute | DeviceFault::Unplugged => return,
            DeviceFault::ShortFrames => (7, 0),
            DeviceFault::Late(delay_ms) => (8, delay_ms),
            _ => (8, 0),
        };
        let delay_ns = delay_ms.saturating_mul(1_000_000);
        let due_ns = self.now_ns.saturating_add(delay_ns);
        let frame = CanFrame::from_slice(status_id(self.node), &status[..length]);
        self.outbox.extend(frame.map(|frame| (due_ns, frame)));
    }
}

impl EmulatedAmplifier for EmulatedVesc {
    fn handle(&mut self, frame: &CanFrame, now_ns: u64, _out: &mut Vec<CanFrame>) {
        self.now_ns = self.now_ns.max(now_ns);
        if frame.id() != self.command_id() || self.ignores_commands() {
            return;
        }
        if let Ok(bytes) = frame.data().try_into() {
            self.target_ma = i32::from_be_bytes(bytes);
            self.last_command_ns = Some(self.now_ns);
        }
    }

    fn poll(&mut self, now_ns: u64, out: &mut Vec<CanFrame>) {
        self.now_ns = self.now_ns.max(now_ns);
        self.release_without_command();
        self.send_due_status();
        let now_ns = self.now_ns;
        while let Some((_, frame)) = self.outbox.pop_front_if(|(due_ns, _)| *due_ns <= now_ns) {
            out.push(frame);
        }
    }

    fn current_a(&self) -> f64 {
        if self.fault == DeviceFault::TargetIgnored {
            0.0
        } else {
            f64::from(self.target_ma) * 1e-3
        }
    }

    fn set_measured_current_a(&mut self, current_a: Option<f64>) {
        self.measured_a = current_a;
    }

    fn state(&self) -> &'static str {
        if self.is_enabled() {
            "driving"
        } else {
            "released"
        }
    }

    /// A VESC drives the motor as long as it receives commands, even of zero current.
    fn is_enabled(&self) -> bool {
        self.last_command_ns.is_some()
    }

    /// A VESC has neither power states nor emergency messages.
    fn supports(&self, fault: DeviceFault) -> bool {
        !matches!(
            fault,
            DeviceFault::Drive(_)
                | DeviceFault::EmergencyOnly(_)
                | DeviceFault::InvalidStatusword
                | DeviceFault::SwitchesOff
        )
    }

    fn inject(&mut self, fault: DeviceFault) {
        if fault == DeviceFault::Reset {
            *self = EmulatedVesc {
                now_ns: self.now_ns,
                next_status_ns: self.now_ns + STATUS_PERIOD_NS,
                ..EmulatedVesc::new(self.node)
            };
        } else if self.supports(fault) {
            self.fault = fault;
        }
    }
}
