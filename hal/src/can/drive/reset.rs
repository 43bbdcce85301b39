//! The thread that resets a fault of the drive. A reset waits for answers of the drive, which the loop must not do.
//!
//! ```text
//!  loop    begin_reset: request ----> reset thread: acknowledge, configure a restarted drive again, leave Fault
//!          poll_reset  <------------- outcome
//! ```

use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::super::bus::{BusError, CanBus, Host, Task};
use super::super::cia402::{CYCLIC_TORQUE, DISABLE_VOLTAGE, FAULT_RESET, State};
use super::super::nmt;
use super::access::{STATE_POLL, configure, exchange, wait_for};
use super::errors::OpenError;
use super::faults;
use super::settings::DriveSettings;
use super::setup::Configured;
use super::shared::Shared;

/// Time between two looks for a request.
const IDLE: Duration = Duration::from_millis(10);

/// Largest number of frames and errors that are discarded before a reset: more than a connection holds.
const MAX_DISCARDED: usize = 10_000;

/// The end of a reset.
#[derive(Clone, Copy, Debug)]
pub(super) struct ResetOutcome {
    /// 0, or the code of the fault that prevented the reset.
    pub(super) code: u32,
    /// The configuration of the drive.
    pub(super) configured: Configured,
}

/// Resets faults on request, with its own connection to the bus.
pub(super) struct ResetTask {
    pub(super) bus: Box<dyn CanBus>,
    pub(super) host: Arc<dyn Host>,
    pub(super) shared: Arc<Shared>,
    pub(super) settings: DriveSettings,
    pub(super) configured: Configured,
    pub(super) last_error: Arc<Mutex<Option<OpenError>>>,
    pub(super) outcomes: SyncSender<ResetOutcome>,
    /// Number of requests that were processed.
    pub(super) done: u32,
}

impl Task for ResetTask {
    fn step(&mut self, _now_ns: &dyn Fn() -> u64, wait: Duration) -> Result<(), BusError> {
        let requests = self.shared.resets();
        if requests == self.done {
            if wait > Duration::ZERO {
                self.host.sleep(IDLE);
            }
            return Ok(());
        }
        self.done = requests;
        let outcome = ResetOutcome {
            code: self.reset(),
            configured: self.configured,
        };
        let _ = self.outcomes.try_send(outcome); // there is room: the next request comes after this outcome
        Ok(())
    }
}

impl ResetTask {
    /// Sends NMT start and waits until the heartbeat of the drive reports operational.
    pub(super) fn start(&mut self) -> Result<(), OpenError> {
        self.shared
            .set_must_follow(self.configured.mode == CYCLIC_TORQUE);
        self.bus
            .send(&nmt::Command::Start.frame(self.settings.node))?;
        let timeout = self.settings.times.state_timeout;
        if self.wait_for(timeout, Shared::is_operational) {
            return Ok(());
        }
        Err(OpenError::NotOperational {
            node: self.settings.node,
            timeout_ms: timeout.as_millis(),
        })
    }

    /// Resets the fault. Returns 0, or the code of the fault that remains.
    fn reset(&mut self) -> u32 {
        let before = self.shared.fault();
        self.discard_received();
        if let Err(code) = self.acknowledge() {
            self.shared.end_reset();
            self.shared.latch(if before == 0 { code } else { before });
            return code;
        }
        self.shared.clear_fault();
        self.shared.set_emergency(0);
        self.shared.end_reset();
        self.host.sleep(self.settings.times.heartbeat_timeout); // a cause that persists shows within this time
        self.shared.fault()
    }

    /// Discards what this connection received since the last reset: frames, and the error of an interface that was down meanwhile,
    /// which the system reports once.
    fn discard_received(&mut self) {
        for _ in 0..MAX_DISCARDED {
            if self.bus.receive(Duration::ZERO) == Ok(None) {
                return;
            }
        }
    }

    /// Prepares the drive to be enabled again: it is configured, sends its status, and has left Fault. The error is a fault code.
    fn acknowledge(&mut self) -> Result<(), u32> {
        self.wait_for_fresh_heartbeat();
        if self.shared.restarted() || !self.shared.is_operational() {
            self.configure_again().map_err(|error| {
                *self
                    .last_error
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner) = Some(error);
                faults::NOT_CONFIGURED
            })?;
        }
        self.wait_for_fresh_status()?;
        self.leave_fault()
    }

    /// Restores the configuration after a restart of the drive or the intervention of another master.
    fn configure_again(&mut self) -> Result<(), OpenError> {
        self.shared.set_restarted(false);
        self.shared.clear_nmt();
        let configured = configure(&self.settings, self.bus.as_mut(), self.host.as_ref())?;
        self.configured = Configured {
            identity: self.configured.identity,
            ..configured
        };
        self.start()
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
            self.send(DISABLE_VOLTAGE);
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
                self.send(controlword); // sent twice: with SYNC a command applies at one SYNC and is answered at the next
                self.host.sleep(pause);
            }
        }
        Ok(())
    }

    /// Sends a controlword with the target zero. Only the status frames show its effect.
    fn send(&mut self, controlword: u16) {
        let _ = exchange(self.bus.as_mut(), &self.settings, controlword, 0);
    }

    fn wait_for(&self, limit: Duration, condition: impl Fn(&Shared) -> bool) -> bool {
        wait_for(self.host.as_ref(), &self.shared, limit, condition)
    }

    fn deadline_ns(&self) -> u64 {
        let limit = self.settings.times.state_timeout;
        self.host.now_ns().saturating_add(limit.as_nanos() as u64)
    }
}
