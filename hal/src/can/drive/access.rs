//! Access to the drive, for the loop and for the reset thread.

use std::time::Duration;

use super::super::budget::Exchange;
use super::super::bus::{CanBus, Host};
use super::super::sdo::Channel;
use super::super::sync;
use super::errors::OpenError;
use super::faults;
use super::monitor::set_point;
use super::settings::DriveSettings;
use super::setup::{Configured, Setup};
use super::shared::Shared;
use crate::DeviceError;

/// Time between checks of the state of the drive while it changes.
pub(super) const STATE_POLL: Duration = Duration::from_millis(2);

/// Sends a set-point, and SYNC if the exchange is synchronous. Called in the tick: must not allocate or block.
pub(super) fn exchange(
    bus: &mut dyn CanBus,
    settings: &DriveSettings,
    controlword: u16,
    target: i16,
) -> Result<(), DeviceError> {
    let frame = set_point(settings.node, controlword, target);
    let mut sent = bus.send(&frame);
    if sent.is_ok() && matches!(settings.exchange, Exchange::Synchronous { .. }) {
        sent = bus.send(&sync::FRAME);
    }
    sent.map_err(|error| faults::device_error(faults::of_bus_error(error)))
}

/// Waits until `condition` holds; `false` if it does not within `limit`.
pub(super) fn wait_for(
    host: &dyn Host,
    shared: &Shared,
    limit: Duration,
    condition: impl Fn(&Shared) -> bool,
) -> bool {
    let deadline_ns = host.now_ns().saturating_add(limit.as_nanos() as u64);
    while !condition(shared) {
        if host.now_ns() >= deadline_ns {
            return false;
        }
        host.sleep(STATE_POLL);
    }
    true
}

pub(super) fn channel<'a>(
    settings: &DriveSettings,
    bus: &'a mut dyn CanBus,
    host: &'a dyn Host,
) -> Channel<'a> {
    Channel {
        bus,
        host,
        node: settings.node,
        timeout: settings.times.sdo_timeout,
    }
}

pub(super) fn configure(
    settings: &DriveSettings,
    bus: &mut dyn CanBus,
    host: &dyn Host,
) -> Result<Configured, OpenError> {
    Setup {
        channel: channel(settings, bus, host),
        settings,
    }
    .run()
}
