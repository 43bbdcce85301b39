//! `bench margins`: the stability margins of a loop.

use std::path::PathBuf;

use serde::Serialize;
use serde_json::Value;

use super::error::CliError;
use super::exit::Exit;
use super::figure_options::PictureOptions;
use super::measured_margins::{self, Measured};
use super::output::{no_json, print_result, warn};
use super::table::{figure_lines, table, wrap};
use bench_base::decimal::Decimal;
use bench_config::{Config, ProbeSettings, Purpose};
use bench_control::{ClosedLoop, Margins, Pole, listed_poles};
use bench_experiment::{LoopModel, Stage, check_calibration, closed_loop};
use bench_external::frf::PhaseUnit;
use bench_order::{BenchOptions, ControllerChoice, GLOSSARY};
use bench_report::figures::{self, Figure};
use bench_report::{LoopPlot, Picture, ReportError, joined, loop_svg, plant_conditions};

/// The bench and the controller.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = GLOSSARY)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    choice: ControllerChoice,
    /// Neglect zero-order hold, computing delay and amplifier dynamics, as in the thesis
    #[arg(long, conflicts_with = "frf")]
    continuous: bool,
    /// Also compute the margins with a measured plant instead of the model, with 95 % confidence intervals: the FRF of
    /// `bench chirp` (..._frf.csv) or its recording (MCAP), or a table of another program with frequency, magnitude and
    /// phase, or real and imaginary part, in m/A; exit code 1 if this loop is not stable. Outside of the measured band the
    /// model is used
    #[arg(long, value_name = "FILE|RECORDING")]
    frf: Option<PathBuf>,
    /// With --frf: unit of the phases of a table [default: that in the name of the column, otherwise by the numbers]
    #[arg(long, value_name = "UNIT", requires = "frf", value_enum)]
    frf_phase: Option<PhaseUnit>,
    /// With --frf: folder for L, S, T, C S and P S as CSV and for Bode plot, Nyquist plot and sensitivities as SVG
    #[arg(long, value_name = "FOLDER", requires = "frf")]
    out: Option<PathBuf>,
    #[command(flatten)]
    picture: PictureOptions,
}

/// The JSON object of the command. An unstable loop has no margins: they are `null`.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    margins: Value,
    /// Poles of the closed loop below half the sampling rate, and all unstable ones.
    poles: Vec<Pole>,
    /// Mean delay from a command to the position that its reading shows, without hold and amplifier lag.
    delay_s: f64,
    /// The margins as shown; empty for an unstable loop.
    figures: Vec<Figure>,
    /// The margins with the measured plant.
    #[serde(skip_serializing_if = "Option::is_none")]
    measured: Option<Measured>,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let config = args.bench.load(Purpose::Model, &args.choice.settings())?;
    warn(&check_calibration(&config, Stage::of(&config))?);
    let closed_loop = closed_loop(&config)?;
    let (margins, poles) = if args.continuous {
        (
            closed_loop.continuous_margins()?,
            closed_loop.continuous_poles(),
        )
    } else {
        (closed_loop.margins(), closed_loop.poles())
    };
    args.picture
        .write(|| drawn(args, &config, &closed_loop, &margins))?;
    let frf = args.frf.as_deref();
    let measured = frf
        .map(|frf| {
            measured_margins::measured(
                frf,
                args.frf_phase,
                args.out.as_deref(),
                &closed_loop,
                &config,
            )
        })
        .transpose()?;
    let is_stable = measured
        .as_ref()
        .map_or(margins.stable, Measured::is_stable);
    let report = Report {
        margins: margins_json(&margins)?,
        figures: model_figures(&margins),
        poles: listed_poles(&poles, config.servo.rate_hz),
        delay_s: if args.continuous {
            0.0
        } else {
            closed_loop.plant().delay_s()
        },
        measured,
    };
    print_result(args.bench.json, &report, |report| {
        let measured = report.measured.as_ref().map(measured_margins::text);
        text(&config, &margins, &report.poles)
            + &measured.unwrap_or_default()
            + &args.picture.files_text()
    })?;
    Ok(if is_stable { Exit::Done } else { Exit::Failed })
}

/// The loop of the model: Bode plot, Nyquist plot and sensitivities.
fn drawn(
    args: &Args,
    config: &Config,
    closed_loop: &ClosedLoop,
    margins: &Margins,
) -> Result<Picture, ReportError> {
    let model = if args.continuous {
        LoopModel::continuous(closed_loop, config, margins.clone())
    } else {
        LoopModel::of(closed_loop, config)
    };
    let time = time_text(config, margins);
    let title = format!("{}: {} controller", config.title, config.control.controller);
    let subtitle = joined(&[&plant_conditions(&config.plant, &[]), &time]);
    Ok(Picture {
        svg: loop_svg(&LoopPlot::from(&model), &title, &subtitle)?,
        caption: "L = P C by the model with its margins, as Bode plot and in the complex plane with -1; S from reference to error and T from reference to displacement.".into(),
        title,
    })
}

fn model_figures(model: &Margins) -> Vec<Figure> {
    if model.stable {
        figures::margins(model)
    } else {
        Vec::new()
    }
}

/// The margins with their names; `null` where the loop is unstable.
fn margins_json(margins: &Margins) -> Result<Value, CliError> {
    let mut json = serde_json::to_value(margins).map_err(|e| no_json(&e))?;
    if let (false, Some(object)) = (margins.stable, json.as_object_mut()) {
        let figures = object.iter_mut().filter(|(_, value)| value.is_number());
        figures.for_each(|(_, value)| *value = Value::Null);
    }
    Ok(json)
}

/// A row of the table of unstable poles.
fn pole_row(pole: &Pole) -> Vec<String> {
    let re = Decimal(pole.re_rad_s);
    let s = match pole.im_rad_s {
        0.0 => format!("{re:+.3}"),
        im => format!("{re:+.3} +- {im:.3}j"),
    };
    let (hz, damping) = (pole.frequency_hz, Decimal(pole.damping_ratio));
    vec![s, format!("{hz:.3}"), format!("{damping:+.4}")]
}

/// Rates and delays of the signal path as text.
fn chain_text(config: &Config) -> String {
    let (servo, amplifier) = (&config.servo, &config.amplifier);
    let latency = if amplifier.latency_s > 0.0 {
        format!(" and {:.2} ms latency", amplifier.latency_s * 1e3)
    } else {
        String::new()
    };
    format!(
        "sampling at {} Hz, zero-order hold, {} of computing delay, amplifier bandwidth {} Hz{latency}{}",
        servo.rate_hz,
        periods_text(servo.computing_delay_periods),
        amplifier.bandwidth_hz,
        probe_text(&config.probe)
    )
}

fn periods_text(count: u32) -> String {
    match count {
        1 => "1 period".into(),
        count => format!("{count} periods"),
    }
}

fn probe_text(probe: &ProbeSettings) -> String {
    let age_ms = probe.age_at_arrival_s() * 1e3;
    match probe.rate_hz {
        Some(rate_hz) => {
            format!(", {rate_hz} readings a second, {age_ms:.2} ms old on arrival, held")
        }
        None if age_ms > 0.0 => format!(", readings {age_ms:.2} ms old"),
        None => String::new(),
    }
}

/// The loop and its margins; of an unstable one the unstable poles.
pub(super) fn text(config: &Config, margins: &Margins, poles: &[Pole]) -> String {
    let time = time_text(config, margins);
    let title = format!("{} controller, {time}", config.control.controller);
    let rest = if margins.stable {
        format!("  stable\n{}", figure_lines(&figures::margins(margins)))
    } else {
        unstable_text(poles)
    };
    wrap(&title, 0) + &rest
}

fn time_text(config: &Config, margins: &Margins) -> String {
    if margins.continuous {
        "continuous time, without delay and amplifier".to_string()
    } else {
        chain_text(config)
    }
}

fn unstable_text(poles: &[Pole]) -> String {
    let unstable = poles.iter().filter(|pole| !pole.stable);
    let rows: Vec<Vec<String>> = unstable.map(pole_row).collect();
    if rows.is_empty() {
        let text = "UNSTABLE: the Nyquist curve encircles -1, and so the closed loop has no margins; lower the gain of the controller, or adapt its delays to those of the loop";
        return wrap(text, 2);
    }
    let header = ["unstable pole rad/s", "Hz", "damping"];
    let text = "UNSTABLE: the closed loop has poles in the right half plane, and so no margins";
    wrap(text, 2) + &table(&header, &rows)
}
