//! The drive's way up to Operation Enabled, and out of Fault.

use super::super::cia402::{DISABLE_VOLTAGE, FAULT_RESET, REMOTE, State};
use super::super::nmt;
use super::{CanopenDrive, LOOK, faults};
use crate::DeviceError;

impl CanopenDrive {
    /// Step by step up to Operation Enabled, with zero target all the way.
    pub(super) fn climb(&mut self) -> Result<(), DeviceError> {
        let deadline_ns = self.deadline_ns();
        loop {
            self.no_fault()?;
            let state = self.shared.state();
            if state == Some(State::OperationEnabled) && self.shared.follows() {
                return Ok(());
            }
            if self.host.now_ns() >= deadline_ns {
                return Err(faults::device_error(self.why_not_enabled()));
            }
            let next = state.map_or(Some(DISABLE_VOLTAGE), State::towards_enabled);
            next.map_or(Ok(()), |controlword| self.exchange(controlword, 0))?;
            self.host.sleep(LOOK);
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

    /// Makes the drive fit to be enabled again: configured, alive, out of Fault. The code of what prevents it.
    pub(super) fn acknowledge(&mut self) -> Result<(), u32> {
        self.wait_for_fresh_heartbeat();
        let is_operational = self.shared.nmt() == Some(nmt::State::Operational);
        if self.shared.restarted() || !is_operational {
            self.configure_again().map_err(|error| {
                self.last_error = Some(error);
                faults::NOT_CONFIGURED
            })?;
        }
        self.wait_for_fresh_status()?;
        self.leave_fault()
    }

    /// What the last heartbeat said may be past: the drive missed ours, or was stopped, and has not said so yet. None
    /// may come; what that means is the caller's business.
    fn wait_for_fresh_heartbeat(&self) {
        self.shared.forget_nmt();
        self.wait_for(self.settings.heartbeat_timeout, |shared| {
            shared.nmt().is_some()
        });
    }

    /// A status frame that was sent after this call began: the drive and the bus are alive now.
    fn wait_for_fresh_status(&mut self) -> Result<(), u32> {
        let (deadline_ns, before) = (self.deadline_ns(), self.shared.status_count());
        while self.shared.status_count() == before || self.shared.state().is_none() {
            if self.host.now_ns() >= deadline_ns {
                return Err(faults::STATUS_LOST);
            }
            let _ = self.exchange(DISABLE_VOLTAGE, 0); // the answer is what counts
            self.host.sleep(LOOK);
        }
        Ok(())
    }

    /// Rising edges of the reset bit until the drive has left Fault.
    fn leave_fault(&mut self) -> Result<(), u32> {
        let deadline_ns = self.deadline_ns();
        let pause = LOOK.max(2 * self.settings.status_period());
        while matches!(
            self.shared.state(),
            None | Some(State::Fault | State::FaultReactionActive)
        ) {
            if self.host.now_ns() >= deadline_ns {
                return Err(faults::FAULT_REMAINS);
            }
            for controlword in [DISABLE_VOLTAGE, FAULT_RESET, FAULT_RESET, DISABLE_VOLTAGE] {
                let _ = self.exchange(controlword, 0); // twice with SYNC: taken at one, answered at the next
                self.host.sleep(pause);
            }
        }
        Ok(())
    }
}
