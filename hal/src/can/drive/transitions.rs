//! Transitions of the drive: to Operation Enabled, and out of Fault.

use super::super::cia402::{DISABLE_VOLTAGE, FAULT_RESET, REMOTE, State};
use super::{CanopenDrive, STATE_POLL, faults};
use crate::DeviceError;

impl CanopenDrive {
    /// Enables the drive step by step; the target is zero.
    pub(super) fn enable_stepwise(&mut self) -> Result<(), DeviceError> {
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
            if let Some(controlword) = state.map_or(Some(DISABLE_VOLTAGE), State::towards_enabled) {
                self.exchange(controlword, 0)?;
            }
            self.host.sleep(STATE_POLL);
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

    /// Prepares the drive to be enabled again: it is configured, sends its status, and has left Fault. The error is a fault code.
    pub(super) fn acknowledge(&mut self) -> Result<(), u32> {
        self.wait_for_fresh_heartbeat();
        if self.shared.restarted() || !self.shared.is_operational() {
            self.configure_again().map_err(|error| {
                self.last_error = Some(error);
                faults::NOT_CONFIGURED
            })?;
        }
        self.wait_for_fresh_status()?;
        self.leave_fault()
    }

    /// Waits for a heartbeat that is newer than this call. The last one may be outdated, if the drive lost the heartbeat of this
    /// program or was stopped meanwhile. The caller checks whether one arrived.
    fn wait_for_fresh_heartbeat(&self) {
        self.shared.clear_nmt();
        self.wait_for(self.settings.times.heartbeat_timeout, |shared| {
            shared.nmt().is_some()
        });
    }

    /// Waits for a status frame that is newer than this call. It shows that drive and bus work.
    fn wait_for_fresh_status(&mut self) -> Result<(), u32> {
        let (deadline_ns, before) = (self.deadline_ns(), self.shared.status_count());
        while self.shared.status_count() == before || self.shared.state().is_none() {
            if self.host.now_ns() >= deadline_ns {
                return Err(faults::STATUS_LOST);
            }
            let _ = self.exchange(DISABLE_VOLTAGE, 0); // only the status frame matters
            self.host.sleep(STATE_POLL);
        }
        Ok(())
    }

    /// Sends rising edges of the reset bit until the drive has left Fault.
    fn leave_fault(&mut self) -> Result<(), u32> {
        let deadline_ns = self.deadline_ns();
        let pause = STATE_POLL.max(2 * self.settings.status_period());
        while self.shared.state().is_none_or(State::is_fault) {
            if self.host.now_ns() >= deadline_ns {
                return Err(faults::FAULT_REMAINS);
            }
            for controlword in [DISABLE_VOLTAGE, FAULT_RESET, FAULT_RESET, DISABLE_VOLTAGE] {
                let _ = self.exchange(controlword, 0); // sent twice: with SYNC a command applies at one SYNC and is answered at the next
                self.host.sleep(pause);
            }
        }
        Ok(())
    }
}
