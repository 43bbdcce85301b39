//! The faults of a VESC. The codes do not change between versions.

use crate::{DeviceError, FaultText};

pub(super) const SILENT: u32 = 1;
pub(super) const BUS_OFF: u32 = 2;
pub(super) const BUS_FAILED: u32 = 3;
pub(super) const NOT_ARMED: u32 = 4;
pub(super) const NOT_SENT: u32 = 5;
pub(super) const COMMANDS_STOPPED: u32 = 6;
pub(super) const THREAD_HUNG: u32 = 7;

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

pub(super) fn text(code: u32) -> FaultText {
    let fault = FAULTS.iter().find(|(known, ..)| *known == code);
    let &(_, what, remedy) = fault.unwrap_or(&(0, "unknown fault", "report the code"));
    FaultText { what, remedy }
}

pub(super) fn error(code: u32) -> DeviceError {
    let FaultText { what, remedy } = text(code);
    DeviceError {
        what,
        remedy,
        code: code.into(),
    }
}
