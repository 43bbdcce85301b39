//! Exclusive use of a port, and the errors when it cannot be opened.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use bench_hal::serial::{
    Polling, PortSettings, ProbeSettings, Protocol, SerialError, SerialProbe, optoncdt,
};
use nix::fcntl::{Flock, FlockArg};

use crate::support::probes::{self, capancdt_with, still};
use crate::support::rehearsal::{Rehearsal, more};

const HOLD: &str = "BENCH_TEST_HOLD";

fn protocol() -> Arc<dyn Protocol> {
    probes::optoncdt()
}

fn rehearsal() -> Rehearsal {
    Rehearsal::new(&protocol(), 1000.0, still)
}

fn refusal(settings: ProbeSettings) -> SerialError {
    SerialProbe::open(settings).unwrap_err()
}

#[test]
fn rejects_second_opening_with_process_id_until_the_first_is_dropped() {
    let rehearsal = rehearsal();
    let first = rehearsal.open();
    let error = refusal(rehearsal.settings()).to_string();
    assert!(
        error.contains(&format!("in use by process {}", std::process::id())),
        "{error}"
    );
    drop(first);
    more(&mut rehearsal.open(), 1);
}

#[test]
fn rejects_link_to_an_open_port() {
    let rehearsal = rehearsal();
    let _first = rehearsal.open();
    let link = rehearsal.locks.path().join("by-id");
    std::os::unix::fs::symlink(&rehearsal.path, &link).unwrap();
    let mut settings = rehearsal.settings();
    settings.port.path = link;
    assert!(matches!(
        refusal(settings),
        SerialError::PortInUse { pid: Some(_), .. }
    ));
}

/// Not a test: the other process of the next test.
#[test]
fn helper_process_holds_the_port() {
    let Ok(hold) = std::env::var(HOLD) else {
        return;
    };
    let (path, lock_dir) = hold.split_once(' ').unwrap();
    let port = PortSettings {
        lock_dir: lock_dir.into(),
        ..PortSettings::new(path, 921_600)
    };
    let _probe = SerialProbe::open(ProbeSettings::new(port, protocol())).unwrap();
    println!("holding");
    std::thread::sleep(Duration::from_secs(600)); // the test kills this process earlier
}

#[test]
fn rejects_port_of_another_process_until_that_process_is_killed() {
    let rehearsal = rehearsal();
    let hold = format!(
        "{} {}",
        rehearsal.path.display(),
        rehearsal.locks.path().display()
    );
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args([
            "--exact",
            "ownership::helper_process_holds_the_port",
            "--nocapture",
        ])
        .env(HOLD, hold)
        .stdout(Stdio::piped());
    let mut other = command.spawn().unwrap();
    let output = BufReader::new(other.stdout.take().unwrap())
        .lines()
        .map_while(Result::ok);
    assert!(
        output.into_iter().any(|line| line.contains("holding")),
        "the other process did not open the port"
    );
    let error = refusal(rehearsal.settings());
    assert!(
        matches!(error, SerialError::PortInUse { pid: Some(pid), .. } if pid == other.id()),
        "{error}"
    );
    other.kill().unwrap();
    other.wait().unwrap();
    more(&mut rehearsal.open(), 1);
}

#[test]
fn rejects_terminal_locked_by_another_program() {
    let rehearsal = rehearsal();
    let terminal = std::fs::File::options()
        .read(true)
        .write(true)
        .open(&rehearsal.path)
        .unwrap();
    let _locked = Flock::lock(terminal, FlockArg::LockExclusiveNonblock).unwrap();
    let error = refusal(rehearsal.settings()).to_string();
    assert!(
        error.contains("in use by another process; end that process first"),
        "{error}"
    );
}

#[test]
fn missing_port_is_reported() {
    let mut settings = rehearsal().settings();
    settings.port.path = "/dev/ttyNONE9".into();
    let error = refusal(settings).to_string();
    assert!(
        error.contains("/dev/ttyNONE9: there is no such port")
            && error.contains("/dev/serial/by-id"),
        "{error}"
    );
}

#[test]
fn rejects_file_that_is_not_a_terminal() {
    let rehearsal = rehearsal();
    let mut settings = rehearsal.settings();
    settings.port.path = rehearsal.locks.path().join("file");
    std::fs::write(&settings.port.path, "").unwrap();
    let error = refusal(settings).to_string();
    assert!(
        error.contains("check that it is a terminal device"),
        "{error}"
    );
}

#[test]
fn lock_file_error_names_the_setting() {
    let mut settings = rehearsal().settings();
    settings.port.path = "/dev/null".into();
    settings.port.lock_dir = "/nonexistent".into();
    let error = refusal(settings).to_string();
    assert!(
        error.contains("/nonexistent/bench-dev-null.lock") && error.contains("set lock_dir"),
        "{error}"
    );
}

#[test]
fn rejects_invalid_settings_before_opening_the_port() {
    let settings = || ProbeSettings::new(PortSettings::new("/dev/ttyNONE9", 921_600), protocol());
    let refused = |change: fn(&mut ProbeSettings)| {
        let mut settings = settings();
        change(&mut settings);
        refusal(settings).to_string()
    };
    assert!(refused(|settings| settings.mounting.gain = 0.0).contains("gain = 0"));
    assert!(refused(|settings| settings.mounting.offset_m = f64::NAN).contains("offset_m"));
    assert!(refused(|settings| settings.port.baud = 0).contains("baud = 0"));
    let without_timeout = |settings: &mut ProbeSettings| {
        settings.protocol = capancdt_with(Polling {
            timeout: Duration::ZERO,
            ..Polling::default()
        });
    };
    assert!(refused(without_timeout).contains("quiet, timeout"));
    let without_range = |settings: &mut ProbeSettings| {
        settings.protocol = Arc::new(optoncdt::Settings::new(-1.0));
    };
    assert!(refused(without_range).contains("range_m = -1"));
}

#[test]
fn permission_error_names_group_and_udev_rule() {
    let error = SerialError::Permission {
        path: "/dev/ttyUSB0".into(),
    }
    .to_string();
    assert!(
        error.contains("/dev/ttyUSB0: permission denied")
            && error.contains("dialout")
            && error.contains("uaccess"),
        "{error}"
    );
}
