//! Every fault: detected within the time in the settings, current zero, and usable again after the operator clears it.

use super::super::super::bus::{BusError, Condition, Port};
use super::super::super::emulator::DeviceFault;
use super::super::super::frame::{CanFrame, Id};
use super::*;

/// A rig that is enabled and has commanded 1 A for 50 ms.
fn running(exchange: Exchange) -> Rig {
    let mut rig = rig(exchange);
    rig.enable().unwrap();
    assert_eq!(rig.run_ms(1.0, 50), 50, "{:x?}", rig.drive.status());
    assert_eq!(rig.device_current_a(), 1.0);
    rig
}

/// Asserts that the fault is detected within `most_ms`, and that the current is zero within 3 ms more and remains
/// zero, whatever the loop does.
fn assert_detected(rig: &mut Rig, code: u32, most_ms: u32) {
    let found_ms = rig.run_ms(1.0, most_ms + 1);
    assert_eq!(
        rig.drive.status(),
        AmplifierStatus::Fault(code),
        "{}",
        fault_text(code).what
    );
    assert!(
        found_ms <= most_ms,
        "{}: {found_ms} ms",
        fault_text(code).what
    );
    rig.sleep_ms(3);
    for _ in 0..300 {
        assert_eq!(rig.device_current_a(), 0.0, "{}", fault_text(code).what);
        assert_eq!(
            rig.drive.command(1.0).unwrap_err().code,
            i64::from(code),
            "a heedless loop is refused"
        );
        rig.sleep_ms(1);
    }
    assert_eq!(
        rig.drive.status(),
        AmplifierStatus::Fault(code),
        "the first cause stays until a person clears it"
    );
    assert_eq!(
        rig.enable().unwrap_err().code,
        i64::from(code),
        "a fault is not left by enabling"
    );
    assert_eq!(rig.device_current_a(), 0.0);
}

/// Asserts that the operator can clear the fault after its cause is removed: the drive is then off, and is enabled
/// only on request.
fn assert_recovers(rig: &mut Rig) {
    rig.device().inject(DeviceFault::None);
    rig.sleep_ms(50);
    rig.reset_fault()
        .unwrap_or_else(|error| panic!("{error}: {:?}", rig.drive.last_error()));
    assert_eq!(rig.drive.status(), AmplifierStatus::Disabled);
    assert_eq!(rig.device_current_a(), 0.0);
    rig.enable().unwrap();
    assert_eq!(rig.run_ms(0.5, 50), 50);
    assert_eq!(rig.device_current_a(), 0.5);
}

/// Status frames come every 2 ms, either by the timer or at every second SYNC of 1 kHz; one step of the bus is 0.1 ms.
const STATUS_MS: u32 = 3;

#[test]
fn detects_faults_of_the_drive_with_the_next_status_frame() {
    let cases = [
        (DeviceFault::Drive(0x2310), faults::EMERGENCY + 0x2310),
        (
            DeviceFault::EmergencyOnly(0x4210),
            faults::EMERGENCY + 0x4210,
        ),
        (DeviceFault::TargetIgnored, faults::TARGET_IGNORED),
        (DeviceFault::SwitchesOff, faults::SWITCHED_OFF),
        (DeviceFault::ShortFrames, faults::MALFORMED),
        (DeviceFault::InvalidStatusword, faults::MALFORMED),
        (DeviceFault::Reset, faults::RESTARTED),
    ];
    for exchange in [ASYNCHRONOUS, SYNCHRONOUS] {
        for (misbehaviour, code) in cases {
            let mut rig = running(exchange);
            rig.device().inject(misbehaviour);
            assert_detected(&mut rig, code, STATUS_MS);
            assert_recovers(&mut rig);
        }
    }
}

#[test]
fn detects_a_silent_drive_by_its_missing_status() {
    // 20 ms without status. The drive still receives, so it is switched off.
    for exchange in [ASYNCHRONOUS, SYNCHRONOUS] {
        let mut rig = running(exchange);
        rig.device().inject(DeviceFault::Mute);
        assert_detected(&mut rig, faults::STATUS_LOST, 22);
        assert_recovers(&mut rig);
    }
}

#[test]
fn detects_a_silent_drive_that_is_off_by_its_missing_heartbeat() {
    let mut rig = rig(ASYNCHRONOUS);
    rig.device().inject(DeviceFault::Mute);
    rig.sleep_ms(48);
    assert_eq!(
        rig.drive.status(),
        AmplifierStatus::Disabled,
        "70 ms from the last heartbeat, which is up to 20 ms old"
    );
    rig.sleep_ms(23);
    assert_eq!(
        rig.drive.status(),
        AmplifierStatus::Fault(faults::HEARTBEAT_LOST)
    );
    assert_recovers(&mut rig);
}

#[test]
fn a_disconnected_drive_switches_itself_off_without_the_heartbeat() {
    for exchange in [ASYNCHRONOUS, SYNCHRONOUS] {
        let mut rig = running(exchange);
        rig.device().inject(DeviceFault::Unplugged);
        assert!(rig.run_ms(1.0, 30) <= 22);
        assert_eq!(
            rig.drive.status(),
            AmplifierStatus::Fault(faults::STATUS_LOST)
        );
        rig.sleep_ms(71); // 70 ms after the last heartbeat received, whatever the driver does
        assert_eq!(rig.device_current_a(), 0.0);
        assert_recovers(&mut rig);
    }
}

#[test]
fn clears_fault_after_reconnection_although_the_last_heartbeat_is_outdated() {
    // The drive detects the loss 40 ms after the last heartbeat (up to 20 ms old) it received; the driver after 70 ms.
    let settings = DriveSettings {
        times: DriveTimes {
            own_heartbeat_timeout: Duration::from_millis(40),
            ..DriveTimes::default()
        },
        ..DriveSettings::default()
    };
    let mut rig = open(settings, EmulatedDriveSettings::default()).unwrap();
    rig.enable().unwrap();
    rig.run_ms(1.0, 50);
    rig.device().inject(DeviceFault::Unplugged);
    rig.sleep_ms(42);
    assert_eq!(rig.device().nmt_state(), nmt::State::PreOperational);
    assert_eq!(
        rig.drive.shared.nmt(),
        Some(nmt::State::Operational),
        "according to its last heartbeat"
    );
    rig.device().inject(DeviceFault::None);
    rig.reset_fault().unwrap_or_else(|error| panic!("{error}"));
    assert_recovers(&mut rig);
}

#[test]
fn detects_late_frames_by_their_gap() {
    let mut rig = running(ASYNCHRONOUS);
    rig.device().inject(DeviceFault::Late(200));
    assert_detected(&mut rig, faults::STATUS_LOST, 22);
    rig.sleep_ms(400);
    assert_recovers(&mut rig);
}

#[test]
fn conditions_of_the_bus_are_faults() {
    let cases = [
        (Condition::BusOff, faults::BUS_OFF),
        (Condition::Passive, faults::BUS_PASSIVE),
        (Condition::Overflow, faults::OVERFLOW),
    ];
    for (condition, code) in cases {
        let mut rig = running(ASYNCHRONOUS);
        rig.world.bus().inject_condition(Condition::Warning);
        rig.world.bus().inject_condition(Condition::Noise);
        assert_eq!(rig.run_ms(1.0, 5), 5, "a warning is no fault");
        rig.world.bus().inject_condition(condition);
        assert_detected(&mut rig, code, 1);
        assert_recovers(&mut rig);
    }
}

#[test]
fn an_interface_that_goes_down_is_a_fault_and_the_drive_stops_by_itself() {
    let mut rig = running(ASYNCHRONOUS);
    rig.world.bus().set_down(true);
    rig.sleep_ms(1);
    assert_eq!(rig.drive.status(), AmplifierStatus::Fault(faults::BUS_DOWN));
    rig.sleep_ms(72);
    assert_eq!(rig.device_current_a(), 0.0);
    assert!(rig.reset_fault().is_err(), "still down");
    assert_eq!(rig.drive.status(), AmplifierStatus::Fault(faults::BUS_DOWN));
    rig.world.bus().set_down(false);
    assert_recovers(&mut rig);
}

#[test]
fn a_removed_adapter_is_reported_as_gone_although_it_goes_down_first() {
    let shared = Arc::new(Shared::default());
    let mut monitor = Monitor::new(&DriveSettings::default(), Arc::clone(&shared), 0);
    monitor.fail(BusError::Down);
    monitor.fail(BusError::Gone);
    assert_eq!(
        shared.fault(),
        faults::BUS_GONE,
        "its remedy is another: the interface does not come back by itself"
    );
    monitor.fail(BusError::Down);
    assert_eq!(shared.fault(), faults::BUS_GONE);
}

#[test]
fn the_drive_stops_after_the_process_is_killed() {
    let mut rig = running(ASYNCHRONOUS);
    // SIGKILL: no thread of the driver runs, nothing is sent.
    rig.drive.service = TaskHandle::default();
    rig.sleep_ms(48);
    assert_eq!(
        rig.device_current_a(),
        1.0,
        "70 ms from the last heartbeat, which is up to 20 ms old"
    );
    rig.sleep_ms(24);
    assert_eq!(
        (rig.device_current_a(), rig.device().power_state()),
        (0.0, State::SwitchOnDisabled)
    );
    let Rig {
        drive,
        world,
        device,
        _running,
    } = rig;
    std::mem::forget(drive);
    let mut next = CanopenDrive::open(DriveSettings::default(), Box::new(world.clone())).unwrap();
    crate::blocking::enable(&mut next, |time| world.sleep(time)).unwrap(); // the next run starts cleanly
    assert_eq!(
        device.lock().unwrap().power_state(),
        State::OperationEnabled
    );
}

#[test]
fn switches_off_when_the_loop_sends_no_commands() {
    for exchange in [ASYNCHRONOUS, SYNCHRONOUS] {
        let mut rig = running(exchange);
        rig.sleep_ms(18);
        assert_eq!(
            rig.device_current_a(),
            1.0,
            "the limit is 20 ms after the last command"
        );
        rig.sleep_ms(6);
        assert_eq!(rig.device_current_a(), 0.0);
        assert_eq!(
            rig.drive.status(),
            AmplifierStatus::Fault(faults::COMMANDS_STOPPED)
        );
        assert_recovers(&mut rig);
    }
}

#[test]
fn detects_a_hung_service_thread_by_the_age_of_its_last_pass() {
    for exchange in [ASYNCHRONOUS, SYNCHRONOUS] {
        let mut rig = running(exchange);
        rig.world.set_hung("can-service", true);
        // The limit is 20 ms; the pass before the fault is at most 0.1 ms old, and the loop looks every millisecond.
        let found_ms = rig.run_ms(1.0, 100);
        assert!((20..=21).contains(&found_ms), "{found_ms} ms");
        let hung = i64::from(faults::SERVICE_HUNG);
        let fault = AmplifierStatus::Fault(faults::SERVICE_HUNG);
        assert_eq!(rig.drive.status(), fault);
        assert_eq!(rig.drive.command(1.0).unwrap_err().code, hung);
        rig.drive.disable();
        rig.sleep_ms(1);
        assert_eq!(rig.device_current_a(), 0.0, "{exchange:?}");
        assert_eq!(rig.drive.begin_enable().unwrap_err().code, hung);
        rig.world.set_hung("can-service", false);
        assert_recovers(&mut rig);
    }
}

#[test]
fn service_thread_that_hangs_while_the_drive_is_being_enabled_ends_the_enabling() {
    let mut rig = rig(ASYNCHRONOUS);
    rig.world.set_hung("can-service", true);
    rig.drive.begin_enable().unwrap();
    let polls = (0..100).find_map(|ms| {
        let progress = rig.drive.poll_enable();
        rig.sleep_ms(1);
        progress.is_ready().then_some((ms, progress))
    });
    let (found_ms, progress) = polls.expect("it ends");
    assert!((20..=21).contains(&found_ms), "{found_ms} ms");
    let error = Err(faults::device_error(faults::SERVICE_HUNG));
    assert_eq!(progress, Poll::Ready(error));
    assert_eq!(rig.drive.shared.intent(), Intent::Off);
}

#[test]
fn disable_acts_immediately_and_without_the_service() {
    for exchange in [ASYNCHRONOUS, SYNCHRONOUS] {
        let mut rig = running(exchange);
        rig.drive.service = TaskHandle::default(); // as if its thread were blocked
        rig.drive.disable();
        rig.world.sleep(Duration::from_micros(200)); // two steps of the bus
        assert_eq!(rig.device_current_a(), 0.0, "{exchange:?}");
    }
}

#[test]
fn repeats_a_lost_disable() {
    for exchange in [ASYNCHRONOUS, SYNCHRONOUS] {
        let mut rig = running(exchange);
        rig.device().inject(DeviceFault::SetPointsIgnored);
        rig.drive.disable();
        rig.sleep_ms(15);
        assert_eq!(rig.device_current_a(), 1.0);
        rig.device().inject(DeviceFault::None);
        rig.sleep_ms(11); // repeated every 10 ms
        assert_eq!(
            (rig.device_current_a(), rig.drive.status()),
            (0.0, AmplifierStatus::Disabled),
            "{exchange:?}"
        );
    }
}

/// Asserts that the current of a drive with this fault ends within `most_ms` after the disable, and that the driver reports
/// the unconfirmed disable.
fn assert_stopped_after_disable(misbehaviour: DeviceFault, most_ms: u64) {
    let mut rig = running(ASYNCHRONOUS);
    rig.device().inject(misbehaviour);
    rig.drive.disable();
    rig.sleep_ms(60);
    assert_eq!(
        (rig.device_current_a(), rig.drive.status()),
        (1.0, AmplifierStatus::Disabled)
    );
    rig.sleep_ms(most_ms - 60);
    assert_eq!(rig.device_current_a(), 0.0, "{misbehaviour:?}");
    assert_eq!(
        rig.drive.status(),
        AmplifierStatus::Fault(faults::STILL_ENABLED)
    );
    assert_recovers(&mut rig);
}

#[test]
fn nmt_stops_a_drive_that_ignores_disable() {
    // NMT stop after 70 ms without confirmation, plus one repeat of 10 ms.
    assert_stopped_after_disable(DeviceFault::SetPointsIgnored, 85);
}

#[test]
fn lost_heartbeat_stops_a_drive_that_ignores_nmt() {
    // The NMT stop after at most 80 ms ends the heartbeat; the drive detects its loss 70 ms after the last heartbeat.
    assert_stopped_after_disable(DeviceFault::CommandsIgnored, 175);
}

#[test]
fn a_command_that_is_not_finite_is_not_sent() {
    let mut rig = running(ASYNCHRONOUS);
    for nonsense in [f64::NAN, f64::INFINITY] {
        assert_eq!(
            rig.drive.command(nonsense).unwrap_err().code,
            i64::from(faults::NOT_FINITE)
        );
    }
    rig.sleep_ms(2);
    assert_eq!(
        rig.device_current_a(),
        1.0,
        "the last command stands until the loop disables"
    );
    rig.drive.disable();
    assert_eq!(
        rig.drive.command(1.0).unwrap_err().code,
        i64::from(faults::NOT_ARMED)
    );
}

#[test]
fn a_fault_that_persists_is_not_cleared() {
    let mut rig = running(ASYNCHRONOUS);
    rig.device().inject(DeviceFault::Drive(0x3220));
    rig.sleep_ms(5);
    rig.device().inject(DeviceFault::SetPointsIgnored); // the drive does not receive the reset
    assert_eq!(
        rig.reset_fault().unwrap_err().code,
        i64::from(faults::FAULT_REMAINS)
    );
    assert_eq!(
        rig.drive.status(),
        AmplifierStatus::Fault(faults::EMERGENCY + 0x3220),
        "the cause, not the attempt"
    );
    assert_recovers(&mut rig);
}

#[test]
fn a_drive_that_restarted_is_configured_again_although_it_is_operational() {
    let mut rig = running(ASYNCHRONOUS);
    rig.device().inject(DeviceFault::Reset);
    rig.sleep_ms(5);
    rig.device().inject(DeviceFault::None);
    let mut other_master = rig.world.endpoint(&[Id::standard(0x7FF)]).unwrap();
    other_master.send(&nmt::Command::Start.frame(5)).unwrap();
    rig.sleep_ms(50);
    assert_eq!(rig.device().nmt_state(), nmt::State::Operational);
    assert_eq!(rig.device().read(HEARTBEAT_CONSUMER), 0);
    assert_recovers(&mut rig);
    assert_eq!(rig.device().read(HEARTBEAT_CONSUMER), 0x7F << 16 | 70);
}

#[test]
fn a_drive_that_did_not_restart_is_not_configured_again() {
    let mut rig = running(ASYNCHRONOUS);
    rig.device().inject(DeviceFault::Drive(0x2310));
    rig.sleep_ms(5);
    let mut listener = rig.world.endpoint(&[Id::standard(0x605)]).unwrap();
    assert_recovers(&mut rig);
    assert_eq!(listener.receive(Duration::ZERO), Ok(None), "an SDO request");
}

#[test]
fn poll_without_a_reset_is_ready_with_the_fault() {
    let mut rig = rig(ASYNCHRONOUS);
    assert_eq!(rig.drive.poll_reset(), Poll::Ready(Ok(())));
    rig.world.bus().inject_condition(Condition::BusOff);
    rig.sleep_ms(1);
    let bus_off = faults::device_error(faults::BUS_OFF);
    assert_eq!(rig.drive.poll_reset(), Poll::Ready(Err(bus_off)));
}

#[test]
fn a_reset_that_fails_is_a_fault_also_if_there_was_none() {
    let mut rig = rig(ASYNCHRONOUS);
    assert_eq!(rig.drive.last_error(), None);
    let mut other_master = rig.world.endpoint(&[Id::standard(0x7FF)]).unwrap();
    let leave = nmt::Command::EnterPreOperational.frame(5);
    other_master.send(&leave).unwrap();
    rig.sleep_ms(50);
    assert_eq!(rig.drive.status(), AmplifierStatus::Disabled);
    rig.device().inject(DeviceFault::CommandsIgnored);
    let code = faults::NOT_CONFIGURED;
    assert_eq!(rig.reset_fault().unwrap_err().code, i64::from(code));
    assert_eq!(rig.drive.status(), AmplifierStatus::Fault(code));
    let error = rig.drive.last_error().unwrap();
    assert!(error.contains("node 5"), "{error}");
    assert_recovers(&mut rig);
}

#[test]
fn a_reset_needs_a_status_that_is_newer_than_its_beginning() {
    let mut rig = rig(ASYNCHRONOUS);
    rig.sleep_ms(20);
    assert!(rig.drive.shared.statusword().is_some(), "an old status");
    rig.device().inject(DeviceFault::ShortFrames);
    let error = rig.reset_fault().unwrap_err();
    assert_eq!(error.code, i64::from(faults::STATUS_LOST));
    assert_recovers(&mut rig);
}

#[test]
fn old_answers_do_not_disturb_a_reset() {
    let mut rig = running(ASYNCHRONOUS);
    rig.device().inject(DeviceFault::Reset);
    rig.sleep_ms(5);
    let mut other = rig.world.endpoint(&[Id::standard(0x7FF)]).unwrap();
    // An abort for the first object that the configuration reads: 0x1018, sub 1 does not exist.
    let abort = [0x80, 0x18, 0x10, 0x01, 0x00, 0x00, 0x02, 0x06];
    for _ in 0..20 {
        let answer = CanFrame::from_slice(Id::standard(0x585), &abort).unwrap();
        other.send(&answer).unwrap();
    }
    rig.sleep_ms(5);
    assert_recovers(&mut rig);
}

#[test]
fn a_drive_in_fault_at_opening_is_opened_but_not_reset() {
    let world = SimulatedHost::default();
    let device = Arc::new(Mutex::new(EmulatedDrive::new(
        EmulatedDriveSettings::default(),
    )));
    let running = AmplifierTask::start(&world, Arc::clone(&device)).unwrap();
    world.sleep(Duration::from_millis(1));
    device.lock().unwrap().inject(DeviceFault::Drive(0x2310));
    world.sleep(Duration::from_millis(5));
    let drive = CanopenDrive::open(DriveSettings::default(), Box::new(world.clone())).unwrap();
    world.sleep(Duration::from_millis(10));
    let mut rig = Rig {
        drive,
        world,
        device,
        _running: running,
    };
    assert_eq!(
        rig.drive.status(),
        AmplifierStatus::Fault(faults::DRIVE_FAULT),
        "the emergency message was before our time"
    );
    assert!(rig.enable().is_err());
    assert_eq!(rig.device().power_state(), State::Fault);
    assert_recovers(&mut rig);
}
