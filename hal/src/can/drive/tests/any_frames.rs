//! Tests with random frames in random order.

use proptest::prelude::*;

use super::super::super::bus::{BusEvent, Condition, Port};
use super::super::super::emulator::DeviceFault;
use super::super::super::frame::{CanFrame, Id};
use super::super::super::pdo;
use super::*;

fn any_condition() -> impl Strategy<Value = Condition> {
    (0u32..0x200, any::<[u8; 8]>()).prop_map(|(class, data)| Condition::decode(class, &data))
}

/// Frames with random content; most of them have an identifier that driver or drive uses.
fn any_frame() -> impl Strategy<Value = CanFrame> {
    let ids = prop_oneof![
        Just(0x000u16),
        Just(0x080),
        Just(0x085),
        Just(0x185),
        Just(0x205),
        Just(0x585),
        Just(0x605),
        Just(0x705),
        Just(0x77F),
        any::<u16>(),
    ];
    (ids, proptest::collection::vec(any::<u8>(), 0..9))
        .prop_map(|(id, data)| CanFrame::from_slice(Id::standard(id), &data).unwrap())
}

fn any_event() -> impl Strategy<Value = BusEvent> {
    prop_oneof![9 => any_frame().prop_map(BusEvent::Frame), 1 => any_condition().prop_map(BusEvent::Condition)]
}

proptest! {
    /// The monitor does not panic. The only set-point that it sends is zero current with the voltage disabled. A
    /// fault stays latched.
    #[test]
    fn monitor_survives_random_events(
        events in proptest::collection::vec((any_event(), 0u64..30_000_000), 1..200), on in any::<bool>(),
    ) {
        let shared = Arc::new(Shared::default());
        let mut monitor = Monitor::new(&DriveSettings::default(), Arc::clone(&shared), 0);
        shared.set_intent(if on { Intent::On } else { Intent::Off });
        let (mut now_ns, mut fault) = (0, 0);
        for (event, later_ns) in events {
            now_ns += later_ns;
            monitor.handle(&event, now_ns);
            let mut sent = Vec::new();
            monitor.poll(now_ns, &mut |frame| sent.push(frame));
            let set_points = sent.iter().filter(|frame| frame.id() == Id::standard(0x205));
            prop_assert!(set_points.clone().all(|frame| pdo::unpack(frame.data()) == Some((DISABLE_VOLTAGE, 0))));
            let known = fault == 0 || fault == faults::DRIVE_FAULT;
            prop_assert!(known || shared.fault() == fault, "a fault stays");
            prop_assert!(fault != 0 || shared.fault() == 0 || !on || set_points.count() == 1, "a new fault switches off");
            fault = shared.fault();
            prop_assert!(fault == 0 || fault_text(fault).what != "unknown fault");
        }
    }

    /// The emulated drive does not panic, and gives current only in Operation Enabled.
    #[test]
    fn emulated_drive_survives_random_frames(
        frames in proptest::collection::vec((any_frame(), 0u64..30_000_000), 1..200),
    ) {
        let mut device = EmulatedDrive::new(EmulatedDriveSettings::default());
        let (mut now_ns, mut out) = (0, Vec::new());
        for (frame, later_ns) in frames {
            now_ns += later_ns;
            device.handle(&frame, now_ns, &mut out);
            device.poll(now_ns, &mut out);
            out.clear();
            prop_assert!(device.power_state() == State::OperationEnabled || device.current_a() == 0.0);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Driver and emulated drive do not panic while another node sends random frames. After this node is removed and
    /// the drive is unplugged, the driver reports a fault.
    #[test]
    fn driver_and_drive_survive_a_babbling_node(frames in proptest::collection::vec(any_frame(), 1..60)) {
        let mut rig = rig(ASYNCHRONOUS);
        let _ = rig.enable();
        let mut babbler = rig.world.endpoint(&[]).unwrap();
        for frame in frames {
            babbler.send(&frame).unwrap();
            let _ = rig.drive.command(1.0);
            rig.sleep_ms(1);
        }
        drop(babbler);
        let _ = rig.reset_fault();
        rig.device().inject(DeviceFault::Unplugged);
        rig.sleep_ms(200);
        prop_assert!(matches!(rig.drive.status(), AmplifierStatus::Fault(_)));
    }
}

/// Feeds 10 million random frames to the monitor, the emulated drive with its SDO server, and an SDO client.
#[test]
fn ten_million_random_frames_do_not_panic() {
    let shared = Arc::new(Shared::default());
    let mut monitor = Monitor::new(&DriveSettings::default(), Arc::clone(&shared), 0);
    let mut device = EmulatedDrive::new(EmulatedDriveSettings::default());
    let (mut client, _) = super::super::super::sdo::Client::upload(Address::new(0x1008, 0));
    let ids = [
        0x000u16, 0x080, 0x085, 0x185, 0x205, 0x585, 0x605, 0x705, 0x77F,
    ];
    let (mut random, mut out) = (0x9E37_79B9_7F4A_7C15u64, Vec::new());
    for n in 0..10_000_000u64 {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        let id = Id::standard(ids[(random >> 32) as usize % ids.len()]);
        let bytes = random.rotate_left(17).wrapping_mul(n | 1).to_le_bytes();
        let frame = CanFrame::from_slice(id, &bytes[..(random >> 48) as usize % 9]).unwrap();
        monitor.handle(&BusEvent::Frame(frame), n * 1000);
        monitor.poll(n * 1000, &mut |_| {});
        device.handle(&frame, n * 1000, &mut out);
        client.answer(frame.data());
        out.clear();
    }
}
