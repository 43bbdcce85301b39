//! What `bench chirp` and `bench control` have in common: where the run is recorded, at what pace, and how it ended.

use std::path::PathBuf;
use std::time::SystemTime;

use bench_hal::Rig;

use serde::Serialize;

use super::error::CliError;
use super::outcome::Outcome;
use super::output::print_text;
use super::progress::ProgressLine;
use super::table::labelled;
use crate::config::Config;
use crate::experiment::{Ending, Plan, Run, RunError};
use crate::recording::{Quantiles, Totals};
use crate::rig::calibration::{CalibratedRig, Calibration, load_calibration};
use crate::rig::devices;
use crate::rt::arming::Trip;
use crate::rt::thread::Pace;
use crate::util::progress::Progress;

/// Where and how to run.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct RunOptions {
    /// Pace of the loop [default: virtual on the simulated stage, realtime on devices]
    #[arg(long, value_name = "virtual|realtime", value_parser = pace)]
    pace: Option<Pace>,
    /// Run on the simulated stage, with the rates, delays and steps of the configured devices
    #[arg(long)]
    simulate: bool,
    /// Clear a fault that the amplifier has kept, as a person's word that its cause is gone
    #[arg(long)]
    clear_fault: bool,
    /// Folder for the recording and what is made from it
    #[arg(long, value_name = "DIR", default_value = "recordings")]
    pub out: PathBuf,
}

fn pace(text: &str) -> Result<Pace, String> {
    [Pace::Virtual, Pace::Realtime]
        .into_iter()
        .find(|p| p.name() == text)
        .ok_or("allowed is virtual, realtime".into())
}

impl RunOptions {
    /// On the configured devices, at their pace.
    pub fn on_devices(out: PathBuf) -> RunOptions {
        RunOptions {
            pace: None,
            simulate: false,
            clear_fault: false,
            out,
        }
    }

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

    /// The rig of a plan, corrected by `given` or by the configured calibration; and the plan with what is known of both.
    fn open(
        &self,
        plan: &Plan,
        given: Option<Calibration>,
    ) -> Result<(Plan, Box<dyn Rig>), CliError> {
        let config = &plan.config;
        let mut opened = if self.is_simulated(config) {
            devices::simulate(config)?
        } else {
            devices::open(config)?
        };
        opened
            .notes
            .iter()
            .for_each(|note| tracing::warn!("{note}"));
        if self.clear_fault {
            opened
                .rig
                .reset_fault()
                .map_err(|error| CliError::Failed(format!("amplifier: {error}; nothing moved")))?;
        }
        let mut plan = plan.clone();
        let used = match given {
            Some(calibration) => Some((calibration, Vec::new())),
            None => load_calibration(
                &config.calibration,
                &opened.amplifier,
                &opened.probe,
                SystemTime::now(),
            )?,
        };
        plan.devices = vec![("amplifier", opened.amplifier), ("probe", opened.probe)];
        let Some((calibration, warnings)) = used else {
            return Ok((plan, opened.rig));
        };
        warnings
            .iter()
            .for_each(|warning| tracing::warn!("{warning}"));
        plan.calibration = Some(calibration.to_toml()?);
        Ok((plan, Box::new(CalibratedRig::new(opened.rig, &calibration))))
    }

    /// Runs a plan on the rig of its configuration, with progress on a terminal.
    pub fn run(&self, plan: &Plan, what: &'static str) -> Result<Run, CliError> {
        self.run_with_calibration(plan, what, None)
    }

    /// The same, with a calibration other than the configured one.
    pub fn run_with_calibration(
        &self,
        plan: &Plan,
        what: &'static str,
        calibration: Option<Calibration>,
    ) -> Result<Run, CliError> {
        let pace = self.pace(&plan.config)?;
        let (plan, rig) = self.open(plan, calibration)?;
        let progress = Progress::new(what);
        let line = ProgressLine::show(&progress);
        let run = crate::experiment::run(&plan, rig, pace, &self.out, &mut |done, total| {
            progress.set(done, total)
        });
        drop(line);
        run.map_err(|error| match error {
            RunError::Plan(plan) => CliError::from(plan),
            other => CliError::Failed(other.to_string()),
        })
    }
}

/// Adds the report of a run to its recording and closes the file; returns the report as JSON.
pub(super) fn finish(run: Run, report: &impl Serialize) -> Result<String, CliError> {
    let results = serde_json::to_string_pretty(report)
        .map_err(|e| CliError::Failed(format!("cannot write JSON: {e}")))?;
    run.finish(&results)?;
    Ok(results + "\n")
}

/// Adds the report of a run to its recording, closes the file, and prints the report as asked.
pub(super) fn close(
    run: Run,
    report: &impl Serialize,
    json: bool,
    text: &str,
) -> Result<(), CliError> {
    let results = finish(run, report)?;
    print_text(if json { &results } else { text })
}

/// How a run went, as `bench chirp` and `bench control` both tell it.
#[derive(Clone, Debug, Serialize)]
pub(super) struct RunReport {
    pub outcome: &'static str,
    pub trip: Option<TripReport>,
    pub ticks: u64,
    pub overruns: u64,
    pub lost_records: u64,
    pub recording: String,
    /// Equal for two runs whose loops saw and did the same, bit for bit.
    pub loop_digest: String,
    pub timing: Timing,
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct TripReport {
    reason: &'static str,
    tick: u64,
    text: String,
    remedy: &'static str,
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct Timing {
    pace: &'static str,
    policy: String,
    memory_locked: bool,
    cpu: Option<usize>,
    refused: Vec<String>,
    lateness_ns: QuantilesJson,
    compute_ns: QuantilesJson,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct QuantilesJson {
    p50: u64,
    p99: u64,
    p9999: u64,
    max: u64,
}

impl From<&Quantiles> for QuantilesJson {
    fn from(q: &Quantiles) -> Self {
        QuantilesJson {
            p50: q.p50_ns,
            p99: q.p99_ns,
            p9999: q.p9999_ns,
            max: q.max_ns,
        }
    }
}

impl TripReport {
    /// Of a run that tripped.
    pub(super) fn of(ending: &Ending) -> Option<TripReport> {
        let told = |(trip, tick): (Trip, u64)| TripReport {
            reason: trip.reason(),
            tick,
            text: trip.to_string(),
            remedy: trip.remedy(),
        };
        ending.trip().map(told)
    }

    /// Two lines for people.
    pub(super) fn text(&self, period_s: f64) -> String {
        format!(
            "\n  TRIPPED at tick {} ({:.4} s): {}; zero current, amplifier disabled\n  remedy     {}",
            self.tick,
            self.tick as f64 * period_s,
            self.text,
            self.remedy
        )
    }
}

impl RunReport {
    pub fn new(run: &Run, totals: &Totals) -> Self {
        let ending = Ending::from(&run.ended);
        RunReport {
            outcome: ending.name(),
            trip: TripReport::of(&ending),
            ticks: totals.ticks,
            overruns: totals.overruns,
            // A loss at the very end leaves no gap: the loop's own count tells.
            lost_records: totals.lost_records.max(run.ended.lost_records),
            recording: run.path.display().to_string(),
            loop_digest: format!("{:016x}", totals.loop_digest),
            timing: Timing {
                pace: run.pace.name(),
                policy: run.scheduling.policy.clone(),
                memory_locked: run.scheduling.memory_locked,
                cpu: run.scheduling.cpu,
                refused: run.scheduling.refused.clone(),
                lateness_ns: (&totals.lateness).into(),
                compute_ns: (&totals.compute).into(),
            },
        }
    }

    pub fn exit(&self) -> Outcome {
        match self.outcome {
            "completed" if self.overruns + self.lost_records == 0 => Outcome::Done,
            "completed" => Outcome::Impaired,
            _ => Outcome::Failed,
        }
    }

    /// How the run went, for people.
    pub fn text(&self, config: &Config) -> String {
        let seconds = self.ticks as f64 * config.servo.period_s();
        let trip = self
            .trip
            .as_ref()
            .map_or(String::new(), |trip| trip.text(config.servo.period_s()));
        let refused: String = self
            .timing
            .refused
            .iter()
            .map(|line| format!("\n  not granted: {line}"))
            .collect();
        let t = &self.timing;
        let timing = match t.pace {
            "virtual" => "virtual pace (no timing to report)".to_string(),
            _ => format!(
                "{}, memory {}; lateness p50 {:.1} us, p99 {:.1} us, max {:.1} us; compute p50 {:.1} us, max {:.1} us",
                t.policy,
                if t.memory_locked {
                    "locked"
                } else {
                    "not locked"
                },
                t.lateness_ns.p50 as f64 / 1e3,
                t.lateness_ns.p99 as f64 / 1e3,
                t.lateness_ns.max as f64 / 1e3,
                t.compute_ns.p50 as f64 / 1e3,
                t.compute_ns.max as f64 / 1e3
            ),
        };
        format!(
            "{}: {} ticks ({seconds:.2} s at {} Hz), {} overruns, {} lost records\n  {timing}{refused}{trip}\n{}",
            self.outcome,
            self.ticks,
            config.servo.rate_hz,
            self.overruns,
            self.lost_records,
            labelled("recording", &self.recording)
        )
    }
}
