//! Who may open a port, and what is said to whoever may not.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use bench_hal::serial::{
    Polling, PortSettings, ProbeSettings, Protocol, SerialError, SerialProbe, optoncdt,
};

use nix::fcntl::{Flock, FlockArg};

use crate::support::rehearsal::{Rehearsal, more};

const HOLD: &str = "BENCH_TEST_HOLD";

fn protocol() -> Protocol {
    Protocol::Optoncdt(optoncdt::Settings::new(200e-6))
}

fn rehearsal() -> Rehearsal {
    Rehearsal::new(&protocol(), 1000.0, |_| 60e-6)
}

fn refusal(settings: ProbeSettings) -> SerialError {
    SerialProbe::open(settings).unwrap_err()
}

#[test]
fn a_second_opening_is_refused_with_the_holders_pid_until_the_first_is_dropped() {
    let rehearsal = rehearsal();
    let first = rehearsal.open(&protocol());
    let error = refusal(rehearsal.settings(&protocol())).to_string();
    assert!(
        error.contains(&format!("held by process {}", std::process::id())),
        "{error}"
    );
    drop(first);
    more(&mut rehearsal.open(&protocol()), 1);
}

#[test]
fn another_name_of_the_same_port_is_the_same_port() {
    let rehearsal = rehearsal();
    let _first = rehearsal.open(&protocol());
    let link = rehearsal.locks.path().join("by-id");
    std::os::unix::fs::symlink(&rehearsal.path, &link).unwrap();
    let mut settings = rehearsal.settings(&protocol());
    settings.port.path = link;
    assert!(matches!(
        refusal(settings),
        SerialError::PortInUse { pid: Some(_), .. }
    ));
}

/// Not a test of its own: the other process of the next one.
#[test]
fn other_process() {
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
    std::thread::sleep(std::time::Duration::from_secs(600)); // killed long before
}

#[test]
fn another_process_is_named_and_its_port_is_free_after_its_violent_end() {
    let rehearsal = rehearsal();
    let hold = format!(
        "{} {}",
        rehearsal.path.display(),
        rehearsal.locks.path().display()
    );
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", "ownership::other_process", "--nocapture"])
        .env(HOLD, hold)
        .stdout(Stdio::piped());
    let mut other = command.spawn().unwrap();
    let said = BufReader::new(other.stdout.take().unwrap())
        .lines()
        .map_while(Result::ok);
    assert!(
        said.into_iter().any(|line| line.contains("holding")),
        "the other process did not open the port"
    );
    let error = refusal(rehearsal.settings(&protocol()));
    assert!(
        matches!(error, SerialError::PortInUse { pid: Some(pid), .. } if pid == other.id()),
        "{error}"
    );
    other.kill().unwrap();
    other.wait().unwrap();
    more(&mut rehearsal.open(&protocol()), 1);
}

#[test]
fn a_terminal_that_another_program_has_locked_is_refused() {
    let rehearsal = rehearsal();
    let terminal = std::fs::File::options()
        .read(true)
        .write(true)
        .open(&rehearsal.path)
        .unwrap();
    let _theirs = Flock::lock(terminal, FlockArg::LockExclusiveNonblock).unwrap();
    let error = refusal(rehearsal.settings(&protocol())).to_string();
    assert!(
        error.contains("held by another process; stop that first"),
        "{error}"
    );
}

#[test]
fn a_port_that_is_not_there_is_said_to_be_missing() {
    let mut settings = rehearsal().settings(&protocol());
    settings.port.path = "/dev/ttyNONE9".into();
    let error = refusal(settings).to_string();
    assert!(
        error.contains("/dev/ttyNONE9: there is no such port")
            && error.contains("/dev/serial/by-id"),
        "{error}"
    );
}

#[test]
fn a_file_that_is_no_terminal_is_refused() {
    let rehearsal = rehearsal();
    let mut settings = rehearsal.settings(&protocol());
    settings.port.path = rehearsal.locks.path().join("file");
    std::fs::write(&settings.port.path, "").unwrap();
    let error = refusal(settings).to_string();
    assert!(error.contains("is it a terminal device?"), "{error}");
}

#[test]
fn a_lock_that_cannot_be_written_is_said_with_the_setting_to_change() {
    let mut settings = rehearsal().settings(&protocol());
    settings.port.path = "/dev/null".into();
    settings.port.lock_dir = "/nonexistent".into();
    let error = refusal(settings).to_string();
    assert!(
        error.contains("/nonexistent/bench-dev-null.lock") && error.contains("set lock_dir"),
        "{error}"
    );
}

#[test]
fn settings_that_make_no_sense_are_refused_before_the_port_is_touched() {
    let settings = || ProbeSettings::new(PortSettings::new("/dev/ttyNONE9", 921_600), protocol());
    let refused = |change: fn(&mut ProbeSettings)| {
        let mut settings = settings();
        change(&mut settings);
        refusal(settings).to_string()
    };
    assert!(refused(|settings| settings.mounting.gain = 0.0).contains("gain = 0"));
    assert!(refused(|settings| settings.mounting.offset_m = f64::NAN).contains("offset_m"));
    assert!(refused(|settings| settings.port.baud = 0).contains("baud = 0"));
    let impatient = |settings: &mut ProbeSettings| {
        settings.polling = Polling {
            timeout: std::time::Duration::ZERO,
            ..settings.polling
        }
    };
    assert!(refused(impatient).contains("quiet, timeout"));
    let of_nothing = |settings: &mut ProbeSettings| {
        settings.protocol = Protocol::Optoncdt(optoncdt::Settings::new(-1.0))
    };
    assert!(refused(of_nothing).contains("range_m = -1"));
}

#[test]
fn permission_denied_names_the_group_and_the_rule() {
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
