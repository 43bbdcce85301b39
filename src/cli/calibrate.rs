//! `bench calibrate`: scale, sign and offset of amplifier and probe, and the chain's delay.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::Serialize;

use super::error::CliError;
use super::options::BenchOptions;
use super::outcome::Outcome;
use super::output::{print_json, print_text};
use super::run_options::{RunOptions, RunReport, finish};
use crate::config::{Config, ExcitationKind, Purpose};
use crate::excitation::{self, Extremes, Staircase};
use crate::experiment::calibration::{Fit, fit};
use crate::experiment::{Plan, abandon_on_signal, analyse};
use crate::model::plant::{self, DiscretePlant, ModalModel, PlantError};
use crate::recording::Recording;
use crate::rig::calibration::{
    AmplifierCalibration, Calibration, ChainCalibration, ProbeCalibration,
};
use crate::rig::simulated;

/// Which bench, and where the result goes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    run: RunOptions,
    /// Largest current in amperes, to both sides
    #[arg(long, value_name = "A", allow_hyphen_values = true)]
    amplitude: Option<f64>,
    /// The calibration's file [default: beside the recording, under its name]
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Leave out the chirp that the delay is measured by
    #[arg(long)]
    no_delay: bool,
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    run: RunReport,
    delay_recording: Option<String>,
    calibration_file: Option<String>,
    calibration: Option<Calibration>,
    /// Why there is no calibration.
    why: Option<String>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let amplitude = args
        .amplitude
        .map(|a| format!("calibrate.amplitude_a={}", toml::Value::from(a)));
    let mut config = args.bench.load(Purpose::Chirp, amplitude.as_slice())?;
    config.calibration.file = None;
    shorten(&mut config);
    check(&config)?;
    let steps = steps(args, &config)?;
    let report = report(args, &config, steps)?;
    if args.bench.json {
        print_json(&report)?
    } else {
        print_text(&text(&report, &config))?
    }
    Ok(if report.calibration.is_some() {
        report.run.exit()
    } else {
        Outcome::Failed
    })
}

/// The delay's chirp is that of `[chirp]`, faster, once, whatever else is used otherwise.
fn shorten(config: &mut Config) {
    config.excitation.kind = ExcitationKind::Chirp;
    config.chirp.repetitions = 1;
    let chirp = &mut config.chirp;
    let share = config.calibrate.chirp_duration_s / chirp.duration_s;
    chirp.duration_s = config.calibrate.chirp_duration_s;
    (chirp.fade_in_s, chirp.fade_out_s) = (chirp.fade_in_s * share, chirp.fade_out_s * share);
}

/// Refuses steps, or a chirp, that would trip an interlock by the model of the whole rig.
fn check(config: &Config) -> Result<(), CliError> {
    compliance_m_per_a(config)?;
    let (period_s, force_constant) = (config.servo.period_s(), config.motor.force_constant_n_per_a);
    let rig = DiscretePlant::new(
        &simulated::modes(config)?,
        config.amplifier.bandwidth_hz,
        force_constant,
        period_s,
    );
    let extremes = Extremes::of(&Staircase::new(&config.calibrate, period_s), config, &rig);
    let refuse = |found: f64, limit: f64, unit: &str, what: &str| {
        (found > limit).then(|| {
            CliError::Usage(format!(
                "the steps would reach {found:.3e} {unit}, {what} is {limit:.3e} {unit}; lower calibrate.amplitude_a"
            ))
        })
    };
    let limit_a = config
        .amplifier
        .current_limit_a
        .min(config.motor.peak_current_a());
    let cases = [
        refuse(
            config.calibrate.amplitude_a,
            limit_a,
            "A",
            "the limit of amplifier and motor",
        ),
        refuse(
            extremes.travel_m,
            config.interlock.soft_limit_m,
            "m",
            "the soft limit",
        ),
        refuse(
            extremes.thermal_a,
            config.motor.continuous_current_a(),
            "A",
            "the continuous current",
        ),
    ];
    match cases.into_iter().flatten().next() {
        Some(refused) => Err(refused),
        None => Ok(excitation::check(&excitation::of(config), config, &rig).map(drop)?),
    }
}

/// What the run of the staircase gave.
struct Steps {
    run: RunReport,
    devices: Vec<(String, String)>,
    fit: Result<Fit, String>,
}

fn steps(args: &Args, config: &Config) -> Result<Steps, CliError> {
    let plan = Plan::calibrate(config.clone());
    let mut run = args.run.run(&plan, "static steps")?;
    let totals = run.totals()?;
    let report = RunReport::new(&run, &totals);
    let recording = Recording::open(&run.path)?;
    let fit = match report.outcome {
        "completed" => fit(&recording, config).map_err(|error| error.to_string()),
        outcome => Err(format!("the run of the static steps {outcome}")),
    };
    let devices = recording
        .metadata()
        .iter()
        .map(|(key, value)| (key.clone(), value.clone()))
        .collect();
    finish(run, &report)?;
    Ok(Steps {
        run: report,
        devices,
        fit,
    })
}

fn report(args: &Args, config: &Config, steps: Steps) -> Result<Report, CliError> {
    let mut report = Report {
        run: steps.run,
        delay_recording: None,
        calibration_file: None,
        calibration: None,
        why: None,
    };
    let fit = match steps.fit {
        Ok(fit) => fit,
        Err(why) => {
            return Ok(Report {
                why: Some(why),
                ..report
            });
        }
    };
    let mut calibration = calibration(config, &fit, &steps.devices, &report.run.recording)?;
    if !args.no_delay {
        report.delay_recording = Some(measure_delay(args, config, &mut calibration)?);
    }
    let beside = Path::new(&report.run.recording).with_extension("calibration.toml");
    let path = args.write.clone().unwrap_or(beside);
    calibration.write_new(&path).map_err(|e| {
        CliError::Failed(format!(
            "cannot write {}: {e}; name another file with --write",
            path.display()
        ))
    })?;
    report.calibration_file = Some(path.display().to_string());
    report.calibration = Some(calibration);
    Ok(report)
}

fn calibration(
    config: &Config,
    fit: &Fit,
    devices: &[(String, String)],
    recording: &str,
) -> Result<Calibration, CliError> {
    let model_m_per_a = compliance_m_per_a(config)?;
    let gain = fit.probe_gain(config.calibrate.scale_by, model_m_per_a);
    let (current_gain, current_offset_a) = fit.current.unwrap_or((1.0, 0.0));
    let device = |key: &str| {
        devices
            .iter()
            .find(|(k, _)| k == key)
            .map_or(String::new(), |(_, value)| value.clone())
    };
    Ok(Calibration {
        made: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
        recording: recording.to_string(),
        amplifier: AmplifierCalibration {
            device: device("amplifier"),
            current_gain,
            current_offset_a,
            measures_current: fit.current.is_some(),
        },
        probe: ProbeCalibration {
            device: device("probe"),
            gain,
            offset_m: -gain * fit.rest_m,
            noise_rms_m: fit.noise_rms_m,
        },
        chain: ChainCalibration {
            compliance_m_per_a: fit.compliance_m_per_a,
            compliance_sigma_m_per_a: fit.compliance_sigma_m_per_a,
            model_m_per_a,
            nonlinearity_ratio: fit.nonlinearity_ratio,
            hysteresis_ratio: fit.hysteresis_ratio,
            delay_s: None,
            delay_sigma_s: None,
        },
    })
}

/// A chirp with what is known by now in effect, the sign above all; returns its recording.
fn measure_delay(
    args: &Args,
    config: &Config,
    calibration: &mut Calibration,
) -> Result<String, CliError> {
    let plan = Plan::chirp(config.clone());
    let mut run =
        args.run
            .run_with_calibration(&plan, "chirp for the delay", Some(calibration.clone()))?;
    let totals = run.totals()?;
    let report = RunReport::new(&run, &totals);
    if report.outcome == "completed" {
        let (path, config) = (run.path.clone(), config.clone());
        let analysed = abandon_on_signal(move || -> Result<_, CliError> {
            Ok(analyse(&Recording::open(&path)?, &config)?)
        });
        let analysed = analysed
            .map_err(|error| CliError::Failed(error.to_string()))?
            .transpose()?;
        let delay = analysed.and_then(|analysis| Some((analysis.delay_s, analysis.beyond?)));
        calibration.chain.delay_s = delay.map(|(delay_s, beyond)| delay_s + beyond.seconds);
        calibration.chain.delay_sigma_s = delay.map(|(_, beyond)| beyond.sigma_s);
    }
    finish(run, &report)?;
    Ok(report.recording)
}

/// The static compliance of the model, from current to displacement.
fn compliance_m_per_a(config: &Config) -> Result<f64, CliError> {
    let modes = ModalModel::of(&plant::build(&config.plant)?)?.modes;
    if modes.iter().any(|mode| mode.omega_rad_s == 0.0) {
        return Err(
            PlantError::FreeBody("a static compliance, which `bench calibrate` measures,").into(),
        );
    }
    let static_m_per_n: f64 = modes
        .iter()
        .map(|mode| mode.residue_per_kg() / (mode.omega_rad_s * mode.omega_rad_s))
        .sum();
    Ok(static_m_per_n * config.motor.force_constant_n_per_a)
}

fn text(report: &Report, config: &Config) -> String {
    let run = report.run.text(config);
    let Some(c) = &report.calibration else {
        return format!(
            "{run}  no calibration: {}\n",
            report.why.as_deref().unwrap_or("the run gave none")
        );
    };
    let current = match c.amplifier.measures_current {
        true => format!(
            "{:.5} A flow per A, {:+.2} mA at zero",
            c.amplifier.current_gain,
            c.amplifier.current_offset_a * 1e3
        ),
        false => "does not say which current flows".to_string(),
    };
    let chain = &c.chain;
    let delay = chain.delay_s.map_or(String::new(), |delay_s| {
        format!(
            "  delay         {:.3} +- {:.3} ms from command to reading; if it differs from what `bench margins` says, put it into amplifier.latency_s\n",
            delay_s * 1e3,
            2e3 * chain.delay_sigma_s.unwrap_or(0.0)
        )
    });
    format!(
        "{run}  amplifier     {} ({current})\n  probe         {} (gain {:+.5}, offset {:+.3} um, noise {:.4} um RMS)\n  compliance    {:+.3} +- {:.3} um/A, by the model {:+.3} um/A\n  straightness  {:.4} % off a line, {:.4} % between up and down\n{delay}  calibration   {}\n",
        c.amplifier.device,
        c.probe.device,
        c.probe.gain,
        c.probe.offset_m * 1e6,
        c.probe.noise_rms_m * 1e6,
        chain.compliance_m_per_a * 1e6,
        2e6 * chain.compliance_sigma_m_per_a,
        chain.model_m_per_a * 1e6,
        chain.nonlinearity_ratio * 1e2,
        chain.hysteresis_ratio * 1e2,
        report.calibration_file.as_deref().unwrap_or("")
    )
}
