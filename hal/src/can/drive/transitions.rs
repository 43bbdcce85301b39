//! The transition of the drive to Operation Enabled, one step at a call.

use std::task::Poll;

use super::super::cia402::{DISABLE_VOLTAGE, REMOTE, State};
use super::access::STATE_POLL;
use super::shared::Intent;
use super::{CanopenDrive, Enabling, faults};
use crate::DeviceError;

impl CanopenDrive {
    /// Begins the transition. A controlword is sent in [`CanopenDrive::step_towards_enabled`].
    pub(super) fn begin_transition(&mut self) {
        let (now_ns, limit) = (self.host.now_ns(), self.settings.times.state_timeout);
        self.enabling = Enabling {
            deadline_ns: now_ns.saturating_add(limit.as_nanos() as u64),
            step_ns: now_ns,
        };
        self.shared.set_intent(Intent::Enabling);
    }

    /// Sends the next controlword if it is due; the target is zero. Called in the tick: must not allocate or block.
    pub(super) fn step_towards_enabled(&mut self) -> Poll<Result<(), DeviceError>> {
        if self.shared.intent() != Intent::Enabling {
            return Poll::Ready(Err(faults::device_error(faults::NOT_ARMED)));
        }
        let (state, now_ns) = (self.shared.state(), self.host.now_ns());
        if let Err(error) = self.no_fault() {
            return Poll::Ready(Err(error));
        }
        if state == Some(State::OperationEnabled) && self.shared.follows() {
            return Poll::Ready(Ok(()));
        }
        if now_ns >= self.enabling.deadline_ns {
            return Poll::Ready(Err(faults::device_error(self.why_not_enabled())));
        }
        if now_ns < self.enabling.step_ns {
            return Poll::Pending;
        }
        self.enabling.step_ns = now_ns.saturating_add(STATE_POLL.as_nanos() as u64);
        let controlword = state.map_or(Some(DISABLE_VOLTAGE), State::towards_enabled);
        match controlword.map_or(Ok(()), |controlword| self.exchange(controlword, 0)) {
            Ok(()) => Poll::Pending,
            Err(error) => Poll::Ready(Err(error)),
        }
    }

    fn why_not_enabled(&self) -> u32 {
        match (self.shared.state(), self.shared.statusword()) {
            (Some(State::OperationEnabled), _) => faults::TARGET_IGNORED,
            (_, Some(statusword)) if statusword & REMOTE == 0 => faults::NOT_REMOTE,
            (_, None) => faults::STATUS_LOST,
            _ => faults::NOT_ENABLED,
        }
    }
}
