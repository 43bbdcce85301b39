//! The state of an interface as the kernel reports it, and the errors for one that cannot be used.

use bench_hal::can::bus::{Interface, SocketPort};

use crate::support::BIT_RATE;
use crate::support::vcan::Vcan;

fn refusal(name: &str) -> String {
    SocketPort::open(name, BIT_RATE).unwrap_err().to_string()
}

#[test]
fn rejects_unknown_interface_with_command_to_list_them() {
    let refused = refusal("can77");
    assert!(refused.starts_with("CAN interface can77: "), "{refused}");
    assert!(
        refused.ends_with("choose an interface from the list of `ip link show type can`"),
        "{refused}"
    );
}

#[test]
fn rejects_interface_that_is_down_with_command_to_bring_it_up() {
    let vcan = Vcan::down();
    let name = &vcan.name;
    let remedy = format!(
        "CAN interface {name} is down; bring it up with `ip link set {name} up type can bitrate 1000000`"
    );
    assert_eq!(refusal(name), remedy);
    assert!(!Interface::read(name).unwrap().is_up);
}

#[test]
fn virtual_interface_is_healthy_and_has_no_bit_rate() {
    let vcan = Vcan::up();
    let interface = Interface::read(&vcan.name).unwrap();
    assert!(interface.is_up && interface.is_healthy, "{interface:?}");
    assert_eq!((interface.bit_rate, interface.state), (None, None));
}
