//! `bench doctor`: checks whether the configured runs could start, and what could impair them. Nothing is moved.
//!
//! ```text
//!  system         kernel, clock, governor             \
//!  trial          a thread like the loop's, for 1 s    |
//!  scheduler      the privileges of that thread        |  facts, gathered without side effects
//!  can_interface  can_nodes  drive  vesc               |      |
//!  calibration    serial_port  readings                             |      v
//!  motor          heat of earlier runs                 |
//!  recordings     folder, space                        |  findings: a function of facts and settings
//!  runs           whether the commands accept the     /
//!                 configuration
//! ```
//!
//! In each file one function gathers facts and another one evaluates them, so that the evaluation can be tested with
//! facts of any machine. A drive is read by SDO uploads only: no NMT command, controlword or set-point is sent. A
//! probe is polled as in a run.
//!
//! A *failure* makes the run refuse to start, or trip at once. A *warning* impairs it.

mod amplifier;
pub mod bus_load;
mod calibration;
pub mod can_interface;
pub mod can_nodes;
pub mod drive;
mod finding;
mod motor;
pub mod readings;
pub mod recordings;
mod report;
pub mod runs;
pub mod scheduler;
pub mod serial_port;
pub mod system;
mod trial;
mod usb;
pub mod vesc;

use std::path::Path;

use bench_config::Config;
use bench_rig::devices;
use bench_rt::thread::Pace;

pub use amplifier::{examine_canopen_drive, examine_vesc};
pub use finding::{Finding, Severity, Subject};
pub use report::{Figures, Report};
pub use runs::RunChecks;
pub use trial::{Lateness, Trial, trial};

/// Examines everything that the runs of `config` need. `checks` are the results of the commands' own checks; `out` is the
/// folder for recordings.
pub fn examine(config: &Config, checks: &RunChecks, out: &Path) -> Report {
    let pace = if devices::is_simulated(config) {
        Pace::Virtual
    } else {
        Pace::Realtime
    };
    let mut report = Report::default();
    examine_configuration(config, checks, &mut report);
    examine_system(config, pace, &mut report);
    amplifier::examine(&config.amplifier, &config.servo, &mut report);
    report.extend(calibration::findings(config, report.figures.drive.as_ref()));
    examine_probe(config, &mut report);
    motor::examine(config, &mut report);
    let space = recordings::gather(out, runs::longest_ticks(config));
    report.extend([recordings::finding(&space)]);
    report.figures.recordings = Some(space.figures());
    report.conclude();
    report
}

fn examine_configuration(config: &Config, checks: &RunChecks, report: &mut Report) {
    report.extend([runs::kinds(config)]);
    report.extend(runs::attention(config));
    report.extend(runs::findings(checks, config.control.min_modulus_margin));
    report.figures.control = checks.control.as_ref().ok().cloned();
}

fn examine_system(config: &Config, pace: Pace, report: &mut Report) {
    report.extend(system::findings(&system::gather(), pace));
    match trial(&config.servo) {
        Ok(trial) => {
            let facts = scheduler::gather(&config.servo, &trial);
            report.extend(scheduler::findings(&facts, pace));
            let limit = config.interlock.overruns_per_s;
            report.extend([trial::finding(&trial.lateness, limit, pace)]);
            report.figures.lateness = Some(trial.lateness);
        }
        Err(error) => report.extend([Subject::Loop.failure(
            format!("cannot start a thread: {error}"),
            "raise the limit of processes (ulimit -u)",
        )]),
    }
}

fn examine_probe(config: &Config, report: &mut Report) {
    let Some(serial) = config.probe.device.serial() else {
        return;
    };
    let facts = serial_port::gather(&serial.line);
    let finding = serial_port::finding(&facts);
    let is_usable = finding.severity < Severity::Failure;
    report.extend([finding]);
    if !is_usable {
        return;
    }
    match devices::probe::open(&config.probe, config.servo.priority) {
        Err(error) => report.extend([serial_port::refusal(&error, &facts)]),
        Ok(mut probe) => {
            report.extend(serial_port::opened(&facts, &serial.line, probe.notes()));
            let readings = readings::gather(&mut probe, config.servo.period_s());
            let limits = &config.interlock;
            report.extend(readings::findings(&readings, &config.probe, limits));
            report.figures.probe = Some(readings);
        }
    }
}
