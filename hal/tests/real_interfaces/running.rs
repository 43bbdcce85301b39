//! From power-on to current and back over a real socket.

use std::time::Duration;

use bench_hal::blocking;
use bench_hal::can::budget::Exchange;
use bench_hal::can::bus::{BusEvent, Port};
use bench_hal::can::cia402::State;
use bench_hal::can::drive::{DriveSettings, ExpectedIdentity, inspect};
use bench_hal::can::sdo::Address;
use bench_hal::can::{CanFrame, Id, nmt};
use bench_hal::{AmplifierStatus, CurrentAmplifier};
use std::thread::sleep;

use crate::support::vcan::Vcan;
use crate::support::{FarEnd, Rig, host, refusal, settings, wait_for};

#[test]
fn drive_follows_quantised_set_points_and_is_disabled() {
    for exchange in [
        Exchange::Asynchronous { status_hz: 500.0 },
        Exchange::Synchronous { status_every: 1 },
    ] {
        let vcan = Vcan::up();
        let mut rig = vcan.rig(DriveSettings {
            exchange,
            ..settings()
        });
        assert_eq!(rig.drive.status(), AmplifierStatus::Disabled);
        blocking::enable(&mut rig.drive, sleep).unwrap();
        assert_eq!(
            (rig.drive.status(), rig.far_end.current_a()),
            (AmplifierStatus::Enabled, 0.0)
        );
        // 1 A of 4 A is 250 counts; 0.9985 A is 249.6 counts, rounded to 250; above the limit of 4 A the value is 1000 counts.
        for (command_a, applied_a) in [
            (1.0, 1.0),
            (-2.0, -2.0),
            (0.9985, 1.0),
            (-0.003, -0.004),
            (9.0, 4.0),
        ] {
            rig.assert_current(command_a, applied_a);
        }
        rig.drive.disable();
        assert_eq!(rig.drive.status(), AmplifierStatus::Disabled);
        rig.far_end.wait_until_off();
        assert_eq!(
            rig.far_end.device().power_state(),
            State::SwitchOnDisabled,
            "{exchange:?}"
        );
    }
}

#[test]
fn closing_leaves_the_drive_off_and_pre_operational() {
    let vcan = Vcan::up();
    let Rig { drive, far_end } = vcan.running();
    drop(drive);
    wait_for("pre-operational, without heartbeat monitoring", || {
        let device = far_end.device();
        (device.nmt_state(), device.read(Address::new(0x1016, 1)))
            == (nmt::State::PreOperational, 0)
    });
    far_end.wait_until_off();
}

#[test]
fn rejects_drive_with_unexpected_identity() {
    let vcan = Vcan::up();
    let _far_end = FarEnd::new(&vcan.name, &host(&vcan.name));
    let inspection = inspect(&host(&vcan.name), 5, Duration::from_secs(3)).unwrap();
    assert_eq!(
        inspection.name.as_deref(),
        Some("simulated CANopen drive"),
        "read in four segments"
    );
    assert_eq!(
        (inspection.identity, inspection.rated_current_a),
        ([0x402, 1, 0x1_0000, 1].map(Some), Some(4.0))
    );
    let identity = ExpectedIdentity {
        serial: Some(7),
        ..ExpectedIdentity::default()
    };
    let refused = refusal(
        &vcan.name,
        DriveSettings {
            identity,
            ..settings()
        },
    );
    assert!(
        refused.contains("the serial number of node 5 is 0x00000001, but 0x00000007 is configured"),
        "{refused}"
    );
}

#[test]
fn endpoint_receives_only_its_identifiers_in_their_format() {
    let vcan = Vcan::up();
    let host = host(&vcan.name);
    let (mut all, ids) = (
        host.endpoint(&[]).unwrap(),
        [Id::standard(0x185), Id::extended(0x905)],
    );
    let mut some = host.endpoint(&ids).unwrap();
    let others = [
        Id::extended(0x185),
        Id::standard(0x105),
        Id::standard(0x186),
        Id::extended(0x1000_0905),
    ];
    for id in others.into_iter().chain(ids) {
        all.send(&CanFrame::new(id, [1, 2])).unwrap();
    }
    for id in ids {
        let received = some.receive(Duration::from_secs(3)).unwrap();
        assert_eq!(received, Some(BusEvent::Frame(CanFrame::new(id, [1, 2]))));
    }
    assert_eq!(some.receive(Duration::from_millis(50)), Ok(None));
    assert_eq!(
        all.receive(Duration::from_millis(50)),
        Ok(None),
        "an endpoint does not receive its own frames"
    );
}
