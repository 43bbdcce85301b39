//! What a run would do, before it does it, and the amplitude that suits it.

use std::f64::consts::TAU;
use std::path::Path;

use serde::Serialize;

use super::error::CliError;
use super::outcome::Outcome;
use super::output::{print_json, print_text};
use crate::config::{AmplitudePoint, Config};
use crate::excitation::{CurrentLimit, Extremes, shaped_amplitude};
use crate::experiment::extremes;
use crate::identify::frf_csv;
use crate::model::plant::{self, LoopPlant, ModalModel};

/// Frequencies at which the model is looked at, beside those of its modes: 0.2 % apart over four decades.
const GRID: usize = 4000;
/// An FRF that ends this near to the band's ends is constant beyond.
const NEAR: f64 = 1.1;

/// What a run would do by the model.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Expected {
    pub travel_m: f64,
    pub current_a: f64,
    rms_current_a: f64,
    thermal_current_a: f64,
    slew_a_per_s: f64,
    duration_s: f64,
}

impl Expected {
    pub fn of(extremes: &Extremes) -> Expected {
        Expected {
            travel_m: extremes.travel_m,
            current_a: extremes.current_a,
            rms_current_a: extremes.rms_current_a,
            thermal_current_a: extremes.thermal_a,
            slew_a_per_s: extremes.slew_a_per_s,
            duration_s: extremes.duration_s,
        }
    }
}

/// The JSON object of `bench chirp --plan`.
#[derive(Debug, Serialize)]
struct Report<'a> {
    excitation: String,
    expected: &'a Expected,
    limits: Limits,
    /// Over frequency; none of a binary sequence.
    amplitude: &'a [AmplitudePoint],
}

/// What trips, or what the amplifier cannot follow.
#[derive(Debug, Serialize)]
struct Limits {
    travel_m: f64,
    current_a: f64,
    thermal_current_a: f64,
    slew_a_per_s: f64,
}

/// Prints what a run would do.
pub(super) fn show(config: &Config, expected: &Expected, json: bool) -> Result<Outcome, CliError> {
    let limits = Limits {
        travel_m: config.interlock.soft_limit_m,
        current_a: config
            .amplifier
            .current_limit_a
            .min(config.motor.peak_current_a()),
        thermal_current_a: config.motor.continuous_current_a(),
        slew_a_per_s: config.amplifier.slew_limit_a_per_s,
    };
    let chosen = config.chosen_excitation();
    let amplitude = match chosen.design.has_amplitude_curve() {
        true => config.chirp.amplitude.as_slice(),
        false => &[],
    };
    let report = Report {
        excitation: chosen.describe(),
        expected,
        limits,
        amplitude,
    };
    if json {
        print_json(&report)?;
    } else {
        print_text(&text(&report))?;
    }
    Ok(Outcome::Done)
}

fn text(report: &Report<'_>) -> String {
    let (e, l) = (report.expected, &report.limits);
    let points: String = (report.amplitude.iter())
        .map(|p| {
            format!(
                "  amplitude    {:10.4} Hz {:9.5} A\n",
                p.frequency_hz, p.current_a
            )
        })
        .collect();
    format!(
        "{}; nothing moves\n  duration     {:.1} s\n  travel       {:.1} um of {:.0} um\n  current      {:.3} A of {:.2} A, {:.3} A RMS\n  thermal      {:.3} A of {:.2} A\n  slew         {:.0} A/s of {:.0} A/s\n{points}",
        report.excitation,
        e.duration_s,
        e.travel_m * 1e6,
        l.travel_m * 1e6,
        e.current_a,
        l.current_a,
        e.rms_current_a,
        e.thermal_current_a,
        l.thermal_current_a,
        e.slew_a_per_s,
        l.slew_a_per_s,
    )
}

/// The configuration with an amplitude over frequency that moves the stage alike everywhere, by `source`: `model`, or the
/// CSV of an FRF. A stepped sine takes the model by itself, unless its amplitude is `given`.
pub(super) fn shape(
    mut config: Config,
    source: Option<&str>,
    given: bool,
) -> Result<Config, CliError> {
    let chosen = config.chosen_excitation();
    let automatic = (chosen.design.is_shaped_by_default() && !given).then_some("model");
    let Some(source) = source.or(automatic) else {
        return Ok(config);
    };
    if !chosen.design.has_amplitude_curve() {
        return Err(CliError::Usage(format!(
            "--shape has no meaning for an excitation with one amplitude: set {}, or take another --excitation",
            chosen.design.amplitude_key()
        )));
    }
    let response = match source {
        "model" => by_model(&config)?,
        path => by_file(&config, Path::new(path))?,
    };
    let default_m = config.interlock.soft_limit_m / 3.0;
    let travel_m = config.shape.travel_m.unwrap_or(default_m);
    let limit = CurrentLimit::new(&config.excitation_limits(), config.shape.current_ratio);
    let span = chosen.design.max_span().unwrap_or(f64::INFINITY);
    let is_broadband = chosen.design.is_broadband();
    config.chirp.amplitude = shaped_amplitude(&response, travel_m, limit, span);
    if is_broadband {
        lower_to(&mut config, travel_m)?;
    }
    Ok(config)
}

/// Lowers all amplitudes of a broadband excitation, whose displacements add up, until it moves the stage by `travel_m`.
fn lower_to(config: &mut Config, travel_m: f64) -> Result<(), CliError> {
    let excitation = config.chosen_excitation().build();
    let ratio = (travel_m / extremes(&excitation, config)?.travel_m).min(1.0);
    for point in &mut config.chirp.amplitude {
        point.current_a *= ratio;
    }
    Ok(())
}

/// Frequency in hertz and |G| of the chain of the model over the band.
fn by_model(config: &Config) -> Result<Vec<(f64, f64)>, CliError> {
    let modal = ModalModel::of(&plant::build(&config.plant)?)?;
    let chain = LoopPlant::with_mean_age(config, &modal.modes);
    let (low_hz, high_hz) = config.chirp.band_hz();
    let grid = (0..=GRID).map(|k| low_hz * libm::pow(high_hz / low_hz, k as f64 / GRID as f64));
    let modes = modal.modes.iter().map(|mode| mode.omega_rad_s / (TAU));
    let mut frequencies: Vec<f64> = grid
        .chain(modes.filter(|f| (low_hz..high_hz).contains(f)))
        .collect();
    frequencies.sort_by(f64::total_cmp);
    frequencies.dedup();
    Ok(frequencies
        .into_iter()
        .map(|f| (f, chain.response(TAU * f).norm()))
        .collect())
}

/// The same of an FRF that was measured before.
fn by_file(config: &Config, path: &Path) -> Result<Vec<(f64, f64)>, CliError> {
    let frf = frf_csv::read(path).map_err(|e| {
        CliError::Usage(format!("--shape {}: {e}; or give `model`", path.display()))
    })?;
    let (low_hz, high_hz) = config.chirp.band_hz();
    let rows = frf
        .frequency_hz
        .iter()
        .zip(&frf.response)
        .map(|(f, h)| (*f, h.norm()));
    let inside: Vec<(f64, f64)> = rows
        .filter(|(f, _)| (low_hz..=high_hz).contains(f))
        .collect();
    match (inside.first(), inside.last()) {
        (Some((first, _)), Some((last, _)))
            if *first <= low_hz * NEAR && *last * NEAR >= high_hz && inside.len() > 1 =>
        {
            Ok(inside)
        }
        _ => Err(CliError::Usage(format!(
            "--shape {}: it does not cover the band from {low_hz} to {high_hz} Hz; narrow the band with --start and --stop, or take `model`",
            path.display()
        ))),
    }
}
