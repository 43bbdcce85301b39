//! Options of every command that makes a run, and how the run ended, as text.

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::Arc;

use serde::Serialize;

use super::connection::ConnectOption;
use super::description_options::DescriptionOptions;
use super::error::CliError;
use super::exit::Exit;
use super::output::print_text;
use super::progress::ProgressLine;
use super::table::{labelled, wrap};
use bench_base::progress::Progress;
use bench_config::Config;
use bench_daemon::http_client::Target;
use bench_experiment::{
    self, Description, Plan, RigOwner, Run, RunConditions, RunSummary, Runner, Setup, StopCause,
    TimingSummary, TripSummary,
};
use bench_order::{BenchOptions, Order, RigOptions};
use bench_rig::motor::Moment;
use bench_rt::thread::Pace;

/// Folder for recordings without `--out`.
const FOLDER: &str = "recordings";

/// Where the runs of a command are made, and where their recordings go.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct RunOptions {
    /// Folder for the recording and the files computed from it [default: recordings]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    pub description: DescriptionOptions,
    #[command(flatten)]
    pub connect: ConnectOption,
}

/// A command that makes runs: what is ordered, and how it is carried out.
pub(super) struct RunCommand<'a> {
    pub order: Order,
    pub options: &'a RunOptions,
    /// Whether it only predicts what it would do.
    pub is_plan: bool,
}

impl RunCommand<'_> {
    /// Options of the bench of the order; without them, their default values.
    pub fn bench(&self) -> Cow<'_, BenchOptions> {
        let bench = self.order.bench();
        bench.map_or_else(Cow::default, Cow::Borrowed)
    }

    /// Options of the rig of the order; without them, their default values.
    fn rig(&self) -> Cow<'_, RigOptions> {
        let rig = self.order.rig();
        rig.map_or_else(Cow::default, Cow::Borrowed)
    }

    /// The daemon at an address that carries out the whole command, if the command names one.
    pub fn remote(&self) -> Result<Option<Target>, CliError> {
        let target = self.options.connect.remote()?;
        let unused = match (&target, self.is_plan, &self.options.out) {
            (Some(_), true, _) => "--plan is computed in this process",
            (Some(_), false, Some(_)) => "--out is chosen by the daemon at --connect",
            _ => return Ok(target),
        };
        Err(CliError::Usage(format!(
            "{unused}; leave it out, or leave --connect out"
        )))
    }

    /// Rig, pace and folder of a run.
    pub fn setup(&self, config: &Config) -> Result<Setup, CliError> {
        let (rig, options) = (self.rig(), self.options);
        if !rig.is_simulated(config) {
            rig.seed.refuse_on_devices()?;
        }
        let folder = options.out.clone();
        Ok(Setup {
            conditions: RunConditions {
                pace: rig.loop_pace(config)?,
                clear_fault: rig.clear_fault,
                motor: rig.motor_handling(config)?,
                folder: folder.unwrap_or_else(|| FOLDER.into()),
            },
            simulate: rig.simulate,
            now: Moment::now,
            description: options.description.description(self.bench().profile()),
            owner: self.owner(config)?,
        })
    }

    /// The daemon that makes the run. A rehearsal of a run on devices is made in this process.
    fn owner(&self, config: &Config) -> Result<Option<Arc<dyn RigOwner>>, CliError> {
        let rig = self.rig();
        if rig.simulate {
            return Ok(None);
        }
        let RunOptions {
            connect,
            description,
            ..
        } = self.options;
        connect.owner(rig.stage(config), &self.order, description)
    }

    /// Runs a plan on the rig of its configuration, with progress on a terminal.
    pub fn run(&self, plan: &Plan, phase: &'static str) -> Result<Run, CliError> {
        let setup = self.setup(&plan.config)?;
        let progress = Progress::new(phase);
        let _line = ProgressLine::show(&progress);
        Ok(Runner::with_progress(setup, progress).run(plan, phase)?)
    }
}

/// Adds the report of a run to its recording, closes the file, and prints the report in the requested form.
pub(super) fn close(
    run: Run,
    report: &impl Serialize,
    json: bool,
    text: &str,
) -> Result<(), CliError> {
    let results = bench_experiment::close(run, report)?;
    print_text(if json { &results } else { text })
}

/// The exit code of a run.
pub(super) fn exit(summary: &RunSummary) -> Exit {
    match (summary.is_completed(), summary.has_losses()) {
        (false, _) => Exit::Failed,
        (true, true) => Exit::Impaired,
        (true, false) => Exit::Done,
    }
}

/// Reason, time and remedy of a trip.
pub(super) fn trip_text(trip: &TripSummary, period_s: f64) -> String {
    let (tick, time_s) = (trip.tick, trip.tick as f64 * period_s);
    let reason = format!(
        "TRIPPED at tick {tick} ({time_s:.4} s): {}; zero current, amplifier disabled",
        trip.text
    );
    wrap(&reason, 2) + &labelled("remedy", trip.remedy)
}

/// Ending, counts and timing of a run.
pub(super) fn run_text(summary: &RunSummary, config: &Config) -> String {
    let period_s = config.servo.period_s();
    let trip = summary.trip.as_ref().map(|trip| trip_text(trip, period_s));
    let ending = format!(
        "{}: {} ticks ({:.2} s at {} Hz), {} overruns, {} lost records",
        summary.outcome.name(),
        summary.ticks,
        summary.ticks as f64 * period_s,
        config.servo.rate_hz,
        summary.overruns,
        summary.lost_records,
    );
    wrap(&ending, 0)
        + &description_text(&summary.description)
        + &recording_text(summary)
        + &timing_text(&summary.timing)
        + &trip.unwrap_or_default()
        + &labelled("recording", &summary.recording)
}

/// A line each for name, operator and note.
pub(super) fn description_text(description: &Description) -> String {
    let lines = [
        ("name", &description.name),
        ("operator", &description.operator),
        ("note", &description.note),
    ];
    let given = lines.into_iter();
    let given = given.filter_map(|(label, text)| Some((label, text.as_ref()?)));
    given.map(|(label, text)| labelled(label, text)).collect()
}

/// Why the run was stopped if nobody stopped it, or why it went on without a recording.
fn recording_text(summary: &RunSummary) -> String {
    match (summary.stop_cause, summary.unrecorded) {
        (
            Some(
                cause @ (StopCause::DiskNearlyFull
                | StopCause::RecordingTooLarge
                | StopCause::RecordsLost),
            ),
            _,
        ) => labelled("stopped", cause.text()),
        (None, Some(cause)) => {
            let text = format!("the run went on without a recording: {}", cause.text());
            labelled("recording", &text)
        }
        _ => String::new(),
    }
}

fn timing_text(timing: &TimingSummary) -> String {
    let refused = timing.scheduling.refused.iter();
    let refused: String = refused
        .map(|what| wrap(&format!("not granted: {what}"), 2))
        .collect();
    match timing.pace {
        Pace::Virtual => format!("  virtual pace (no timing to report)\n{refused}"),
        Pace::Realtime => realtime_text(timing) + &refused,
    }
}

fn realtime_text(timing: &TimingSummary) -> String {
    let us = |ns: u64| ns as f64 / 1e3;
    let (scheduling, lateness, compute) =
        (&timing.scheduling, &timing.lateness_ns, &timing.compute_ns);
    let memory = if scheduling.memory_locked {
        "locked"
    } else {
        "not locked"
    };
    let idle = if scheduling.idle_states_off {
        "off"
    } else {
        "on"
    };
    format!(
        "  schedule   {}, memory {memory}, idle states {idle}\n  lateness   p50 {:.1} us, p99 {:.1} us, max {:.1} us\n  compute    p50 {:.1} us, max {:.1} us\n",
        scheduling.policy,
        us(lateness.p50_ns),
        us(lateness.p99_ns),
        us(lateness.max_ns),
        us(compute.p50_ns),
        us(compute.max_ns)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_recording::Quantiles;
    use bench_rt::thread::Scheduling;

    #[test]
    fn timing_of_a_real_time_run_fits_80_columns() {
        let slow = Quantiles {
            p50_ns: 9_999_999_900,
            p99_ns: 9_999_999_900,
            p9999_ns: 9_999_999_900,
            max_ns: 9_999_999_900,
        };
        let timing = TimingSummary {
            pace: Pace::Realtime,
            scheduling: Scheduling {
                policy: "SCHED_FIFO 80".into(),
                memory_locked: false,
                idle_states_off: false,
                cpu: None,
                refused: vec!["a real-time priority ".repeat(8)],
            },
            lateness_ns: slow,
            compute_ns: slow,
        };
        let text = timing_text(&timing);
        assert!(
            text.lines().all(|line| line.chars().count() <= 80),
            "{text}"
        );
        for word in ["not locked", "p99 9999999.9", "max", "not granted: a"] {
            assert!(text.contains(word), "{word}: {text}");
        }
    }
}
