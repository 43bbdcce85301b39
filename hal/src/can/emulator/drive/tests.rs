use super::*;
use crate::can::cia402::*;
use crate::can::heartbeat;
use crate::can::pdo as layout;
use crate::can::pdo::{Direction, Mapped};
use crate::can::sdo::{AbortCode, Answer, Part, Request, Start};

fn booted() -> EmulatedDrive {
    let mut device = EmulatedDrive::new(EmulatedDriveSettings::default());
    let mut out = Vec::new();
    device.poll(0, &mut out);
    assert_eq!(
        out.first(),
        Some(&CanFrame::new(heartbeat::cob_id(5), [0])),
        "the first frame is the boot-up message"
    );
    device
}

fn ask(device: &mut EmulatedDrive, request: Request) -> Answer {
    let mut out = Vec::new();
    device.handle(
        &CanFrame::new(sdo::request_id(5), request.encode()),
        device.now_ns,
        &mut out,
    );
    Answer::decode(out.last().expect("an answer").data()).expect("a known answer")
}

fn write(device: &mut EmulatedDrive, index: u16, sub: u8, value: &[u8]) -> Result<(), AbortCode> {
    let address = Address::new(index, sub);
    match ask(
        device,
        Request::Download(address, Start::Expedited(Part::new(value))),
    ) {
        Answer::Downloaded(_) => Ok(()),
        Answer::Abort(_, code) => Err(code),
        other => panic!("{other:?}"),
    }
}

fn send(device: &mut EmulatedDrive, frame: CanFrame) -> Vec<CanFrame> {
    let mut out = Vec::new();
    device.handle(&frame, device.now_ns, &mut out);
    out
}

/// Operational, controlword and target mapped asynchronously, cyclic torque.
fn operational() -> EmulatedDrive {
    let mut device = booted();
    write(&mut device, 0x1400, 1, &0x8000_0205u32.to_le_bytes()).unwrap();
    for (sub, word) in [(1, 0x6040_0010u32), (2, 0x6071_0010)] {
        write(&mut device, 0x1600, sub, &word.to_le_bytes()).unwrap();
    }
    write(&mut device, 0x1600, 0, &[2]).unwrap();
    write(&mut device, 0x1400, 1, &0x0205u32.to_le_bytes()).unwrap();
    write(&mut device, 0x6060, 0, &[CYCLIC_TORQUE as u8]).unwrap();
    send(&mut device, nmt::Command::Start.frame(5));
    device
}

fn set_point(device: &mut EmulatedDrive, controlword: u16, target: i16) {
    let id = layout::cob_id(Direction::Receive, 1, 5);
    send(device, CanFrame::new(id, layout::pack(controlword, target)));
}

#[test]
fn current_flows_only_with_operation_enabled() {
    let mut device = operational();
    for word in [DISABLE_VOLTAGE, SHUTDOWN, SWITCH_ON] {
        set_point(&mut device, word, 250);
        assert_eq!(device.current_a(), 0.0, "controlword {word:#x}");
    }
    set_point(&mut device, ENABLE_OPERATION, 250);
    assert_eq!(device.current_a(), 1.0, "250 of 1000 counts of 4 A");
    set_point(&mut device, QUICK_STOP, 250);
    assert_eq!(
        (device.current_a(), device.power_state()),
        (0.0, State::QuickStopActive)
    );
}

#[test]
fn enforces_the_rules_of_pdo_mapping() {
    let mut device = booted();
    let word = Mapped::new(Address::new(0x6071, 0), 16).0.to_le_bytes();
    assert_eq!(
        write(&mut device, 0x1600, 1, &word),
        Err(AbortCode::ACCESS),
        "the PDO is on"
    );
    assert_eq!(write(&mut device, 0x1600, 0, &[0]), Err(AbortCode::STATE));
    assert_eq!(
        write(&mut device, 0x1400, 1, &0x0206u32.to_le_bytes()),
        Err(AbortCode::VALUE)
    );
    write(&mut device, 0x1400, 1, &0x8000_0205u32.to_le_bytes()).unwrap();
    write(&mut device, 0x1600, 1, &word).unwrap();
    let other = |index, bits| Mapped::new(Address::new(index, 0), bits).0.to_le_bytes();
    assert_eq!(
        write(&mut device, 0x1600, 2, &other(0x6071, 8)),
        Err(AbortCode::NOT_MAPPABLE),
        "wrong width"
    );
    assert_eq!(
        write(&mut device, 0x1600, 2, &other(0x1017, 16)),
        Err(AbortCode::NOT_MAPPABLE)
    );
    assert_eq!(
        write(&mut device, 0x1600, 2, &other(0x7777, 16)),
        Err(AbortCode::NO_OBJECT)
    );
    for sub in 2..=5 {
        write(&mut device, 0x1600, sub, &word).unwrap();
    }
    assert_eq!(
        write(&mut device, 0x1600, 0, &[5]),
        Err(AbortCode::PDO_LENGTH),
        "five times 16 bits are 80"
    );
    write(&mut device, 0x1600, 0, &[4]).unwrap();
    assert_eq!(
        write(&mut device, 0x1600, 1, &word),
        Err(AbortCode::ACCESS),
        "the count is not 0"
    );
    assert_eq!(write(&mut device, 0x1400, 2, &[252]), Err(AbortCode::VALUE));
}

#[test]
fn rejects_accesses_with_the_abort_codes_of_cia_301() {
    let mut device = booted();
    assert_eq!(
        write(&mut device, 0x1018, 1, &[0; 4]),
        Err(AbortCode::READ_ONLY)
    );
    assert_eq!(
        write(&mut device, 0x6041, 0, &[0; 2]),
        Err(AbortCode::READ_ONLY)
    );
    assert_eq!(write(&mut device, 0x6040, 0, &[0]), Err(AbortCode::LENGTH));
    assert_eq!(
        write(&mut device, 0x7777, 0, &[0]),
        Err(AbortCode::NO_OBJECT)
    );
    assert_eq!(
        write(&mut device, 0x1018, 9, &[0]),
        Err(AbortCode::NO_SUB_INDEX)
    );
    assert_eq!(
        write(&mut device, 0x6060, 0, &[8]),
        Err(AbortCode::VALUE),
        "it has no position mode"
    );
    assert_eq!(
        write(&mut device, 0x6060, 0, &[0x80]),
        Err(AbortCode::VALUE)
    );
}

#[test]
fn switches_off_when_a_monitored_heartbeat_is_lost() {
    let mut device = operational();
    write(
        &mut device,
        0x1016,
        1,
        &heartbeat::consumer_entry(0x7F, 50).to_le_bytes(),
    )
    .unwrap();
    write(&mut device, 0x6007, 0, &[2, 0]).unwrap();
    for word in [SHUTDOWN, SWITCH_ON, ENABLE_OPERATION] {
        set_point(&mut device, word, 250);
    }
    let mut out = Vec::new();
    device.poll(1_000_000_000, &mut out);
    assert_eq!(
        device.current_a(),
        1.0,
        "monitoring begins with the first heartbeat"
    );
    send(&mut device, heartbeat::frame(0x7F, nmt::State::Operational));
    device.poll(1_050_000_000, &mut out);
    assert_eq!(device.current_a(), 1.0, "50 ms are within the limit");
    out.clear();
    device.poll(1_050_000_001, &mut out);
    assert_eq!(
        (device.current_a(), device.power_state()),
        (0.0, State::SwitchOnDisabled)
    );
    let emergency = Emergency {
        code: 0x8130,
        register: 1,
        vendor: [0; 5],
    };
    assert!(out.contains(&emergency.frame(5)));
    assert_eq!(device.nmt_state(), nmt::State::PreOperational);
}

#[test]
fn synchronous_set_points_wait_for_sync() {
    let mut device = operational();
    for word in [SHUTDOWN, SWITCH_ON, ENABLE_OPERATION] {
        set_point(&mut device, word, 0);
    }
    write(&mut device, 0x1400, 2, &[1]).unwrap();
    set_point(&mut device, ENABLE_OPERATION, 500);
    assert_eq!(device.current_a(), 0.0);
    send(&mut device, sync::FRAME);
    assert_eq!(device.current_a(), 2.0);
}

#[test]
fn applies_set_points_in_operational_only_and_rejects_short_ones() {
    let mut device = operational();
    let id = layout::cob_id(Direction::Receive, 1, 5);
    let out = send(&mut device, CanFrame::new(id, [SHUTDOWN as u8, 0, 0]));
    assert_eq!(device.power_state(), State::SwitchOnDisabled);
    assert_eq!(
        out.first()
            .and_then(|frame| Emergency::decode(frame.data()))
            .map(|emergency| emergency.code),
        Some(0x8210)
    );
    send(&mut device, nmt::Command::EnterPreOperational.frame(0));
    set_point(&mut device, SHUTDOWN, 0);
    assert_eq!(device.power_state(), State::SwitchOnDisabled);
}

#[test]
fn stores_a_text_of_any_length() {
    let mut device = booted();
    let address = Address::new(0x2000, 0);
    assert_eq!(
        ask(
            &mut device,
            Request::Download(address, Start::Segmented(Some(9)))
        ),
        Answer::Downloaded(address)
    );
    for (toggle, last, bytes) in [(false, false, &b"bench no"[..7]), (true, true, b" 1")] {
        let part = Part::new(bytes);
        assert_eq!(
            ask(&mut device, Request::DownloadSegment { toggle, last, part }),
            Answer::DownloadedSegment { toggle }
        );
    }
    let started = ask(&mut device, Request::Upload(address));
    assert_eq!(
        started,
        Answer::Uploaded(address, Start::Segmented(Some(9)))
    );
}
