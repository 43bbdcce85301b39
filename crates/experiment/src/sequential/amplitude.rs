//! Amplitudes of the shots: the largest that keep a third of the travel (`shape.travel_m`) and a part of the current
//! (`shape.current_ratio`).

use super::shot::Shot;
use crate::errors::ExperimentError;
use crate::forecast::{extremes, limit_travel, shape_travel_m};
use bench_base::units::hz;
use bench_config::Config;
use bench_excitation::{AmplitudePoint, CurrentLimit, shaped_amplitude};
use bench_identify::modal::{MeasurementChain, ModalFit};

/// Frequencies at which the response of a fit is evaluated, beside those of its modes.
const GRID: usize = 400;

/// The configuration of the first shot: the configured amplitude over frequency, times the factor with which the model reaches the
/// permitted travel or current.
///
/// # Errors
/// When the model cannot be analysed.
pub(super) fn first_config(base: &Config, shot: &Shot) -> Result<Config, ExperimentError> {
    let mut config = shot.config(base, base.chirp.amplitude.clone());
    let travel_m = shape_travel_m(base);
    let limit = current_limit(base);
    let predicted = extremes(&config.chosen_excitation()?.build(), &config)?;
    let factor = travel_m / predicted.travel_m;
    for point in &mut config.chirp.amplitude {
        let limit_a = limit.at_a(point.frequency_hz);
        point.current_a = (factor * point.current_a).min(limit_a);
    }
    limit_travel(&mut config, travel_m)?;
    Ok(config)
}

/// The configuration of a later shot: the same displacement at all frequencies by the fit of the shots before.
///
/// # Errors
/// When the model cannot be analysed.
pub(super) fn next_config(
    base: &Config,
    shot: &Shot,
    amplitude: Vec<AmplitudePoint>,
) -> Result<Config, ExperimentError> {
    let mut config = shot.config(base, amplitude);
    limit_travel(&mut config, shape_travel_m(base))?;
    Ok(config)
}

/// The amplitude over frequency that moves the stage of a fit by the permitted travel, as far as the permitted current suffices.
pub(super) fn amplitude_of_fit(
    base: &Config,
    band: &Shot,
    chain: &MeasurementChain,
    fit: &ModalFit,
) -> Vec<AmplitudePoint> {
    let step = band.log_width() / GRID as f64;
    let grid = (0..=GRID).map(|k| band.low_hz * libm::exp(k as f64 * step));
    let modes = fit.parameters.modes.iter().map(|mode| hz(mode.omega_rad_s));
    let modes = modes.filter(|hz| (band.low_hz..band.high_hz).contains(hz));
    let mut frequency_hz: Vec<f64> = grid.chain(modes).collect();
    frequency_hz.sort_by(f64::total_cmp);
    frequency_hz.dedup();
    let response = fit.response(chain, &frequency_hz);
    let gain: Vec<(f64, f64)> = frequency_hz
        .into_iter()
        .zip(response.iter().map(|h| h.norm()))
        .collect();
    shaped_amplitude(
        &gain,
        shape_travel_m(base),
        current_limit(base),
        f64::INFINITY,
    )
}

fn current_limit(config: &Config) -> CurrentLimit {
    CurrentLimit::new(&config.excitation_limits(), config.shape.current_ratio)
}
