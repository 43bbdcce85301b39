//! Two CAN cards (SJA1000, emulated) on one bus.

use bench_hal::can::bus::{Interface, SocketPort};
use bench_hal::can::drive::inspect;
use socketcan::CanInterface;
use std::time::Duration;

use crate::support::{BIT_RATE, Rig, host, settings};

#[test]
fn drive_on_another_card_runs_and_cards_report_their_state() {
    for card in ["can0", "can1"] {
        let interface = CanInterface::open(card).expect("two cards: use .ci/vm/run --pci");
        interface.set_bitrate(BIT_RATE, None).unwrap();
        interface.set_restart_ms(100).unwrap();
        interface.bring_up().unwrap();
    }
    let mut rig = Rig::new("can0", &host("can1"), settings()).enabled();
    rig.assert_current(-2.0, -2.0);
    for card in ["can0", "can1"] {
        let state = Interface::read(card).unwrap();
        assert!(state.is_up && state.is_healthy, "{state:?}");
        assert_eq!(
            (state.bit_rate, state.state),
            (Some(BIT_RATE), Some("error active"))
        );
        assert_eq!(
            (state.error_counters, state.restart_ms),
            (Some((0, 0)), Some(100))
        );
    }
    drop(rig.drive);
    let state = inspect(&host("can0"), 5, Duration::from_secs(3)).unwrap();
    assert_eq!(state.name.as_deref(), Some("simulated CANopen drive"));

    let refused = SocketPort::open("can0", 500_000).unwrap_err().to_string();
    assert!(
        refused.contains("can0 runs at 1000000 bit/s, but 500000 is configured"),
        "{refused}"
    );
}
