//! The driver with a drive, and the simulated drive with a master, of an independent CANopen stack: Python's canopen.

use std::time::Duration;

use bench_hal::blocking;
use bench_hal::can::budget::Exchange;
use bench_hal::can::drive::{
    CanopenDrive, DriveSettings, ExpectedIdentity, fault_text, faults, inspect,
};
use bench_hal::{AmplifierStatus, CurrentAmplifier};
use std::thread::sleep;

use crate::support::python::{PythonDrive, script};
use crate::support::vcan::Vcan;
use crate::support::{FarEnd, host, open, settings, wait_for};

/// Commands a current at the rate of the script, until the drive reports the state `expected`.
fn command_until(drive: &mut CanopenDrive, current_a: f64, peer: &mut PythonDrive, expected: &str) {
    wait_for(expected, || {
        let _ = drive.command(current_a); // refused in the tick in which a fault is found
        std::thread::sleep(Duration::from_millis(10));
        peer.state() == expected
    });
}

/// Enables the drive, commands both directions of current, and compares the reported current.
fn assert_runs(drive: &mut CanopenDrive, peer: &mut PythonDrive) {
    blocking::enable(drive, sleep).unwrap();
    assert_eq!(peer.state(), "27 0 OPERATIONAL");
    for (current_a, expected) in [(1.0, "27 250 OPERATIONAL"), (-2.0, "27 -500 OPERATIONAL")] {
        command_until(drive, current_a, peer, expected);
        wait_for("the actual current", || {
            let _ = drive.command(current_a);
            drive.actual_current_a() == Some(current_a)
        });
    }
    assert_eq!(drive.status(), AmplifierStatus::Enabled);
}

/// A fault of the drive is reported and can be cleared.
fn assert_fault_is_cleared(drive: &mut CanopenDrive, peer: &mut PythonDrive) {
    peer.inject_fault(0x4210);
    command_until(drive, 1.0, peer, "08 0 OPERATIONAL");
    let fault = AmplifierStatus::Fault(faults::EMERGENCY + 0x4210);
    wait_for("the fault", || drive.status() == fault);
    assert_eq!(fault_text(faults::EMERGENCY + 0x4210).what, "drive too hot");
    assert!(
        blocking::enable(drive, sleep).is_err(),
        "enabling must not clear a fault"
    );
    assert_eq!(peer.state(), "08 0 OPERATIONAL");
    blocking::reset_fault(drive, sleep).unwrap();
    assert_eq!(
        (drive.status(), peer.state().as_str()),
        (AmplifierStatus::Disabled, "40 0 OPERATIONAL")
    );
}

#[test]
fn driver_operates_an_independent_drive() {
    let vcan = Vcan::up();
    let mut peer = PythonDrive::new(&vcan.name);
    let identity_read = inspect(&host(&vcan.name), 5, Duration::from_secs(10)).unwrap();
    assert_eq!(identity_read.name.as_deref(), Some("independent drive"));
    let identity = ExpectedIdentity {
        vendor: Some(0x123),
        serial: Some(42),
        ..ExpectedIdentity::default()
    };
    for exchange in [
        Exchange::Asynchronous { status_hz: 50.0 },
        Exchange::Synchronous { status_every: 1 },
    ] {
        let settings = DriveSettings {
            identity,
            exchange,
            rate_hz: 100.0,
            ..settings()
        };
        let mut drive =
            open(&vcan.name, settings).unwrap_or_else(|error| panic!("{exchange:?}: {error}"));
        assert_runs(&mut drive, &mut peer);
        assert_fault_is_cleared(&mut drive, &mut peer);
        assert_runs(&mut drive, &mut peer);
        drop(drive);
        wait_for("off and pre-operational", || {
            peer.state() == "40 0 PRE-OPERATIONAL"
        });
    }
}

#[test]
fn independent_master_operates_the_emulated_drive() {
    let vcan = Vcan::up();
    let far_end = FarEnd::new(&vcan.name, &host(&vcan.name));
    let output = script("canopen_master.py", &vcan.name).output().unwrap();
    let output_text = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && output_text.contains("all well"),
        "{output_text}"
    );
    assert_eq!(far_end.current_a(), 0.0);
}
