//! Options of every command that makes a run, and the text of its ending.

use std::path::PathBuf;

use serde::Serialize;

use super::error::CliError;
use super::outcome::Outcome;
use super::output::print_text;
use super::progress::ProgressLine;
use super::table::labelled;
use crate::config::Config;
use crate::experiment::{self, Plan, Run, RunSummary, Runner, Setup, TimingSummary, TripSummary};
use crate::rig::devices;
use crate::rt::thread::Pace;
use crate::util::progress::Progress;

/// Where and how to run.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct RunOptions {
    /// Pace of the loop [default: virtual on the simulated stage, realtime on devices]
    #[arg(long, value_name = "PACE")]
    pace: Option<Pace>,
    /// Run on the simulated stage, with the rates, delays and steps of the configured devices
    #[arg(long)]
    simulate: bool,
    /// Clear a latched fault of the amplifier; first remove its cause
    #[arg(long)]
    clear_fault: bool,
    /// Folder for the recording and the files computed from it
    #[arg(long, value_name = "DIR", default_value = "recordings")]
    pub out: PathBuf,
}

impl RunOptions {
    fn is_simulated(&self, config: &Config) -> bool {
        self.simulate || devices::is_simulated(config)
    }

    /// The pace asked for, or that of the rig; devices cannot be hurried.
    fn pace(&self, config: &Config) -> Result<Pace, CliError> {
        match (self.pace, self.is_simulated(config)) {
            (Some(Pace::Virtual), false) => Err(CliError::Usage(
                "--pace virtual is for the simulated stage; devices have a pace of their own: leave it out, or add --simulate".into(),
            )),
            (Some(pace), _) => Ok(pace),
            (None, true) => Ok(Pace::Virtual),
            (None, false) => Ok(Pace::Realtime),
        }
    }

    /// Rig, pace and folder of a run.
    pub fn setup(&self, config: &Config) -> Result<Setup, CliError> {
        Ok(Setup {
            pace: self.pace(config)?,
            simulate: self.simulate,
            clear_fault: self.clear_fault,
            folder: self.out.clone(),
        })
    }

    /// Runs a plan on the rig of its configuration, with progress on a terminal.
    pub fn run(&self, plan: &Plan, phase: &'static str) -> Result<Run, CliError> {
        let (setup, progress) = (self.setup(&plan.config)?, Progress::new(phase));
        let _line = ProgressLine::show(&progress);
        Ok(Runner { setup, progress }.run(plan, phase)?)
    }
}

/// Adds the report of a run to its recording, closes the file, and prints the report in the requested form.
pub(super) fn close(
    run: Run,
    report: &impl Serialize,
    json: bool,
    text: &str,
) -> Result<(), CliError> {
    let results = experiment::close(run, report)?;
    print_text(if json { &results } else { text })
}

/// The exit code of a run.
pub(super) fn exit(summary: &RunSummary) -> Outcome {
    match (summary.is_completed(), summary.has_losses()) {
        (false, _) => Outcome::Failed,
        (true, true) => Outcome::Impaired,
        (true, false) => Outcome::Done,
    }
}

/// A trip, on two lines.
pub(super) fn trip_text(trip: &TripSummary, period_s: f64) -> String {
    format!(
        "\n  TRIPPED at tick {} ({:.4} s): {}; zero current, amplifier disabled\n  remedy     {}",
        trip.tick,
        trip.tick as f64 * period_s,
        trip.text,
        trip.remedy
    )
}

/// Ending, counts and timing of a run.
pub(super) fn run_text(summary: &RunSummary, config: &Config) -> String {
    let period_s = config.servo.period_s();
    let trip = summary.trip.as_ref().map(|trip| trip_text(trip, period_s));
    format!(
        "{}: {} ticks ({:.2} s at {} Hz), {} overruns, {} lost records\n  {}{}\n{}",
        summary.outcome.name(),
        summary.ticks,
        summary.ticks as f64 * period_s,
        config.servo.rate_hz,
        summary.overruns,
        summary.lost_records,
        timing_text(&summary.timing),
        trip.unwrap_or_default(),
        labelled("recording", &summary.recording)
    )
}

fn timing_text(timing: &TimingSummary) -> String {
    let scheduling = &timing.scheduling;
    let refused = scheduling.refused.iter();
    let refused: String = refused
        .map(|line| format!("\n  not granted: {line}"))
        .collect();
    if timing.pace == Pace::Virtual {
        return format!("virtual pace (no timing to report){refused}");
    }
    let locked = if scheduling.memory_locked {
        "locked"
    } else {
        "not locked"
    };
    let us = |ns: u64| ns as f64 / 1e3;
    let (lateness, compute) = (&timing.lateness_ns, &timing.compute_ns);
    format!(
        "{}, memory {locked}; lateness p50 {:.1} us, p99 {:.1} us, max {:.1} us; compute p50 {:.1} us, max {:.1} us{refused}",
        scheduling.policy,
        us(lateness.p50_ns),
        us(lateness.p99_ns),
        us(lateness.max_ns),
        us(compute.p50_ns),
        us(compute.max_ns)
    )
}
