//! Errors of the bus as a kernel driver reports them: slcan, with an adapter that the test controls.

use std::time::Duration;

use bench_hal::blocking;
use bench_hal::can::Id;
use bench_hal::can::bus::{BusEvent, CanBus, Condition, Interface, Port, SocketPort, SystemHost};
use bench_hal::can::drive::{fault_text, faults};
use bench_hal::{AmplifierStatus, CurrentAmplifier};
use std::thread::sleep;

use crate::support::adapter::Adapter;
use crate::support::{BIT_RATE, Rig, host, settings, wait_for};

/// The next condition of the bus. Errors while the interface is down are ignored.
fn condition(bus: &mut dyn CanBus) -> Condition {
    let mut found = None;
    wait_for("a condition", || {
        if let Ok(Some(BusEvent::Condition(condition))) = bus.receive(Duration::from_millis(100)) {
            found = Some(condition);
        }
        found.is_some()
    });
    found.unwrap()
}

/// One test, because there is one adapter; each part depends on the previous one.
#[test]
fn bus_off_is_a_fault_that_can_be_cleared_after_an_interface_restart() {
    let adapter = Adapter::new();
    let name = adapter.name.clone();
    let mut listener = host(&name).endpoint(&[Id::standard(0x7FF)]).unwrap(); // an unused identifier: conditions only
    let mut rig = Rig::new(&name, &SystemHost::new(adapter.far_side()), settings()).enabled();

    adapter.send("sw096000");
    assert_eq!(condition(listener.as_mut()), Condition::Warning);
    rig.assert_current(-1.0, -1.0);
    let interface = Interface::read(&name).unwrap();
    assert_eq!(
        (interface.state, interface.is_healthy, interface.bit_rate),
        (Some("error warning"), true, Some(BIT_RATE))
    );

    adapter.enter_bus_off();
    assert_eq!(condition(listener.as_mut()), Condition::BusOff);
    assert_eq!(rig.fault(), faults::BUS_OFF);
    let text = fault_text(faults::BUS_OFF);
    assert_eq!(text.what, "the CAN controller is in bus-off");
    assert!(
        text.remedy
            .contains("`ip link set IFACE down` and up again, then clear the fault"),
        "{}",
        text.remedy
    );
    assert_eq!(Interface::read(&name).unwrap().state, Some("bus off"));
    let refused = SocketPort::open(&name, BIT_RATE).unwrap_err().to_string();
    assert!(
        refused.contains("is in state bus off; check cable, termination and bit rate"),
        "{refused}"
    );
    assert!(
        blocking::reset_fault(&mut rig.drive, sleep).is_err(),
        "the controller is still in bus-off"
    );
    assert_eq!(rig.drive.status(), AmplifierStatus::Fault(faults::BUS_OFF));

    adapter.restart_interface();
    rig.assert_recovers();

    adapter.send("sp128000");
    assert_eq!(condition(listener.as_mut()), Condition::Passive);
    assert_eq!(rig.fault(), faults::BUS_PASSIVE);
    adapter.send("sa000000");
    rig.assert_recovers();
}
