//! `bench margins`: how far a loop is from trouble.

use super::choice::Choice;
use super::options::{BenchOptions, print_json, print_text};
use super::{CliError, Outcome};
use crate::config::{Config, Purpose};
use crate::control::{ClosedLoop, ControllerText, Margins};
use crate::plant::{self, Modal};

/// Which loop.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    choice: Choice,
    /// Leave out sampling, delay and amplifier
    #[arg(long)]
    continuous: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let config = args.bench.load(Purpose::Model, &args.choice.sets())?;
    let margins = closed_loop(&config)?.margins(args.continuous);
    if args.bench.json {
        print_json(&margins)?
    } else {
        print_text(&text(&config, &margins))?
    }
    Ok(Outcome::Done)
}

/// The loop of a configuration around the model of its plant.
pub(super) fn closed_loop(config: &Config) -> Result<ClosedLoop, CliError> {
    let sections = ControllerText::find(&config.control.controller)?.sections(config.servo.rate_hz)?;
    let modal = Modal::of(&plant::build(&config.plant)?)?;
    Ok(ClosedLoop::new(config, modal.modes, sections))
}

/// Margins in words.
pub(super) fn text(config: &Config, margins: &Margins) -> String {
    let or = |value: Option<f64>, unit: &str| value.map_or("none".into(), |v| format!("{v:.2} {unit}"));
    let time = match margins.continuous {
        true => "continuous time, without delay and amplifier".to_string(),
        false => format!(
            "{} Hz, hold, {} period(s) of computing delay, amplifier of {} Hz",
            config.servo.rate_hz, config.servo.computing_delay_periods, config.amplifier.bandwidth_hz
        ),
    };
    format!(
        "{} controller, {time}\n  {}\n  crossover              {}\n  phase margin           {}\n  gain margin            {}\n  modulus margin         {:.4} (peak of S {:.2} dB)\n  sensitivity bandwidth  {}\n",
        config.control.controller,
        if margins.stable {
            "stable"
        } else {
            "UNSTABLE: the closed loop has poles outside the stable region; the margins below mean nothing"
        },
        or(margins.crossover_rad_s, "rad/s"),
        or(margins.phase_margin_deg, "deg"),
        or(margins.gain_margin_db, "dB"),
        margins.modulus_margin,
        margins.sensitivity_peak_db,
        or(margins.sensitivity_bandwidth_rad_s, "rad/s"),
    )
}
