//! A simulated VESC: takes SET_CURRENT, sends STATUS, lets go after half a second without a command.
//!
//! Written from vedderb/bldc, documentation/comm_can.md, like the driver [`crate::can::vesc`]: frames as there.

use std::collections::VecDeque;

use super::super::frame::{CanFrame, Id};
use super::super::vesc::{set_current, status_id};
use super::{DeviceFault, EmulatedAmplifier};

/// Time between STATUS frames: 50 Hz, as delivered.
const STATUS_NS: u64 = 20_000_000;
/// Without a command for so long it lets go.
const TIMEOUT_NS: u64 = 500_000_000;

/// A simulated VESC in current control.
#[derive(Debug)]
pub struct EmulatedVesc {
    node: u8,
    target_ma: i32,
    measured_a: Option<f64>,
    commanded_ns: Option<u64>,
    due_ns: u64,
    now_ns: u64,
    misbehaviour: DeviceFault,
    outbox: VecDeque<(u64, CanFrame)>,
}

impl EmulatedVesc {
    /// A VESC that has just got power.
    pub fn new(node: u8) -> EmulatedVesc {
        let (misbehaviour, outbox) = (DeviceFault::None, VecDeque::new());
        EmulatedVesc {
            node,
            target_ma: 0,
            measured_a: None,
            commanded_ns: None,
            due_ns: 0,
            now_ns: 0,
            misbehaviour,
            outbox,
        }
    }

    /// The identifier of its commands.
    pub fn command_id(&self) -> Id {
        set_current(self.node, 0).id()
    }

    fn take(&mut self, frame: &CanFrame) {
        let deaf = matches!(
            self.misbehaviour,
            DeviceFault::Unplugged | DeviceFault::SetPointsIgnored | DeviceFault::CommandsIgnored
        );
        if let (false, true, Ok(bytes)) = (
            deaf,
            frame.id() == self.command_id(),
            frame.data().try_into(),
        ) {
            (self.target_ma, self.commanded_ns) = (i32::from_be_bytes(bytes), Some(self.now_ns));
        }
    }

    fn let_go_in_time(&mut self) {
        if self
            .commanded_ns
            .is_some_and(|at_ns| self.now_ns.saturating_sub(at_ns) > TIMEOUT_NS)
        {
            (self.target_ma, self.commanded_ns) = (0, None);
        }
    }

    fn tell_status(&mut self) {
        if self.now_ns < self.due_ns {
            return;
        }
        self.due_ns = self.now_ns + STATUS_NS;
        let tenths = (self.measured_a.unwrap_or(self.current_a()) * 10.0) as i16;
        let [high, low] = tenths.to_be_bytes();
        let bytes = [0, 0, 0, 0, high, low, 0, 0];
        let (bytes, late_ns) = match self.misbehaviour {
            DeviceFault::Mute | DeviceFault::Unplugged => return,
            DeviceFault::ShortFrames => (&bytes[..7], 0),
            DeviceFault::Late(late_ms) => (&bytes[..], late_ms.saturating_mul(1_000_000)),
            _ => (&bytes[..], 0),
        };
        let frame = CanFrame::from_slice(status_id(self.node), bytes);
        self.outbox
            .extend(frame.map(|frame| (self.now_ns.saturating_add(late_ns), frame)));
    }
}

impl EmulatedAmplifier for EmulatedVesc {
    fn handle(&mut self, frame: &CanFrame, now_ns: u64, _out: &mut Vec<CanFrame>) {
        self.now_ns = self.now_ns.max(now_ns);
        self.take(frame);
    }

    fn poll(&mut self, now_ns: u64, out: &mut Vec<CanFrame>) {
        self.now_ns = self.now_ns.max(now_ns);
        self.let_go_in_time();
        self.tell_status();
        while let Some((_, frame)) = self
            .outbox
            .pop_front_if(|(due_ns, _)| *due_ns <= self.now_ns)
        {
            out.push(frame);
        }
    }

    fn current_a(&self) -> f64 {
        if self.misbehaviour == DeviceFault::TargetIgnored {
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

    /// A VESC holds the motor as long as somebody commands, be it zero.
    fn is_enabled(&self) -> bool {
        self.commanded_ns.is_some()
    }

    /// It has no power states and no emergency messages.
    fn knows(&self, fault: DeviceFault) -> bool {
        !matches!(
            fault,
            DeviceFault::Drive(_)
                | DeviceFault::EmergencyOnly(_)
                | DeviceFault::InvalidStatusword
                | DeviceFault::SwitchesOff
        )
    }

    fn inject(&mut self, fault: DeviceFault) {
        if !self.knows(fault) {
            return;
        }
        if fault == DeviceFault::Reset {
            let now_ns = self.now_ns;
            *self = EmulatedVesc {
                now_ns,
                due_ns: now_ns + STATUS_NS,
                ..EmulatedVesc::new(self.node)
            };
            return;
        }
        self.misbehaviour = fault;
    }
}
