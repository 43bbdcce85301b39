//! The interface goes down or is removed while current flows.

use bench_hal::blocking;
use bench_hal::can::drive::{fault_text, faults};
use std::thread::sleep;

use crate::support::vcan::Vcan;
use crate::support::{Rig, host, open, settings};

#[test]
fn interface_down_stops_the_drive_and_can_be_cleared() {
    let vcan = Vcan::up();
    let mut rig = vcan.running();
    vcan.set_up(false);
    assert_eq!(rig.fault(), faults::BUS_DOWN);
    let text = fault_text(faults::BUS_DOWN);
    assert_eq!(
        (text.what, text.remedy),
        (
            "the CAN interface is down",
            "bring the interface up with `ip link set IFACE up`, then clear the fault"
        )
    );
    assert!(
        blocking::reset_fault(&mut rig.drive, sleep).is_err(),
        "the interface is still down"
    );
    vcan.set_up(true);
    rig.assert_recovers();
}

#[test]
fn removed_adapter_stops_the_drive_and_it_can_be_opened_again() {
    let mut vcan = Vcan::up();
    let mut rig = vcan.running();
    vcan.unplug();
    assert_eq!(rig.fault(), faults::BUS_GONE);
    let text = fault_text(faults::BUS_GONE);
    assert_eq!(
        (text.what, text.remedy),
        (
            "the CAN interface is gone",
            "connect the adapter, then start the program again"
        )
    );
    let Rig { drive, far_end } = rig;
    drop(drive);
    vcan.plug_in();
    let far_end = far_end.moved_to(&host(&vcan.name));
    let drive = open(&vcan.name, settings()).unwrap();
    Rig { drive, far_end }.enabled();
}
