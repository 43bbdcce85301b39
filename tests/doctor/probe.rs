//! `bench doctor` with emulated probes on pseudo terminals.

use std::sync::Arc;

use bench_config::{Config, Source, load};
use bench_hal::serial::emulator::Fault;
use bench_hal::serial::{Protocol, SerialProbe};
use bench_rig::devices::probe::driver_settings;
use nix::fcntl::{Flock, FlockArg};
use serde_json::Value;

use crate::doctor::command::{checked_report, findings_on};
use crate::doctor::program::{Bench, number};
use crate::doctor::rehearsal::Rehearsal;

/// The profile `lab` with time limits that a loaded machine does not reach: timing is not tested.
const NO_TIMING_LIMIT: [&str; 3] = [
    "interlock.overruns_per_s=1000000",
    "interlock.probe_stale_s=10",
    "amplifier.device.interface=no-such-can",
];

fn sets(rehearsal: &Rehearsal) -> Vec<String> {
    let port = format!("probe.device.line.port={}", rehearsal.path.display());
    let locks = format!(
        "probe.device.line.lock_folder={}",
        rehearsal.locks.path().display()
    );
    NO_TIMING_LIMIT
        .map(String::from)
        .into_iter()
        .chain([port, locks])
        .collect()
}

fn config(sets: Vec<String>) -> Config {
    load(&Source {
        config: Some("lab".into()),
        sets,
        ..Source::default()
    })
    .unwrap()
}

fn protocol() -> Arc<dyn Protocol> {
    Arc::clone(&config(vec![]).probe.device.serial().unwrap().protocol)
}

/// A probe with 650 readings per second. The stage is 10 um from zero, which is the middle of the range of 2 mm.
fn rehearsal() -> Rehearsal {
    Rehearsal::new(&protocol(), 650.0, |_| 1.01e-3)
}

fn doctor(sets: &[String]) -> Value {
    let sets = sets.iter().flat_map(|set| ["--set", set]);
    checked_report(
        &Bench::new().run_with(
            ["doctor", "--config", "lab", "--json"]
                .into_iter()
                .chain(sets),
        ),
    )
}

#[test]
fn readings_are_assessed_and_the_port_is_released() {
    let rehearsal = rehearsal();
    let report = doctor(&sets(&rehearsal));
    let port = findings_on(&report, "serial port");
    assert!(
        port[0].starts_with("ok: ") && port[0].ends_with("may open it"),
        "{port:?}"
    );
    assert_eq!(port[1], "ok: opened at 230400 baud with even parity");
    assert!(
        port[2].starts_with("note: ") && port[2].contains("a pseudo terminal has no parity"),
        "{port:?}"
    );
    let probe = &report["probe"];
    assert!(
        probe["came"] == true
            && number(&probe["rate_hz"]) > 0.0
            && number(&probe["age_mean_s"]) > 0.0,
        "{probe}"
    );
    // One count of 0xFFFFFF is 0.12 nm.
    assert!(
        (number(&probe["position_mean_m"]) - 10e-6).abs() < 1e-9,
        "{probe}"
    );
    assert!(
        findings_on(&report, "readings").contains(&"note: all readings are equal".to_string()),
        "{report}"
    );
    let probe = SerialProbe::open(driver_settings(&config(sets(&rehearsal)).probe).unwrap());
    assert!(probe.is_ok(), "{:?}", probe.err());
}

#[test]
fn port_in_use_is_reported_with_the_process() {
    let rehearsal = rehearsal();
    let _holder =
        SerialProbe::open(driver_settings(&config(sets(&rehearsal)).probe).unwrap()).unwrap();
    let found = findings_on(&doctor(&sets(&rehearsal)), "serial port");
    let held = format!(
        "{} is used by process {} (",
        rehearsal.path.display(),
        std::process::id()
    );
    assert!(
        found.len() == 2 && found[1].starts_with(&format!("failure: {held}")),
        "{found:?}"
    );
}

#[test]
fn process_without_lock_file_is_found_by_its_open_files() {
    let rehearsal = rehearsal();
    let terminal = std::fs::File::options()
        .read(true)
        .write(true)
        .open(&rehearsal.path)
        .unwrap();
    let _locked = Flock::lock(terminal, FlockArg::LockExclusiveNonblock).unwrap();
    let found = findings_on(&doctor(&sets(&rehearsal)), "serial port");
    // A process that another test begins has the files of this one until it runs its program, and may be listed first.
    let own = format!("process {} (", std::process::id());
    assert!(
        found[1].contains(" is used by process ") && found[1].contains(&own),
        "{found:?}"
    );
}

#[test]
fn silent_probe_is_a_failure() {
    let rehearsal = rehearsal();
    rehearsal.inject_fault(Fault::Silence);
    let found = findings_on(&doctor(&sets(&rehearsal)), "readings");
    assert!(
        found.len() == 1 && found[0].starts_with("failure: the probe sends nothing: 0 bytes"),
        "{found:?}"
    );
}

#[test]
fn target_out_of_range_is_a_failure() {
    let rehearsal = rehearsal();
    rehearsal.inject_fault(Fault::OutOfRange);
    let found = findings_on(&doctor(&sets(&rehearsal)), "readings");
    assert!(
        found.len() == 1
            && found[0].starts_with("failure: the target is outside the probe's range"),
        "{found:?}"
    );
}

#[test]
fn damaged_bytes_are_a_warning_with_the_count() {
    let rehearsal = rehearsal();
    rehearsal.inject_fault(Fault::Corrupt { every: 500 });
    let report = doctor(&sets(&rehearsal));
    let found = findings_on(&report, "readings");
    assert!(
        found
            .iter()
            .any(|f| f.starts_with("warning: within") && f.contains("damaged bytes")),
        "{found:?}"
    );
    assert!(number(&report["probe"]["damaged_bytes"]) > 0.0, "{report}");
}

#[test]
fn position_beyond_the_soft_limit_is_a_failure() {
    let rehearsal = Rehearsal::new(&protocol(), 650.0, |_| 1.95e-3);
    let found = findings_on(&doctor(&sets(&rehearsal)), "readings");
    let failure = found
        .iter()
        .find(|f| f.starts_with("failure: "))
        .expect("a failure");
    assert!(
        failure.contains("farthest +950.0 um; the soft limit is 900.0 um"),
        "{failure}"
    );
}

#[test]
fn distinguishes_missing_port_file_and_device() {
    let with = |port: &str| {
        let port = format!("probe.device.line.port={port}");
        findings_on(
            &doctor(&[NO_TIMING_LIMIT.map(String::from).to_vec(), vec![port]].concat()),
            "serial port",
        )
    };
    assert_eq!(
        with("/dev/ttyNONE9"),
        ["failure: /dev/ttyNONE9 does not exist"]
    );
    assert_eq!(
        with("/etc/hostname"),
        ["failure: /etc/hostname is not a terminal"]
    );
    let null = with("/dev/null");
    assert!(
        null[1].starts_with("failure: /dev/null: cannot be opened as a serial port"),
        "{null:?}"
    );
}
