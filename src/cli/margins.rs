//! `bench margins`: how far a loop is from trouble.

use serde::Serialize;

use super::controller_choice::ControllerChoice;
use super::error::CliError;
use super::options::BenchOptions;
use super::outcome::Outcome;
use super::output::{print_json, print_text};
use super::table::wrap;
use crate::config::{Config, Purpose};
use crate::control::{ClosedLoop, ControllerText, Margins};
use crate::model::plant::{self, LoopPlant, ModalModel};
use crate::report::number::angular_frequency;

/// Which loop.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    choice: ControllerChoice,
    /// Leave out sampling, delay and amplifier
    #[arg(long)]
    continuous: bool,
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    margins: &'a Margins,
    /// From a command to the position that its reading shows, in the mean, without hold and lag.
    delay_s: f64,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let config = args.bench.load(Purpose::Model, &args.choice.settings())?;
    let closed_loop = closed_loop(&config)?;
    let margins = match args.continuous {
        true => closed_loop.continuous_margins()?,
        false => closed_loop.margins(),
    };
    if args.bench.json {
        let delay_s = if args.continuous {
            0.0
        } else {
            closed_loop.plant().delay_s()
        };
        print_json(&Report {
            margins: &margins,
            delay_s,
        })?
    } else {
        print_text(&text(&config, &margins))?
    }
    Ok(Outcome::Done)
}

/// The loop of a configuration around the model of its plant.
pub(super) fn closed_loop(config: &Config) -> Result<ClosedLoop, CliError> {
    let text = ControllerText::find(&config.control.controller)?;
    let design = text.design(config.servo.rate_hz)?;
    let modes = ModalModel::of(&plant::build(&config.plant)?)?.modes;
    let plant = LoopPlant::new(config, &modes);
    let force_constant_n_per_a = config.motor.force_constant_n_per_a;
    Ok(ClosedLoop::new(
        plant,
        modes,
        force_constant_n_per_a,
        design,
    )?)
}

/// Refuses a loop with less than the configured modulus margin.
pub(super) fn require_modulus_margin(config: &Config, margins: &Margins) -> Result<(), CliError> {
    let least = config.control.min_modulus_margin;
    let (name, rate_hz) = (&config.control.controller, config.servo.rate_hz);
    if least > 0.0 && !margins.stable {
        return Err(CliError::Margin(format!(
            "with the {name} controller at {rate_hz} Hz the closed loop is unstable and has no modulus margin, at least {least} is asked for (control.min_modulus_margin)"
        )));
    }
    if margins.modulus_margin < least {
        let margin = margins.modulus_margin;
        return Err(CliError::Margin(format!(
            "with the {name} controller at {rate_hz} Hz the modulus margin is {margin:.3}, at least {least} is asked for (control.min_modulus_margin)"
        )));
    }
    Ok(())
}

/// Rates and delays of the chain in words.
fn chain_text(config: &Config) -> String {
    let (amplifier, probe) = (&config.amplifier, &config.probe);
    let mut text = format!(
        "{} Hz, hold, {} period(s) of computing delay, amplifier of {} Hz",
        config.servo.rate_hz, config.servo.computing_delay_periods, amplifier.bandwidth_hz
    );
    if amplifier.latency_s > 0.0 {
        text += &format!(" that acts {:.2} ms late", amplifier.latency_s * 1e3);
    }
    let age_ms = probe.age_at_arrival_s() * 1e3;
    match probe.rate_hz {
        Some(rate_hz) => {
            text += &format!(", {rate_hz} readings a second, {age_ms:.2} ms old on arrival, held")
        }
        None if age_ms > 0.0 => text += &format!(", readings {age_ms:.2} ms old"),
        None => {}
    }
    text
}

fn or_none(omega_rad_s: Option<f64>) -> String {
    omega_rad_s.map_or_else(|| "none".into(), angular_frequency)
}

/// Margins in words.
pub(super) fn text(config: &Config, margins: &Margins) -> String {
    let or =
        |value: Option<f64>, unit: &str| value.map_or("none".into(), |v| format!("{v:.2} {unit}"));
    let time = match margins.continuous {
        true => "continuous time, without delay and amplifier".to_string(),
        false => chain_text(config),
    };
    format!(
        "{}  {}\n  crossover              {}\n  phase margin           {}\n  gain margin            {}\n  modulus margin         {:.4} (peak of S {:.2} dB)\n  sensitivity bandwidth  {}\n",
        wrap(
            &format!("{} controller, {time}", config.control.controller),
            0
        ),
        if margins.stable {
            "stable"
        } else {
            "UNSTABLE: the closed loop has poles outside the stable region; the margins below mean nothing"
        },
        or_none(margins.crossover_rad_s),
        or(margins.phase_margin_deg, "deg"),
        or(margins.gain_margin_db, "dB"),
        margins.modulus_margin,
        margins.sensitivity_peak_db,
        or_none(margins.sensitivity_bandwidth_rad_s),
    )
}
