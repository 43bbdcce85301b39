//! `bench calibrate`: scale, sign and offset of amplifier and probe, and the delay from command to reading.

use std::path::Path;

use serde::Serialize;

use super::error::CliError;
use super::exit::Exit;
use super::output::{print_result, print_text, warn};
use super::progress::ProgressLine;
use super::run_options::{RunCommand, RunOptions, exit, run_text};
use super::table::wrap;
use bench_base::decimal::Decimal;
use bench_base::progress::Progress;
use bench_config::{Config, warnings};
use bench_experiment::calibration::{self, CalibrationPlan};
use bench_experiment::{CalibrationForecast, RunSummary, Runner};
use bench_order::{CalibrateOrder, Order};
use bench_rig::calibration::{
    AmplifierCalibration, Calibration, ChainCalibration, ProbeCalibration,
};

/// The order, and where its recordings go.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    order: CalibrateOrder,
    #[command(flatten)]
    pub run: RunOptions,
    /// Only print what the runs would do: travel, current, duration; no motion
    #[arg(long)]
    plan: bool,
}

impl Args {
    /// The command with its order.
    pub(super) fn command(&self) -> RunCommand<'_> {
        RunCommand {
            order: Order::Calibrate(self.order.clone()),
            options: &self.run,
            is_plan: self.plan,
        }
    }
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    run: RunSummary,
    delay_recording: Option<String>,
    calibration_file: Option<String>,
    calibration: Option<Calibration>,
    /// Why there is no calibration.
    why: Option<String>,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let config = args.order.config()?;
    let plan = calibration::check(&config)?;
    check_target(args.order.write.as_deref())?;
    if args.plan {
        warn(&warnings(&config));
        let chirp = (!args.order.no_delay).then_some(plan.chirp);
        let forecast = CalibrationForecast::new(&config, plan.steps, chirp);
        let text = plan_text(&plan, &config, !args.order.no_delay);
        print_result(args.order.bench.json, &forecast, |_| text)?;
        return Ok(Exit::Done);
    }
    let setup = args.command().setup(&config)?;
    if !args.order.bench.json {
        print_text(&plan_text(&plan, &config, !args.order.no_delay))?;
    }
    let progress = Progress::new("static steps");
    let line = ProgressLine::show(&progress);
    let made = calibration::run(
        &Runner::with_progress(setup, progress),
        &config,
        !args.order.no_delay,
    )?;
    drop(line);
    let report = report(args, made)?;
    print_result(args.order.bench.json, &report, |report| {
        text(report, &config)
    })?;
    Ok(match report.calibration {
        Some(_) => exit(&report.run),
        None => Exit::Failed,
    })
}

/// Refuses, before any motion, a file for the calibration that exists or cannot be created.
fn check_target(target: Option<&Path>) -> Result<(), CliError> {
    let Some(target) = target else {
        return Ok(());
    };
    let file = target.display();
    if target.exists() {
        return Err(CliError::Failed(format!(
            "--write {file}: the file exists, and a calibration is never overwritten, so nothing was moved; choose another file with --write"
        )));
    }
    match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
            Err(CliError::Failed(format!(
                "--write {file}: there is no folder {}, so nothing was moved; create it, or choose another file with --write",
                folder.display()
            )))
        }
        _ => Ok(()),
    }
}

/// Steps and chirp with their extremes, printed before the first run.
fn plan_text(plan: &CalibrationPlan, config: &Config, with_delay: bool) -> String {
    let steps = format!(
        "static steps up to {:.3} A to both sides in {:.1} s; expected travel {:.0} um",
        plan.steps.current_a,
        plan.steps.duration_s,
        plan.steps.travel_m * 1e6
    );
    let chirp = format!(
        "then, for the delay: {}; expected travel {:.0} um",
        config.excitation_text(),
        plan.chirp.travel_m * 1e6
    );
    let chirp = if with_delay {
        wrap(&chirp, 0)
    } else {
        String::new()
    };
    wrap(&steps, 0) + &chirp
}

/// The report; a calibration is written to its file.
fn report(args: &Args, made: calibration::CalibrationRun) -> Result<Report, CliError> {
    let (calibration, why) = match made.calibration {
        Ok(calibration) => (Some(calibration), None),
        Err(why) => (None, Some(why)),
    };
    let file = match &calibration {
        Some(calibration) => Some(write(args, calibration, &made.steps.recording)?),
        None => None,
    };
    Ok(Report {
        run: made.steps,
        delay_recording: made.delay_recording,
        calibration_file: file,
        calibration,
        why,
    })
}

fn write(args: &Args, calibration: &Calibration, recording: &str) -> Result<String, CliError> {
    let beside = Path::new(recording).with_extension("calibration.toml");
    let path = args
        .order
        .write
        .as_ref()
        .unwrap_or(&beside)
        .display()
        .to_string();
    calibration.write_new(path.as_ref()).map_err(|e| {
        CliError::Failed(format!(
            "cannot write {path}: {e}; choose another file with --write"
        ))
    })?;
    Ok(path)
}

fn text(report: &Report, config: &Config) -> String {
    let run = run_text(&report.run, config);
    let Some(c) = &report.calibration else {
        let why = report.why.as_deref().unwrap_or("the run gave no result");
        return format!("{run}  no calibration: {why}\n");
    };
    let file = report.calibration_file.as_deref().unwrap_or_default();
    let device = &c.amplifier.device;
    let (amplifier, probe) = (current_text(&c.amplifier), probe_text(&c.probe));
    let chain = chain_text(&c.chain);
    format!("{run}  amplifier     {device} ({amplifier})\n{probe}{chain}  calibration   {file}\n")
}

fn probe_text(probe: &ProbeCalibration) -> String {
    format!(
        "  probe         {}\n                gain {:+.5}, offset {:+.3} um, noise {:.4} um RMS\n",
        probe.device,
        probe.gain,
        Decimal(probe.offset_m * 1e6),
        probe.noise_rms_m * 1e6,
    )
}

fn current_text(amplifier: &AmplifierCalibration) -> String {
    if !amplifier.measures_current {
        return "does not measure its current".into();
    }
    format!(
        "{:.5} A per A commanded, {:+.2} mA at zero",
        amplifier.current_gain,
        Decimal(amplifier.current_offset_a * 1e3)
    )
}

fn chain_text(chain: &ChainCalibration) -> String {
    format!(
        "  compliance    {:+.3} ± {:.3} um/A, by the model {:+.3} um/A\n  linearity     {:.4} % from a straight line, {:.4} % between up and down\n{}",
        Decimal(chain.compliance_m_per_a * 1e6),
        2e6 * chain.compliance_sigma_m_per_a,
        Decimal(chain.model_m_per_a * 1e6),
        chain.nonlinearity_ratio * 1e2,
        chain.hysteresis_ratio * 1e2,
        delay_text(chain)
    )
}

fn delay_text(chain: &ChainCalibration) -> String {
    let Some(delay_s) = chain.delay_s else {
        return String::new();
    };
    format!(
        "  delay         {:.3} ± {:.3} ms from command to reading; if it differs from\n                `bench margins`, set amplifier.latency_s\n",
        Decimal(delay_s * 1e3),
        2e3 * chain.delay_sigma_s.unwrap_or(0.0)
    )
}
