//! Plans the amplitude of an excitation over frequency, so that the stage moves by the same displacement at all frequencies.

use std::convert::Infallible;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::prediction::extremes;
use crate::errors::ExperimentError;
use bench_base::units::{hz, rad_s};
use bench_config::Config;
use bench_excitation::{ChosenExcitation, CurrentLimit, shaped_amplitude};
use bench_identify::frf_csv;
use bench_plant::{LoopPlant, ModalModel};

/// Frequencies at which the model is evaluated, beside those of its modes: 0.2 % apart over four decades.
const GRID: usize = 4000;
/// An FRF must reach the ends of the band up to this ratio. It is constant beyond its own ends.
const END_RATIO: f64 = 1.1;

/// A shaped sweep may move the stage by this part of the permitted travel.
const SWEEP_RATIO: f64 = 2.0 / 3.0;

/// Frequency in hertz and |G| in metres per ampere, by rising frequency.
type Gain = Vec<(f64, f64)>;

/// The source of the response of the stage. Its text is `model` or the path of a CSV file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ResponseSource {
    /// The model of the plant.
    Model,
    /// The CSV file of an FRF that was measured before.
    Frf(PathBuf),
}

impl FromStr for ResponseSource {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<ResponseSource, Infallible> {
        Ok(match text {
            "model" => ResponseSource::Model,
            path => ResponseSource::Frf(path.into()),
        })
    }
}

impl fmt::Display for ResponseSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ResponseSource::Model => f.write_str("model"),
            ResponseSource::Frf(path) => path.display().fmt(f),
        }
    }
}

/// Why no amplitude can be planned.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AmplitudePlanError {
    /// The excitation has the same amplitude at all frequencies, which the source does not plan.
    #[error(
        "the excitation has the same amplitude at all frequencies, which --shape does not plan from this source; set {0}, or choose another kind of excitation"
    )]
    OneAmplitude(&'static str),
    /// The FRF cannot be read.
    #[error("{0}, or use --shape model")]
    Frf(String),
    /// The FRF is measured over a part of the band only.
    #[error(
        "it does not cover the band from {low_hz} to {high_hz} Hz; narrow the band with --start and --stop, or use --shape model"
    )]
    Band {
        /// Lowest frequency of the excitation.
        low_hz: f64,
        /// Highest frequency of the excitation.
        high_hz: f64,
    },
    /// The model cannot be analysed.
    #[error(transparent)]
    Model(#[from] ExperimentError),
}

/// Plans the amplitude from the model if the excitation requires it, as a stepped sine does.
///
/// # Errors
/// If the model cannot be analysed.
pub fn default_amplitude(config: Config) -> Result<Config, AmplitudePlanError> {
    if chosen(&config)?.design.is_shaped_by_default() {
        shape_amplitude(config, &ResponseSource::Model)
    } else {
        Ok(config)
    }
}

/// Plans an amplitude over frequency that moves the stage by `shape.travel_m` at all frequencies, as far as the current
/// suffices. An excitation that has one amplitude moves it by at most as much, by the model.
///
/// A sweep that passes a mode quickly moves the stage further than a steady sine. All amplitudes are then lowered until it stays within
/// two thirds of the permitted travel, or within `shape.travel_m` if that is more.
///
/// # Errors
/// If the excitation has one amplitude only and the source is a measured response, or the response cannot be read or computed over the
/// whole band.
pub fn shape_amplitude(
    mut config: Config,
    source: &ResponseSource,
) -> Result<Config, AmplitudePlanError> {
    let design = chosen(&config)?.design;
    if !design.has_amplitude_curve() {
        return shape_one_amplitude(config, source);
    }
    let span = design.max_span().unwrap_or(f64::INFINITY);
    let is_broadband = design.is_broadband();
    let gain = match source {
        ResponseSource::Model => gain_of_model(&config)?,
        ResponseSource::Frf(path) => gain_of_frf(&config, path)?,
    };
    let travel_m = shape_travel_m(&config);
    let limit = CurrentLimit::new(&config.excitation_limits(), config.shape.current_ratio);
    config.chirp.amplitude = shaped_amplitude(&gain, travel_m, limit, span);
    let most_m = if is_broadband {
        travel_m
    } else {
        travel_m.max(SWEEP_RATIO * config.permitted_travel_m())
    };
    limit_travel(&mut config, most_m)?;
    Ok(config)
}

/// The largest amplitude at all frequencies that moves the stage by at most `shape.travel_m` in the model, within the limits of the
/// current.
fn shape_one_amplitude(
    mut config: Config,
    source: &ResponseSource,
) -> Result<Config, AmplitudePlanError> {
    let kind = config.excitation.kind;
    let key = chosen(&config)?.design.amplitude_key();
    let refused = AmplitudePlanError::OneAmplitude(key);
    let (limits, ratio) = (config.excitation_limits(), config.shape.current_ratio);
    let travel_m = shape_travel_m(&config);
    match (source, config.excitations.one_amplitude_a(kind)) {
        (ResponseSource::Model, Some(amplitude_a)) => *amplitude_a = 1.0,
        _ => return Err(refused),
    }
    let per_ampere = extremes(&chosen(&config)?.build(), &config)?;
    let largest_a = [
        travel_m / per_ampere.travel_m,
        ratio * limits.peak_current_a.min(limits.amplifier_current_a) / per_ampere.current_a,
        ratio * limits.continuous_current_a / per_ampere.thermal_current_a,
        ratio * limits.slew_a_per_s / per_ampere.slew_a_per_s,
    ];
    if let Some(amplitude_a) = config.excitations.one_amplitude_a(kind) {
        *amplitude_a = largest_a.into_iter().fold(f64::INFINITY, f64::min);
    }
    Ok(config)
}

fn chosen(config: &Config) -> Result<ChosenExcitation<'_>, ExperimentError> {
    Ok(config.chosen_excitation()?)
}

/// The permitted travel of a shaped excitation in metres: `shape.travel_m`, or a third of the soft limit.
pub(crate) fn shape_travel_m(config: &Config) -> f64 {
    let default_m = config.interlock.soft_limit_m / 3.0;
    config.shape.travel_m.unwrap_or(default_m)
}

/// Lowers all amplitudes of an excitation until it moves the stage by at most `travel_m`, by the model.
pub(crate) fn limit_travel(config: &mut Config, travel_m: f64) -> Result<(), ExperimentError> {
    let excitation = chosen(config)?.build();
    let ratio = (travel_m / extremes(&excitation, config)?.travel_m).min(1.0);
    for point in &mut config.chirp.amplitude {
        point.current_a *= ratio;
    }
    Ok(())
}

/// The gain of the chain by the model over the band.
fn gain_of_model(config: &Config) -> Result<Gain, ExperimentError> {
    let modal = ModalModel::of(&bench_plant::build(&config.plant)?)?;
    let chain = LoopPlant::with_mean_age(config, &modal.modes);
    let frequencies = grid_hz(config.chirp.band_hz(), &modal);
    let gain = |f: f64| (f, chain.response(rad_s(f)).norm());
    Ok(frequencies.into_iter().map(gain).collect())
}

/// Frequencies at equal ratios over the band, and those of the modes within.
fn grid_hz((low_hz, high_hz): (f64, f64), modal: &ModalModel) -> Vec<f64> {
    let grid = (0..=GRID).map(|k| low_hz * libm::pow(high_hz / low_hz, k as f64 / GRID as f64));
    let modes = modal.modes.iter().map(|mode| hz(mode.omega_rad_s));
    let modes = modes.filter(|f| (low_hz..high_hz).contains(f));
    let mut frequencies: Vec<f64> = grid.chain(modes).collect();
    frequencies.sort_by(f64::total_cmp);
    frequencies.dedup();
    frequencies
}

/// The measured gain over the band.
fn gain_of_frf(config: &Config, path: &Path) -> Result<Gain, AmplitudePlanError> {
    let frf = frf_csv::read(path).map_err(|e| AmplitudePlanError::Frf(e.to_string()))?;
    let (low_hz, high_hz) = config.chirp.band_hz();
    let rows = frf.frequency_hz.iter().zip(&frf.response);
    let inside = rows.filter(|(f, _)| (low_hz..=high_hz).contains(*f));
    let gain: Gain = inside.map(|(f, h)| (*f, h.norm())).collect();
    match gain[..] {
        [(first, _), .., (last, _)]
            if first <= low_hz * END_RATIO && last * END_RATIO >= high_hz =>
        {
            Ok(gain)
        }
        _ => Err(AmplitudePlanError::Band { low_hz, high_hz }),
    }
}
