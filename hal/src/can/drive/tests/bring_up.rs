//! Tests: from power-on to current and back, and the drives and settings that are rejected.

use super::super::super::bus::Port;
use super::super::super::cia402::{CYCLIC_TORQUE, PROFILE_TORQUE};
use super::super::super::emulator::DeviceFault;
use super::super::super::frame::Id;
use super::super::super::scale::Reference;
use super::*;

#[test]
fn enables_follows_quantised_currents_and_disables() {
    for exchange in [ASYNCHRONOUS, SYNCHRONOUS] {
        let mut rig = rig(exchange);
        assert_eq!(rig.drive.status(), AmplifierStatus::Disabled);
        assert_eq!(rig.drive.mode(), CYCLIC_TORQUE);
        rig.enable().unwrap();
        assert_eq!(rig.drive.status(), AmplifierStatus::Enabled);
        assert_eq!(rig.device_current_a(), 0.0, "enabled means zero current");

        // 1 A of 4 A is 250 counts; 0.9985 A is 249.6 counts, so 250; beyond the limit of 4 A 1000 counts remain.
        for (wanted_a, given_a) in [
            (1.0, 1.0),
            (0.9985, 1.0),
            (-0.003, -0.004),
            (9.0, 4.0),
            (-9.0, -4.0),
        ] {
            assert_eq!(rig.drive.command(wanted_a), Ok(given_a));
            rig.sleep_ms(1);
            assert!(
                (rig.device_current_a() - given_a).abs() < 1e-12,
                "{exchange:?}: {wanted_a}"
            );
        }
        assert_eq!(rig.run_ms(-2.0, 20), 20);
        assert_eq!(rig.drive.actual_current_a(), Some(-2.0));

        rig.drive.disable();
        rig.sleep_ms(5);
        assert_eq!(
            (rig.device_current_a(), rig.device().power_state()),
            (0.0, State::SwitchOnDisabled)
        );
        assert_eq!(rig.drive.status(), AmplifierStatus::Disabled);
        rig.drive.disable();
        rig.enable().unwrap();
        assert_eq!(
            rig.device_current_a(),
            0.0,
            "an old set-point does not come back"
        );
    }
}

#[test]
fn enabling_and_resetting_do_not_wait_in_the_calls_of_the_loop() {
    for exchange in [ASYNCHRONOUS, SYNCHRONOUS] {
        let mut rig = rig(exchange);
        let begun_ns = rig.world.now_ns();
        rig.drive.begin_enable().unwrap();
        assert!(rig.drive.poll_enable().is_pending());
        rig.drive.begin_reset().unwrap();
        assert!(rig.drive.poll_reset().is_pending());
        assert_eq!(
            rig.drive.begin_enable().unwrap_err().code,
            i64::from(faults::RESETTING)
        );
        assert_eq!(rig.world.now_ns(), begun_ns);
        rig.sleep_ms(1); // the simulated thread of the reset runs to its end
        assert_eq!(rig.drive.poll_reset(), Poll::Ready(Ok(())));
        rig.enable().unwrap();
    }
}

#[test]
fn controlwords_are_sent_every_two_milliseconds_while_the_drive_is_enabled() {
    let mut rig = rig(ASYNCHRONOUS);
    rig.device().inject(DeviceFault::SetPointsIgnored);
    let mut listener = rig.world.endpoint(&[Id::standard(0x205)]).unwrap();
    rig.drive.begin_enable().unwrap();
    // Two calls at each time, in ms.
    for (pause_ms, sent) in [(0, 1), (1, 0), (1, 1), (1, 0), (4, 1), (1, 0)] {
        rig.sleep_ms(pause_ms);
        assert!(rig.drive.poll_enable().is_pending());
        assert!(rig.drive.poll_enable().is_pending());
        let frames = std::iter::from_fn(|| listener.receive(Duration::ZERO).unwrap());
        assert_eq!(frames.count(), sent, "after {pause_ms} ms");
    }
}

#[test]
fn disable_wins_over_enabling() {
    for exchange in [ASYNCHRONOUS, SYNCHRONOUS] {
        let mut rig = rig(exchange);
        rig.drive.begin_enable().unwrap();
        while rig.device().power_state() != State::OperationEnabled {
            assert_eq!(rig.drive.poll_enable(), Poll::Pending);
            rig.sleep_ms(1);
        }
        rig.drive.disable();
        let not_enabled = faults::device_error(faults::NOT_ARMED);
        for _ in 0..20 {
            assert_eq!(rig.drive.poll_enable(), Poll::Ready(Err(not_enabled)));
            assert_eq!(rig.drive.command(1.0), Err(not_enabled));
            rig.sleep_ms(1);
        }
        assert_eq!(rig.device().power_state(), State::SwitchOnDisabled);
        assert_eq!(rig.drive.status(), AmplifierStatus::Disabled);
    }
}

#[test]
fn synchronous_set_points_take_effect_with_their_sync() {
    let rig = rig(SYNCHRONOUS);
    let device = rig.device();
    let transmission = |index| device.read(Address::new(index, 2));
    assert_eq!((transmission(0x1400), transmission(0x1800)), (1, 2));
}

#[test]
fn configures_heartbeat_monitoring_and_its_reaction() {
    let rig = rig(ASYNCHRONOUS);
    let device = rig.device();
    assert_eq!(
        device.read(Address::new(0x1016, 1)),
        0x007F_0046,
        "node 0x7F, 70 ms"
    );
    assert_eq!(device.read(Address::new(0x1017, 0)), 20);
    assert_eq!(device.read(Address::new(0x6007, 0)), 2);
    assert_eq!(device.read(Address::new(0x1A00, 1)), 0x6041_0010);
    assert_eq!(
        (
            device.read(Address::new(0x1800, 3)),
            device.read(Address::new(0x1800, 5))
        ),
        (20, 2),
        "2 ms both"
    );
}

#[test]
fn uses_profile_torque_without_cyclic_torque() {
    let device = EmulatedDriveSettings {
        modes: 1 << (PROFILE_TORQUE - 1),
        ..EmulatedDriveSettings::default()
    };
    let mut rig = open(DriveSettings::default(), device.clone()).unwrap();
    assert_eq!(rig.drive.mode(), PROFILE_TORQUE);
    assert_eq!(
        rig.device().read(Address::new(0x6087, 0)),
        u32::MAX,
        "the slope is the largest"
    );
    rig.enable().unwrap();
    rig.run_ms(1.0, 5);
    assert_eq!(rig.device_current_a(), 1.0);
    let refused = refusal(
        DriveSettings {
            mode: TorqueMode::Cyclic,
            ..DriveSettings::default()
        },
        device,
    );
    assert!(refused.contains("0x6502 = 0x00000008"), "{refused}");
}

#[test]
fn scales_a_target_in_per_mille_of_the_maximum() {
    // 0x6072 = 1500 per mille of 4 A: 1000 counts are 6 A, one count 6 mA.
    let settings = DriveSettings {
        reference: Reference::Maximum,
        ..DriveSettings::default()
    };
    let device = EmulatedDriveSettings {
        reference: Reference::Maximum,
        ..EmulatedDriveSettings::default()
    };
    let mut rig = open(settings, device).unwrap();
    rig.enable().unwrap();
    let given_a = rig.drive.command(1.0).unwrap();
    rig.sleep_ms(1);
    assert!(
        (given_a - 167.0 * 6e-3).abs() < 1e-12 && (rig.device_current_a() - given_a).abs() < 1e-12
    );
}

#[test]
fn states_identity_resolution_and_meaning_of_faults() {
    let rig = rig(ASYNCHRONOUS);
    let objects: [u32; 4] =
        std::array::from_fn(|n| rig.device().read(Address::new(0x1018, n as u8 + 1)));
    assert_eq!(objects[0], 0x402, "different from 0 and 1");
    assert_eq!(rig.drive.identity(), objects.map(Some));
    assert_eq!(rig.drive.step_a(), 0.004, "4 A in 1000 counts");
    let lost = faults::HEARTBEAT_LOST;
    assert_eq!(rig.drive.explain(lost), Some(fault_text(lost)));
}

#[test]
fn rejects_drive_with_unexpected_identity() {
    let with = |identity| DriveSettings {
        identity,
        ..DriveSettings::default()
    };
    let vendor = ExpectedIdentity {
        vendor: Some(0x402),
        ..ExpectedIdentity::default()
    };
    assert!(open(with(vendor), EmulatedDriveSettings::default()).is_ok());
    let serial = ExpectedIdentity {
        serial: Some(7),
        ..vendor
    };
    let refused = refusal(with(serial), EmulatedDriveSettings::default());
    assert!(
        refused.contains("the serial number of node 5 is 0x00000001, but 0x00000007 is configured"),
        "{refused}"
    );
    let refused = refusal(
        DriveSettings {
            rated_current_a: 4.5,
            ..DriveSettings::default()
        },
        EmulatedDriveSettings::default(),
    );
    assert!(
        refused.contains("is 4 A, but 4.5 A is configured"),
        "{refused}"
    );
}

#[test]
fn rejects_a_drive_without_a_reaction_to_a_lost_heartbeat_unless_configured() {
    let device = EmulatedDriveSettings {
        missing_objects: vec![Address::new(0x6007, 0)],
        ..EmulatedDriveSettings::default()
    };
    let refused = refusal(DriveSettings::default(), device.clone());
    assert!(
        refused.contains("disconnect the bus to check whether the drive stops"),
        "{refused}"
    );
    assert!(
        open(
            DriveSettings {
                abort_connection: None,
                ..DriveSettings::default()
            },
            device
        )
        .is_ok()
    );
    let device = EmulatedDriveSettings {
        missing_objects: vec![Address::new(0x1016, 1)],
        ..EmulatedDriveSettings::default()
    };
    let trusting = DriveSettings {
        abort_connection: None,
        ..DriveSettings::default()
    };
    assert!(refusal(trusting, device).contains("0x1016:01"));
}

#[test]
fn rejects_a_drive_without_a_status_timer_and_suggests_sync() {
    for sub in [3, 5] {
        let device = EmulatedDriveSettings {
            missing_objects: vec![Address::new(0x1800, sub)],
            ..EmulatedDriveSettings::default()
        };
        let refused = refusal(DriveSettings::default(), device.clone());
        let remedy = "choose the synchronous exchange, in which the drive answers SYNC";
        assert!(
            refused.contains(&format!("0x1800:0{sub}")) && refused.ends_with(remedy),
            "{refused}"
        );
        assert!(
            open(
                DriveSettings {
                    exchange: SYNCHRONOUS,
                    ..DriveSettings::default()
                },
                device
            )
            .is_ok()
        );
    }
}

#[test]
fn optional_objects_may_be_missing() {
    let missing_objects = [0x1801, 0x1802, 0x1803]
        .map(|index| Address::new(index, 1))
        .to_vec();
    let missing_objects = [
        missing_objects,
        vec![Address::new(0x6502, 0), Address::new(0x1008, 0)],
    ]
    .concat();
    let device = EmulatedDriveSettings {
        modes: 1 << 9,
        missing_objects: missing_objects[..3].to_vec(),
        ..EmulatedDriveSettings::default()
    };
    assert!(open(DriveSettings::default(), device).is_ok());
}

#[test]
fn a_missing_answer_is_reported_with_what_to_check() {
    let error = CanopenDrive::open(DriveSettings::default(), Box::new(SimulatedHost::default()))
        .err()
        .unwrap();
    assert_eq!(
        error.to_string(),
        "node 5 did not answer to 0x1018:01 within 500 ms; check its power, node number, bit rate and the bus termination"
    );
}

#[test]
fn inspection_reads_the_identity_and_writes_nothing() {
    let world = SimulatedHost::default();
    let device = Arc::new(Mutex::new(EmulatedDrive::new(
        EmulatedDriveSettings::default(),
    )));
    let _running = AmplifierTask::start(&world, Arc::clone(&device)).unwrap();
    world.sleep(Duration::from_millis(1));
    let before = device.lock().unwrap().objects().clone();
    let seen = inspect(&world, 5, Duration::from_millis(100)).unwrap();
    assert_eq!(
        seen.name.as_deref(),
        Some("simulated CANopen drive"),
        "read in four segments"
    );
    assert_eq!(seen.identity[0], Some(0x402));
    assert_eq!(
        (seen.state(), seen.rated_current_a),
        (Some(State::SwitchOnDisabled), Some(4.0))
    );
    assert_eq!(
        (seen.device_type, seen.maximum_current_ratio),
        (Some(0x0002_0192), Some(1.5)),
        "profile 402"
    );
    assert_eq!((seen.past_errors, seen.missing_objects), (vec![], vec![]));
    assert_eq!(
        format!("{before:?}"),
        format!("{:?}", device.lock().unwrap().objects())
    );
}

#[test]
fn inspection_reports_missing_objects() {
    let world = SimulatedHost::default();
    let missing_objects = vec![
        Address::new(0x6007, 0),
        Address::new(0x6502, 0),
        Address::new(0x1008, 0),
    ];
    let device = Arc::new(Mutex::new(EmulatedDrive::new(EmulatedDriveSettings {
        missing_objects,
        ..EmulatedDriveSettings::default()
    })));
    let _running = AmplifierTask::start(&world, device).unwrap();
    let seen = inspect(&world, 5, Duration::from_millis(100)).unwrap();
    assert_eq!(
        (seen.missing_objects, seen.modes, seen.name),
        (vec![Address::new(0x6007, 0)], None, None)
    );
}

#[test]
fn closing_leaves_the_drive_off_and_without_heartbeat_monitoring() {
    let Rig {
        mut drive,
        world,
        device,
        _running,
    } = rig(ASYNCHRONOUS);
    crate::blocking::enable(&mut drive, |time| world.sleep(time)).unwrap();
    drive.command(1.0).unwrap();
    drop(drive);
    world.sleep(Duration::from_millis(500));
    let device = device.lock().unwrap();
    assert_eq!(
        (device.current_a(), device.power_state()),
        (0.0, State::SwitchOnDisabled)
    );
    assert_eq!(
        device.read(Address::new(0x1016, 1)),
        0,
        "it does not miss us"
    );
    assert_eq!(device.nmt_state(), nmt::State::PreOperational);
}

#[test]
fn closing_keeps_the_heartbeat_monitoring_of_a_drive_that_does_not_confirm() {
    let Rig {
        mut drive,
        world,
        device,
        _running,
    } = rig(ASYNCHRONOUS);
    crate::blocking::enable(&mut drive, |time| world.sleep(time)).unwrap();
    drive.command(1.0).unwrap();
    world.sleep(Duration::from_millis(1));
    device.lock().unwrap().inject(DeviceFault::CommandsIgnored);
    drop(drive);
    // 70 ms of 0x1016 are the last means: without them the current would remain.
    let monitored = device.lock().unwrap().read(Address::new(0x1016, 1));
    assert_eq!(monitored, 0x7F << 16 | 70);
    world.sleep(Duration::from_millis(75));
    assert_eq!(device.lock().unwrap().current_a(), 0.0);
}

#[test]
fn counts_of_commands_and_status_frames_wrap_without_a_fault() {
    for exchange in [ASYNCHRONOUS, SYNCHRONOUS] {
        let mut rig = rig(exchange);
        // The third use, command and status frame from here has the number 0.
        rig.drive.shared.set_counts(u32::MAX - 2);
        for _ in 0..4 {
            rig.enable().unwrap();
            assert_eq!(rig.run_ms(1.0, 50), 50, "{:x?}", rig.drive.status());
            assert_eq!(rig.device_current_a(), 1.0);
            rig.drive.disable();
            rig.sleep_ms(50);
            assert_eq!(rig.drive.status(), AmplifierStatus::Disabled);
            assert_eq!(rig.device_current_a(), 0.0);
        }
        assert!((2..10).contains(&rig.drive.shared.uses()));
        assert!(rig.drive.shared.commands() > 100, "the count has wrapped");
    }
}
