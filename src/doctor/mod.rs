//! `bench doctor`: could the configured run start, and what would be worse than it could be? Nothing moves.
//!
//! ```text
//!  system    kernel, clock, governor             \
//!  trial     a thread like the loop's, for 1 s    |
//!  scheduler what that thread was granted         |  facts, gathered by looking
//!  can_interface  can_nodes  drive  vesc          |      |
//!  serial_port    readings                        |      v
//!  recordings     folder, space                   |  findings: a function of the facts and the configuration
//!  runs           what the commands refuse       /
//! ```
//!
//! Each file gathers facts in one function and judges them in another: the second is tested with facts that no machine at
//! hand has. Drives are read by SDO only; no NMT order, no controlword, no set-point is sent. A probe is asked as always.
//!
//! A *failure* is what makes the run refuse to start or trip at once; what it merely suffers from is a *warning*.

mod amplifier;
pub mod bus_load;
pub mod can_interface;
pub mod can_nodes;
pub mod drive;
mod finding;
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

use crate::config::Config;
use crate::rig::devices;
use crate::rt::thread::Pace;

pub use amplifier::{examine_canopen_drive, watch};
pub use finding::{Finding, Severity};
pub use report::{Figures, Report};
pub use runs::RunChecks;
pub use trial::{Lateness, Trial, trial};

/// Looks at everything that the runs of `config` need. `runs` is what their commands say of it; `out` is the folder for
/// recordings.
pub fn examine(config: &Config, runs: &RunChecks, out: &Path) -> Report {
    let pace = if devices::is_simulated(config) {
        Pace::Virtual
    } else {
        Pace::Realtime
    };
    let mut report = Report::default();
    report.find(runs::kinds(config));
    report.find(runs::findings(runs, config.control.least_modulus_margin));
    report.figures.control = runs.control.as_ref().ok().cloned();
    system_and_loop(config, pace, &mut report);
    amplifier::examine(config, &mut report);
    probe(config, &mut report);
    let space = recordings::gather(out, runs::longest_ticks(config));
    report.find(recordings::findings(&space));
    report.figures.recordings = Some(space.figures());
    report.conclude();
    report
}

fn system_and_loop(config: &Config, pace: Pace, report: &mut Report) {
    report.find(system::findings(&system::gather(), pace));
    match trial(&config.servo) {
        Ok(trial) => {
            let facts = scheduler::gather(&config.servo, &trial);
            report.find(scheduler::findings(&facts, pace));
            report.find([trial::finding(
                &trial.lateness,
                config.interlock.overruns_per_s,
                pace,
            )]);
            report.figures.lateness = Some(trial.lateness);
        }
        Err(error) => report.find([Finding::failure(
            "loop",
            format!("a thread cannot be started: {error}"),
            "raise the limit of processes (ulimit -u)",
        )]),
    }
}

fn probe(config: &Config, report: &mut Report) {
    let Some(line) = config.probe.device.line() else {
        return;
    };
    let facts = serial_port::gather(line);
    let found = serial_port::findings(&facts);
    let is_usable = found
        .iter()
        .all(|finding| finding.verdict < Severity::Failure);
    report.find(found);
    if !is_usable {
        return;
    }
    match devices::probe::open(config) {
        Err(error) => report.find([serial_port::refusal(&error, &facts)]),
        Ok(mut probe) => {
            report.find(serial_port::opened(&facts, line, probe.notes()));
            let seen = readings::gather(&mut probe, config);
            report.find(readings::findings(&seen, config));
            report.figures.probe = Some(seen);
        }
    }
}
