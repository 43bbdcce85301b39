//! `bench chirp`: excite, record, estimate the frequency response.

use super::analysis_output::{Made, make};
use super::options::BenchOptions;
use super::run_options::{RunOptions, RunReport, close};
use super::{CliError, Outcome};
use crate::config::{Config, Purpose, Sweep};
use crate::excitation::Chirp;
use crate::plant::Sampled;
use crate::recording::Recording;
use crate::session::{Plan, unless_stopped};
use crate::sim;
use serde::Serialize;
use std::path::Path;

/// Which bench, and how to excite it.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    run: RunOptions,
    /// First frequency in hertz
    #[arg(long, value_name = "HZ", allow_hyphen_values = true)]
    start: Option<f64>,
    /// Last frequency in hertz
    #[arg(long, value_name = "HZ", allow_hyphen_values = true)]
    stop: Option<f64>,
    /// Length of the sweep in seconds
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    duration: Option<f64>,
    /// The same amplitude in amperes at all frequencies
    #[arg(long, value_name = "A", allow_hyphen_values = true)]
    amplitude: Option<f64>,
    /// How the frequency runs over time: linear or logarithmic
    #[arg(long, value_name = "KIND")]
    sweep: Option<String>,
}

impl Args {
    fn sets(&self) -> Vec<String> {
        let number =
            |key: &str, value: Option<f64>| value.map(|value| format!("chirp.{key}={}", toml::Value::from(value)));
        let point =
            |a: f64| format!("chirp.amplitude=[{{ frequency_hz = 1.0, current_a = {} }}]", toml::Value::from(a));
        let flat = self.amplitude.map(point);
        let sweep = self.sweep.as_ref().map(|kind| format!("chirp.sweep={}", toml::Value::from(kind.as_str())));
        let numbers = [("start_hz", self.start), ("stop_hz", self.stop), ("duration_s", self.duration)];
        numbers.into_iter().filter_map(|(key, value)| number(key, value)).chain(flat).chain(sweep).collect()
    }
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    run: RunReport,
    expected_travel_m: f64,
    #[serde(flatten)]
    made: Made,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let config = args.bench.load(Purpose::Chirp, &args.sets())?;
    let expected_travel_m = check(&config)?;
    let plan = Plan::chirp(config.clone());
    let mut run = args.run.run(&plan, "chirp")?;
    let totals = run.totals()?;
    let report = RunReport::new(&run, &totals);
    let made = match report.outcome {
        "completed" => analysed(&run.path, &config)?,
        _ => Made::nothing("the run did not come to its end"),
    };
    let report = Report { run: report, expected_travel_m, made };
    close(run, &report, args.bench.json, &text(&report, &config))?;
    Ok(if report.made.is_stopped() { Outcome::Failed } else { report.run.exit() })
}

/// The analysis, which a person may stop: the recording is whole all the same.
pub(super) fn analysed(path: &Path, config: &Config) -> Result<Made, CliError> {
    let (path, config) = (path.to_path_buf(), config.clone());
    let made = unless_stopped(move || make(&Recording::open(&path)?, &config));
    made.map_err(|error| CliError::Failed(error.to_string()))?.unwrap_or(Ok(Made::stopped()))
}

/// Refuses a chirp that would trip an interlock, by the model of the whole rig; returns the travel to expect.
pub(super) fn check(config: &Config) -> Result<f64, CliError> {
    let period_s = config.servo.period_s();
    let force_constant = config.motor.force_constant_n_per_a;
    let rig = Sampled::new(&sim::modes(config)?, config.amplifier.bandwidth_hz, force_constant, period_s);
    Ok(Chirp::new(&config.chirp, period_s).check(config, &rig)?)
}

fn text(report: &Report, config: &Config) -> String {
    let sweep = match config.chirp.sweep {
        Sweep::Linear => "linear",
        Sweep::Logarithmic => "logarithmic",
    };
    let (start_hz, stop_hz) = (config.chirp.start_hz, config.chirp.stop_hz);
    format!(
        "{sweep} chirp, {start_hz} to {stop_hz} Hz in {} s; expected travel {:.0} um\n{}{}",
        config.chirp.duration_s,
        report.expected_travel_m * 1e6,
        report.run.text(config),
        report.made.text(),
    )
}
