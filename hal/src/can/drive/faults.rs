//! The faults of a CANopen drive. The codes do not change between versions.
//!
//! ```text
//! 0x0001_eeee   emergency message of the drive; eeee is its code
//! 0x0002_00nn   communication with the drive
//! 0x0003_00nn   power stage of the drive
//! 0x0004_00nn   the bus
//! 0x0005_00nn   this program
//! ```

use super::super::bus::{BusError, Condition};
use super::super::emcy;
use crate::{DeviceError, FaultText};

/// Emergency messages: the code of the drive is added.
pub const EMERGENCY: u32 = 0x0001_0000;
/// No heartbeat of the drive.
pub const HEARTBEAT_LOST: u32 = 0x0002_0001;
/// The drive restarted by itself.
pub const RESTARTED: u32 = 0x0002_0002;
/// The drive left NMT operational.
pub const NOT_OPERATIONAL: u32 = 0x0002_0003;
/// A frame of the drive does not have the configured layout.
pub const MALFORMED: u32 = 0x0002_0004;
/// The drive did not accept its configuration again.
pub const NOT_CONFIGURED: u32 = 0x0002_0005;
/// State Fault without an emergency message.
pub const DRIVE_FAULT: u32 = 0x0003_0001;
/// The drive switched itself off.
pub const SWITCHED_OFF: u32 = 0x0003_0002;
/// The drive does not follow its target (bit 12 of the statusword).
pub const TARGET_IGNORED: u32 = 0x0003_0003;
/// No status frames.
pub const STATUS_LOST: u32 = 0x0003_0004;
/// The drive did not become enabled in time.
pub const NOT_ENABLED: u32 = 0x0003_0005;
/// The drive does not accept its controlword (bit 9 of the statusword).
pub const NOT_REMOTE: u32 = 0x0003_0006;
/// The drive stays in Fault.
pub const FAULT_REMAINS: u32 = 0x0003_0007;
/// The CAN controller is in bus-off.
pub const BUS_OFF: u32 = 0x0004_0001;
/// The CAN controller is error passive.
pub const BUS_PASSIVE: u32 = 0x0004_0002;
/// The interface is down.
pub const BUS_DOWN: u32 = 0x0004_0003;
/// The interface is gone.
pub const BUS_GONE: u32 = 0x0004_0004;
/// Received frames were lost.
pub const OVERFLOW: u32 = 0x0004_0005;
/// The transmit queue is full.
pub const QUEUE_FULL: u32 = 0x0004_0006;
/// The interface failed for another reason.
pub const BUS_FAILED: u32 = 0x0004_0007;
/// The loop sent no more commands.
pub const COMMANDS_STOPPED: u32 = 0x0005_0001;
/// The drive did not confirm that it is off.
pub const STILL_ENABLED: u32 = 0x0005_0002;
/// A command to a drive that is not enabled.
pub const NOT_ARMED: u32 = 0x0005_0003;
/// A command that is not finite.
pub const NOT_FINITE: u32 = 0x0005_0004;
/// The drive cannot be enabled during a reset.
pub const RESETTING: u32 = 0x0005_0005;
/// The thread that monitors the drive hangs or has ended.
pub const SERVICE_HUNG: u32 = 0x0005_0006;

/// Code, meaning and remedy of every fault except emergency messages.
const FAULTS: [(u32, &str, &str); 25] = [
    // Communication with the drive.
    (
        HEARTBEAT_LOST,
        "the drive's heartbeat is lost",
        "check the drive's power and the CAN cable, then clear the fault",
    ),
    (
        RESTARTED,
        "the drive restarted by itself",
        "check its supply for dips, then clear the fault; this configures the drive again",
    ),
    (
        NOT_OPERATIONAL,
        "the drive left the NMT state operational",
        "look for another NMT master on the bus, then clear the fault",
    ),
    (
        MALFORMED,
        "a frame of the drive does not have the configured layout",
        "look for a second node with the same number, then clear the fault",
    ),
    (
        NOT_CONFIGURED,
        "the drive did not accept its configuration again",
        "open the drive again: the error names the object",
    ),
    // Power stage of the drive.
    (
        DRIVE_FAULT,
        "the drive is in Fault and sent no emergency message",
        "read the drive's display or its error history 0x1003, remove the cause, then clear the fault",
    ),
    (
        SWITCHED_OFF,
        "the drive switched itself off",
        "check its enable input and its supply, then clear the fault",
    ),
    (
        TARGET_IGNORED,
        "the drive does not follow its target (bit 12 of the statusword)",
        "check limits, limit switches and the mode of operation in the drive, then clear the fault",
    ),
    (
        STATUS_LOST,
        "the drive sends no status frames",
        "check the bus load, then clear the fault",
    ),
    (
        NOT_ENABLED,
        "the drive did not reach Operation Enabled in time",
        "check its power stage supply and its enable input",
    ),
    (
        NOT_REMOTE,
        "the drive does not accept commands over CAN (bit 9 of the statusword)",
        "switch the drive from local to remote, and close its commissioning program",
    ),
    (
        FAULT_REMAINS,
        "the drive stays in Fault after the reset",
        "remove the cause first: read the drive's display or its error history 0x1003",
    ),
    // Bus.
    (
        BUS_OFF,
        "the CAN controller is in bus-off",
        "check cable, termination and bit rate; `ip link set IFACE down` and up again, then clear the fault",
    ),
    (
        BUS_PASSIVE,
        "the CAN controller is error passive",
        "check cable, termination and bit rate, then clear the fault",
    ),
    (
        BUS_DOWN,
        "the CAN interface is down",
        "bring the interface up with `ip link set IFACE up`, then clear the fault",
    ),
    (
        BUS_GONE,
        "the CAN interface is gone",
        "connect the adapter, then start the program again",
    ),
    (
        OVERFLOW,
        "received CAN frames were lost",
        "lower the traffic on the bus, then clear the fault",
    ),
    (
        QUEUE_FULL,
        "the transmit queue of the CAN interface is full",
        "check that the drive is on the bus, or lower the rate",
    ),
    (
        BUS_FAILED,
        "the CAN interface failed",
        "read the kernel's messages (dmesg), then clear the fault",
    ),
    // This program.
    (
        COMMANDS_STOPPED,
        "the loop sent no more commands and the drive was switched off",
        "look for overruns (the limit is the setting command_timeout)",
    ),
    (
        STILL_ENABLED,
        "the drive did not confirm that it is off, so it was stopped by NMT and the heartbeat of this program ended",
        "disconnect the drive's power, find the cause, then clear the fault",
    ),
    (NOT_ARMED, "the drive is not enabled", "arm first"),
    (
        NOT_FINITE,
        "the commanded current is not a finite number",
        "report this fault of the program",
    ),
    (
        RESETTING,
        "the fault of the drive is still being reset",
        "arm again after the reset",
    ),
    (
        SERVICE_HUNG,
        "the thread that monitors the drive has not run within its time limit (20 ms by default)",
        "stop programs that use all processors, then clear the fault; if it remains, start the program again",
    ),
];

/// Meaning and remedy of a code.
pub fn fault_text(code: u32) -> FaultText {
    if code & 0xFFFF_0000 == EMERGENCY {
        return FaultText {
            what: emcy::text(code as u16),
            remedy: "remove the cause, then clear the fault (the drive reports this in an emergency message)",
        };
    }
    let fault = FAULTS.iter().find(|(known, ..)| *known == code);
    let (what, remedy) = fault.map_or(UNKNOWN, |&(_, what, remedy)| (what, remedy));
    FaultText { what, remedy }
}

const UNKNOWN: (&str, &str) = ("unknown fault", "report the code");

/// Whether `code` describes the same fault as `first` more precisely: an emergency message after the state Fault; an interface
/// that is gone, because it goes down first when the adapter is unplugged.
pub(super) const fn explains(code: u32, first: u32) -> bool {
    match first {
        DRIVE_FAULT => code >> 16 == EMERGENCY >> 16,
        BUS_DOWN => code == BUS_GONE,
        _ => false,
    }
}

/// The error of a call that fails with this fault.
pub(super) fn device_error(code: u32) -> DeviceError {
    let FaultText { what, remedy } = fault_text(code);
    DeviceError {
        what,
        remedy,
        code: code as i64,
    }
}

/// The code of an interface error.
pub(super) const fn of_bus_error(error: BusError) -> u32 {
    match error {
        BusError::QueueFull => QUEUE_FULL,
        BusError::Down => BUS_DOWN,
        BusError::Gone => BUS_GONE,
        BusError::Other(_) => BUS_FAILED,
    }
}

/// The code of a controller condition that is a fault.
pub(super) const fn of_condition(condition: Condition) -> Option<u32> {
    match condition {
        Condition::BusOff => Some(BUS_OFF),
        Condition::Passive => Some(BUS_PASSIVE),
        Condition::Overflow => Some(OVERFLOW),
        Condition::Warning | Condition::NoAcknowledge | Condition::Active | Condition::Noise => {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The constants above by their names, so that one without a row in [`FAULTS`] is found.
    const CODES: [u32; 25] = [
        HEARTBEAT_LOST,
        RESTARTED,
        NOT_OPERATIONAL,
        MALFORMED,
        NOT_CONFIGURED,
        DRIVE_FAULT,
        SWITCHED_OFF,
        TARGET_IGNORED,
        STATUS_LOST,
        NOT_ENABLED,
        NOT_REMOTE,
        FAULT_REMAINS,
        BUS_OFF,
        BUS_PASSIVE,
        BUS_DOWN,
        BUS_GONE,
        OVERFLOW,
        QUEUE_FULL,
        BUS_FAILED,
        COMMANDS_STOPPED,
        STILL_ENABLED,
        NOT_ARMED,
        NOT_FINITE,
        RESETTING,
        SERVICE_HUNG,
    ];

    #[test]
    fn every_code_has_its_own_text() {
        let texts = CODES.map(fault_text);
        let whats: std::collections::HashSet<_> = texts.iter().map(|text| text.what).collect();
        assert_eq!(whats.len(), CODES.len());
        assert_eq!(FAULTS.len(), CODES.len());
        assert!(!whats.contains("unknown fault"));
        assert_eq!(fault_text(EMERGENCY + 0x4210).what, "drive too hot");
        assert_eq!(fault_text(0x0009_0000).what, "unknown fault");
    }
}
