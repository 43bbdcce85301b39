//! Whether a measured response belongs to the bench of a configuration: rate, unit, conventions and delay.

use super::conventions::check_conventions;
use super::measured_frf::{FrfError, MeasuredFrf};
use bench_base::units::{hz, rad_s};
use bench_config::Config;
use bench_control::ClosedLoop;
use bench_identify::delay::excess_delay;
use bench_identify::{Estimate, Frf};
use bench_plant::LoopPlant;

/// The phases are compared with the model up to this multiple of its highest mode.
const LAST_MODE: f64 = 1.2;
/// An excess delay of more periods is not an error of the configured delays.
const MAX_EXCESS_PERIODS: f64 = 0.5;
/// Delays that differ by less than this ratio of a period are equal.
const SAME_DELAY_PERIODS: f64 = 0.1;
/// A deviation of more standard deviations is not noise.
const CERTAIN_SIGMAS: f64 = 4.0;
/// Largest ratio of the measured static response and that of the model, and of its inverse.
const MAX_GAIN_RATIO: f64 = 10.0;

/// Refuses an FRF that was not measured through the signal path of `config`.
pub(crate) fn check_frf(
    measured: &MeasuredFrf,
    model: &ClosedLoop,
    config: &Config,
) -> Result<(), FrfError> {
    check_rate(measured, config)?;
    let mean_age = LoopPlant::with_mean_age(config, model.modes());
    check_gain(&measured.frf, &mean_age)?;
    match &measured.recorded {
        Some(_) => Ok(()),
        None => {
            check_conventions(&measured.frf, |hz| mean_age.response(rad_s(hz)))?;
            check_delay(&measured.frf, model, &mean_age)
        }
    }
}

/// Refuses an FRF beyond half the loop rate, and a recording with another signal path than that of `config`.
pub(crate) fn check_rate(measured: &MeasuredFrf, config: &Config) -> Result<(), FrfError> {
    let (_, last_hz) = measured.band_hz();
    let rate_hz = config.servo.rate_hz;
    let recorded = measured.recorded.as_deref();
    if last_hz >= 0.5 * rate_hz {
        return Err(FrfError::AboveNyquist { last_hz, rate_hz });
    }
    recorded.map_or(Ok(()), |recorded| check_path(recorded, config))
}

/// A setting and its value in a configuration.
type Setting = (&'static str, fn(&Config) -> f64);

/// The settings of the signal path between command and reading.
const SIGNAL_PATH: [Setting; 6] = [
    ("loop.rate_hz", |c| c.servo.rate_hz),
    ("loop.computing_delay_periods", |c| {
        f64::from(c.servo.computing_delay_periods)
    }),
    ("amplifier.bandwidth_hz", |c| c.amplifier.bandwidth_hz),
    ("amplifier.latency_s", |c| c.amplifier.latency_s),
    ("probe.latency_s", |c| c.probe.latency_s),
    ("probe.transport_s", |c| c.probe.transport_s),
];

/// Compares the signal path of a recording with that of the loop.
fn check_path(recorded: &Config, config: &Config) -> Result<(), FrfError> {
    let differs = |(_, of): &&Setting| of(recorded) != of(config);
    match SIGNAL_PATH.iter().find(differs) {
        None => Ok(()),
        Some((name, of)) => Err(FrfError::Path {
            name,
            recorded: of(recorded),
            configured: of(config),
        }),
    }
}

/// Compares the static response with that of the model: a factor of a thousand is another unit.
fn check_gain(frf: &Frf, plant: &LoopPlant) -> Result<(), FrfError> {
    let (Some(&frequency_hz), Some(response)) = (frf.frequency_hz.first(), frf.response.first())
    else {
        return Ok(());
    };
    let ratio = response.norm() / plant.response(rad_s(frequency_hz)).norm();
    if (1.0 / MAX_GAIN_RATIO..=MAX_GAIN_RATIO).contains(&ratio) {
        Ok(())
    } else {
        Err(FrfError::Gain {
            ratio,
            frequency_hz,
        })
    }
}

/// Compares the phases with those of the model.
fn check_delay(frf: &Frf, model: &ClosedLoop, plant: &LoopPlant) -> Result<(), FrfError> {
    let frequencies = frf.frequency_hz.iter();
    let response: Vec<_> = frequencies.map(|f| plant.response(rad_s(*f))).collect();
    let highest = model.modes().iter().map(|mode| mode.omega_rad_s);
    let max_hz = LAST_MODE * hz(highest.fold(0.0, f64::max));
    let Some(excess) = excess_delay(frf, &response, max_hz) else {
        return Ok(());
    };
    judge_excess(excess, plant)
}

/// An excess delay that is minus the delay of the model shows that the delay was removed from the phases.
pub(crate) fn judge_excess(excess: Estimate, plant: &LoopPlant) -> Result<(), FrfError> {
    let (delay_s, period_s) = (plant.delay_s(), plant.period_s());
    let within = |limit_s: f64, difference_s: f64| {
        difference_s.abs() <= limit_s + CERTAIN_SIGMAS * excess.sigma
    };
    if within(MAX_EXCESS_PERIODS * period_s, excess.value) {
        return Ok(());
    }
    if within(SAME_DELAY_PERIODS * period_s, excess.value + delay_s) {
        return Err(FrfError::DelayRemoved {
            lead_ms: -1e3 * excess.value,
            delay_ms: 1e3 * delay_s,
        });
    }
    Err(FrfError::OtherDelay {
        excess_ms: 1e3 * excess.value,
        period_ms: 1e3 * period_s,
    })
}
