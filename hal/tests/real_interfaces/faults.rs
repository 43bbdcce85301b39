//! Every fault of a drive over a real socket: it is detected, the current is zero, and the operator can clear it.

use std::time::Duration;

use bench_hal::CurrentAmplifier;
use bench_hal::blocking;
use bench_hal::can::drive::{fault_text, faults};
use bench_hal::can::emulator::{DeviceFault, EmulatedAmplifier};
use std::thread::sleep;

use crate::support::vcan::Vcan;
use crate::support::{Rig, open, settings, wait_for};

/// Asserts that `fault` is detected as `code`, can be cleared without its cause, and that the drive can be opened again.
fn assert_detected_and_cleared(fault: DeviceFault, code: u32) {
    let vcan = Vcan::up();
    let mut rig = vcan.running();
    rig.far_end.device().inject(fault);
    let detected = rig.fault();
    assert_eq!(detected, code, "{fault:?}: {}", fault_text(detected).what);
    rig.assert_recovers();
    let Rig { drive, far_end } = rig;
    drop(drive);
    let drive = open(&vcan.name, settings()).unwrap();
    Rig { drive, far_end }.enabled();
}

#[test]
fn reports_drive_fault_with_its_emergency_message() {
    assert_detected_and_cleared(DeviceFault::Drive(0x4210), faults::EMERGENCY + 0x4210);
    let text = fault_text(faults::EMERGENCY + 0x4210);
    assert_eq!(text.what, "drive too hot");
    assert!(
        text.remedy
            .contains("remove the cause, then clear the fault")
    );
}

#[test]
fn detects_emergency_message_without_state_change() {
    assert_detected_and_cleared(
        DeviceFault::EmergencyOnly(0x2310),
        faults::EMERGENCY + 0x2310,
    );
}

#[test]
fn detects_a_silent_drive() {
    assert_detected_and_cleared(DeviceFault::Mute, faults::STATUS_LOST);
}

#[test]
fn detects_a_disconnected_drive_which_switches_itself_off() {
    assert_detected_and_cleared(DeviceFault::Unplugged, faults::STATUS_LOST);
}

#[test]
fn detects_frames_of_a_wrong_length() {
    assert_detected_and_cleared(DeviceFault::ShortFrames, faults::MALFORMED);
}

#[test]
fn detects_a_statusword_without_a_state() {
    assert_detected_and_cleared(DeviceFault::InvalidStatusword, faults::MALFORMED);
}

#[test]
fn detects_drive_that_ignores_its_target() {
    assert_detected_and_cleared(DeviceFault::TargetIgnored, faults::TARGET_IGNORED);
}

#[test]
fn detects_a_drive_that_switches_itself_off() {
    assert_detected_and_cleared(DeviceFault::SwitchesOff, faults::SWITCHED_OFF);
}

#[test]
fn detects_a_restart_and_configures_the_drive_again_when_cleared() {
    assert_detected_and_cleared(DeviceFault::Reset, faults::RESTARTED);
}

#[test]
fn detects_a_drive_with_late_frames() {
    let vcan = Vcan::up();
    let mut rig = vcan.running();
    let late = Duration::from_millis(700); // longer than status_timeout
    rig.far_end.device().inject(DeviceFault::Late(700));
    assert_eq!(rig.fault(), faults::STATUS_LOST);
    rig.far_end.device().inject(DeviceFault::None);
    std::thread::sleep(2 * late); // delayed frames still arrive
    rig.assert_recovers();
}

#[test]
fn drive_that_ignores_disable_is_stopped_by_nmt_or_lost_heartbeat() {
    for fault in [DeviceFault::SetPointsIgnored, DeviceFault::CommandsIgnored] {
        let vcan = Vcan::up();
        let mut rig = vcan.running();
        rig.far_end.device().inject(fault);
        rig.drive.disable();
        assert_eq!(
            rig.far_end.current_a(),
            1.0,
            "{fault:?}: the drive ignores the request"
        );
        rig.far_end.wait_until_off();
        assert_eq!(rig.fault(), faults::STILL_ENABLED, "{fault:?}");
        rig.assert_recovers();
    }
}

#[test]
fn switches_off_when_the_loop_sends_no_commands() {
    let vcan = Vcan::up();
    let mut rig = vcan.running();
    let code = i64::from(faults::COMMANDS_STOPPED);
    wait_for("the driver detects the stopped loop", || {
        rig.far_end.current_a() == 0.0
    });
    assert_eq!(
        blocking::enable(&mut rig.drive, sleep).unwrap_err().code,
        code
    );
    rig.assert_recovers();
}
