//! Options of every command that makes a run, and how the run ended, as text.

use std::path::PathBuf;
use std::sync::Arc;

use serde::Serialize;

use super::connection::ConnectOption;
use super::description_options::DescriptionOptions;
use super::error::CliError;
use super::options::{BenchOptions, SeedOption};
use super::outcome::Outcome;
use super::output::print_text;
use super::progress::ProgressLine;
use super::table::{labelled, wrap};
use bench_base::progress::Progress;
use bench_config::Config;
use bench_experiment::{
    self, Description, MotorError, MotorForecast, MotorHandling, MotorSummary, Plan, RigOwner, Run,
    RunSummary, Runner, Setup, Stage, StopCause, TimingSummary, TripSummary,
};
use bench_rig::motor::{Moment, MotorMemory};
use bench_rt::thread::Pace;

/// Where and how to run.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct RunOptions {
    #[command(flatten)]
    pub seed: SeedOption,
    /// Pace of the loop [default: virtual on the simulated stage, realtime on devices]
    #[arg(long, value_name = "PACE")]
    pace: Option<Pace>,
    /// Run on the simulated stage, with the rates, delays and resolution of the configured devices
    #[arg(long)]
    simulate: bool,
    /// Clear a latched fault of the amplifier; first remove its cause
    #[arg(long)]
    clear_fault: bool,
    /// The motor is cold: it has had no current for several thermal time constants. Needed at most before the first run on a
    /// device; later the program knows the state of the motor
    #[arg(long)]
    motor_cold: bool,
    /// Wait until the motor is cool enough, where the run would be refused because of the heat of earlier runs
    #[arg(long)]
    wait_for_motor: bool,
    /// Folder for the recording and the files computed from it
    #[arg(long, value_name = "DIR", default_value = "recordings")]
    pub out: PathBuf,
    #[command(flatten)]
    pub description: DescriptionOptions,
    #[command(flatten)]
    connect: ConnectOption,
}

impl RunOptions {
    /// The stage of the run.
    pub fn stage(&self, config: &Config) -> Stage {
        if self.simulate {
            Stage::Simulated
        } else {
            Stage::of(config)
        }
    }

    /// Whether the run is on the simulated stage.
    pub fn is_simulated(&self, config: &Config) -> bool {
        self.stage(config) == Stage::Simulated
    }

    /// The requested pace, or that of the rig. Devices run in real time only.
    fn pace(&self, config: &Config) -> Result<Pace, CliError> {
        match (self.pace, self.is_simulated(config)) {
            (Some(Pace::Virtual), false) => Err(CliError::Usage(
                "--pace virtual is valid only for the simulated stage, because devices run in real time; leave it out, or add --simulate".into(),
            )),
            (Some(pace), _) => Ok(pace),
            (None, true) => Ok(Pace::Virtual),
            (None, false) => Ok(Pace::Realtime),
        }
    }

    /// Rig, pace and folder of a run.
    pub fn setup(&self, bench: &BenchOptions, config: &Config) -> Result<Setup, CliError> {
        if !self.is_simulated(config) {
            self.seed.refuse_on_devices()?;
        }
        Ok(Setup {
            pace: self.pace(config)?,
            simulate: self.simulate,
            clear_fault: self.clear_fault,
            motor: self.motor(config)?,
            now: Moment::now,
            folder: self.out.clone(),
            description: self.description.description(bench.profile()),
            owner: self.owner(config)?,
        })
    }

    /// The daemon that makes the run. A rehearsal of a run on devices is made in this process.
    fn owner(&self, config: &Config) -> Result<Option<Arc<dyn RigOwner>>, CliError> {
        if self.simulate {
            Ok(None)
        } else {
            self.connect.owner(self.stage(config), &self.description)
        }
    }

    /// How the heat of the motor is treated. With `--motor-cold` this statement is stored first.
    fn motor(&self, config: &Config) -> Result<MotorHandling, CliError> {
        if self.is_simulated(config) {
            self.refuse_motor_options()?;
            return Ok(MotorHandling::Simulated);
        }
        if self.motor_cold {
            let stated = motor_memory(config)?.state_cold(&Moment::now());
            stated.map_err(MotorError::from)?;
        }
        Ok(if self.wait_for_motor {
            MotorHandling::WaitUntilCool
        } else {
            MotorHandling::Remembered
        })
    }

    fn refuse_motor_options(&self) -> Result<(), CliError> {
        let options = [
            (self.motor_cold, "--motor-cold"),
            (self.wait_for_motor, "--wait-for-motor"),
        ];
        match options.iter().find(|(is_given, _)| *is_given) {
            None => Ok(()),
            Some((_, option)) => Err(CliError::Usage(format!(
                "{option} is valid only on devices, because the simulated motor is cold at its first run and rests between runs; leave it out"
            ))),
        }
    }

    /// The motor of the configured devices before the run `plan`; `None` for a simulated motor.
    pub fn motor_summary(&self, plan: &Plan) -> Result<Option<MotorSummary>, CliError> {
        match self.motor(&plan.config)? {
            MotorHandling::Simulated => Ok(None),
            MotorHandling::Remembered | MotorHandling::WaitUntilCool => {
                let memory = motor_memory(&plan.config)?;
                let forecast = MotorForecast::of(plan, &memory, None, Moment::now())?;
                Ok(Some(forecast.summary()))
            }
        }
    }

    /// Runs a plan on the rig of its configuration, with progress on a terminal.
    pub fn run(
        &self,
        bench: &BenchOptions,
        plan: &Plan,
        phase: &'static str,
    ) -> Result<Run, CliError> {
        let setup = self.setup(bench, &plan.config)?;
        let progress = Progress::new(phase);
        let _line = ProgressLine::show(&progress);
        Ok(Runner::with_progress(setup, progress).run(plan, phase)?)
    }
}

fn motor_memory(config: &Config) -> Result<MotorMemory, CliError> {
    let memory = MotorMemory::of(config);
    Ok(memory.map_err(MotorError::from)?)
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
pub(super) fn exit(summary: &RunSummary) -> Outcome {
    match (summary.is_completed(), summary.has_losses()) {
        (false, _) => Outcome::Failed,
        (true, true) => Outcome::Impaired,
        (true, false) => Outcome::Done,
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
