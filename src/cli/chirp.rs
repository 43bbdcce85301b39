//! `bench chirp`: excite, record, estimate the frequency response.

use super::analysis_output::{self, analyse_and_write};
use super::chirp_plan::{Expected, shape, show};
use super::error::CliError;
use super::options::BenchOptions;
use super::outcome::Outcome;
use super::run_options::{RunOptions, close, exit, run_text};
use crate::config::{Config, Purpose};
use crate::excitation::{self, Extremes};
use crate::experiment::{self, Plan, RunSummary, abandon_on_signal};
use crate::model::plant::DiscretePlant;
use crate::recording::Recording;
use crate::report::run_pages::AnalysisOutputs;
use serde::Serialize;
use std::path::Path;

/// Which bench, and how to excite it.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    run: RunOptions,
    /// What to excite with: chirp, multisine, stepped_sine or prbs
    #[arg(long, value_name = "KIND")]
    excitation: Option<String>,
    #[command(flatten)]
    band: ExcitationOptions,
    /// Length of the sweep in seconds
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    duration: Option<f64>,
    /// How the frequency runs over time: linear or logarithmic
    #[arg(long, value_name = "KIND")]
    sweep: Option<String>,
    /// Only say what the run would do: travel, current, heat, duration; nothing moves
    #[arg(long)]
    plan: bool,
}

/// Which frequencies, and with how much.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct ExcitationOptions {
    /// First frequency in hertz
    #[arg(long, value_name = "HZ", allow_hyphen_values = true)]
    start: Option<f64>,
    /// Last frequency in hertz
    #[arg(long, value_name = "HZ", allow_hyphen_values = true)]
    stop: Option<f64>,
    /// The same amplitude in amperes at all frequencies
    #[arg(long, value_name = "A", allow_hyphen_values = true)]
    amplitude: Option<f64>,
    /// Amplitude over frequency for the same displacement everywhere, by the model or by an FRF measured before; a stepped sine
    /// takes the model if neither this nor --amplitude is given
    #[arg(long, value_name = "model|FRF.csv", conflicts_with = "amplitude")]
    shape: Option<String>,
}

impl ExcitationOptions {
    pub(super) fn sets(&self) -> Vec<String> {
        let number = |(key, value): (&str, Option<f64>)| {
            value.map(|v| format!("chirp.{key}={}", toml::Value::from(v)))
        };
        let point = |a: f64| {
            format!(
                "chirp.amplitude=[{{ frequency_hz = 1.0, current_a = {} }}]",
                toml::Value::from(a)
            )
        };
        let binary = |a: f64| format!("prbs.amplitude_a={}", toml::Value::from(a));
        let flat = self
            .amplitude
            .map(point)
            .into_iter()
            .chain(self.amplitude.map(binary));
        [("start_hz", self.start), ("stop_hz", self.stop)]
            .into_iter()
            .filter_map(number)
            .chain(flat)
            .collect()
    }

    /// The settings with the amplitude shaped as asked for.
    pub(super) fn shaped(&self, config: Config) -> Result<Config, CliError> {
        shape(config, self.shape.as_deref(), self.amplitude.is_some())
    }
}

impl Args {
    fn sets(&self) -> Vec<String> {
        let text = |key: &str, value: &Option<String>| {
            value
                .as_ref()
                .map(|value| format!("{key}={}", toml::Value::from(value.as_str())))
        };
        let words = text("chirp.sweep", &self.sweep)
            .into_iter()
            .chain(text("excitation.kind", &self.excitation));
        let duration = self
            .duration
            .map(|s| format!("chirp.duration_s={}", toml::Value::from(s)));
        self.band
            .sets()
            .into_iter()
            .chain(duration)
            .chain(words)
            .collect()
    }

    /// The settings, with the amplitude shaped as asked for.
    fn config(&self) -> Result<Config, CliError> {
        self.band
            .shaped(self.bench.load(Purpose::Chirp, &self.sets())?)
    }
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    run: RunSummary,
    expected_travel_m: f64,
    expected: Expected,
    #[serde(flatten)]
    made: AnalysisOutputs,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let config = args.config()?;
    let expected = Expected::of(&check(&config)?);
    if args.plan {
        return show(&config, &expected, args.bench.json);
    }
    let plan = Plan::chirp(config.clone());
    let mut run = args.run.run(&plan, "chirp")?;
    let report = RunSummary::of(&mut run)?;
    let made = match report.is_completed() {
        true => analysed(&run.path, &config)?,
        false => AnalysisOutputs::run_incomplete(),
    };
    let report = Report {
        run: report,
        expected_travel_m: expected.travel_m,
        expected,
        made,
    };
    close(run, &report, args.bench.json, &text(&report, &config))?;
    Ok(if report.made.is_cancelled() {
        Outcome::Failed
    } else {
        exit(&report.run)
    })
}

/// The analysis, which a person may stop: the recording is whole all the same.
pub(super) fn analysed(path: &Path, config: &Config) -> Result<AnalysisOutputs, CliError> {
    let (of, config) = (path.to_path_buf(), config.clone());
    let made = abandon_on_signal(move || analyse_and_write(&Recording::open(&of)?, &config, &of));
    let made = made
        .map_err(|error| CliError::Failed(error.to_string()))?
        .unwrap_or(Ok(AnalysisOutputs::cancelled()));
    let kept = |error| {
        CliError::Failed(format!(
            "{error}; the run itself is whole, in {}",
            path.display()
        ))
    };
    made.map_err(kept)
}

/// Refuses an excitation that would trip an interlock, by the model of the whole rig; returns what to expect.
pub(super) fn check(config: &Config) -> Result<Extremes, CliError> {
    Ok(experiment::predicted_extremes(config)?)
}

/// The model of the whole rig.
pub(super) fn rig(config: &Config) -> Result<DiscretePlant, CliError> {
    Ok(experiment::rig_model(config)?)
}

fn text(report: &Report, config: &Config) -> String {
    format!(
        "{}; expected travel {:.0} um\n{}{}",
        excitation::words(config),
        report.expected_travel_m * 1e6,
        run_text(&report.run, config),
        analysis_output::text(&report.made),
    )
}
