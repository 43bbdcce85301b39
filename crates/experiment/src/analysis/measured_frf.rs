//! A measured plant from a file: the FRF that `bench chirp` writes, or the recording of an excitation.
//!
//! The FRF of `bench chirp` (`..._frf.csv`) is that from the command of a tick to the reading of a tick: with hold, computing delay,
//! amplifier and the age of the reading, as the loop has it. The file `..._frf_without_delay.csv` has the same columns, but the delay
//! is removed from its phases, so that margins from it would be too large. It is refused, by the phases.

use std::ffi::OsStr;
use std::path::Path;

use super::analysis_error::AnalysisError;
use super::read_run::{ReadSignals, open_with_signals};
use super::recorded_excitation::{cautions, measured_response};
use crate::plan::{Plan, PlanError, RunKind};
use bench_base::units::{hz, rad_s};
use bench_config::Config;
use bench_control::ClosedLoop;
use bench_control::measured::MeasuredLoopError;
use bench_identify::delay::excess_delay;
use bench_identify::frf_csv::{self, FrfCsvError};
use bench_identify::{Estimate, Frf};
use bench_plant::LoopPlant;
use bench_recording::{Recording, RecordingError};

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

/// A measured plant, from command (A) to reading (m).
#[derive(Clone, Debug)]
pub struct MeasuredFrf {
    /// The response.
    pub frf: Frf,
    /// The configuration of the run, if the file is a recording.
    pub recorded: Option<Box<Config>>,
    /// Defects of the run.
    pub cautions: Vec<String>,
}

/// A measured plant that cannot be used for margins.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrfError {
    /// The CSV file cannot be used.
    #[error("{path}: {why}")]
    Csv {
        /// The file.
        path: String,
        /// What is wrong.
        why: FrfCsvError,
    },
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recording has no plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The recording has no response.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// A recording without an excitation.
    #[error(
        "{0} has no excitation, so it gives no frequency response; choose a recording of `bench chirp`, or of `bench control --reference chirp`"
    )]
    Kind(String),
    /// The response gives no margins.
    #[error(transparent)]
    Loop(#[from] MeasuredLoopError),
    /// The poles of the control law cannot be computed.
    #[error(
        "the poles of the control law cannot be computed, so the Nyquist curve cannot be interpreted; choose another controller"
    )]
    Poles,
    /// Measured with another signal path than the loop has.
    #[error(
        "the FRF was measured with {name} = {recorded}, but the loop has {configured}, and the FRF contains this part of the signal path; repeat `bench chirp` with the settings of the loop, or change the setting (--set {name}={recorded})"
    )]
    Path {
        /// The setting.
        name: &'static str,
        /// Its value in the recording.
        recorded: f64,
        /// Its value in the configuration.
        configured: f64,
    },
    /// Frequencies above half the sampling rate.
    #[error(
        "the FRF reaches {last_hz} Hz, beyond half of the loop rate of {rate_hz} Hz (loop.rate_hz), so it was measured at another rate; set loop.rate_hz to the rate of the measurement, or repeat `bench chirp`"
    )]
    AboveNyquist {
        /// Last frequency.
        last_hz: f64,
        /// Rate of the loop.
        rate_hz: f64,
    },
    /// The delay was removed.
    #[error(
        "the phases of the FRF lead those of the model by {lead_ms:.3} ms, and the delay of the signal path is {delay_ms:.3} ms, so it seems to be removed; give the file ..._frf.csv, not ..._frf_without_delay.csv, or the recording"
    )]
    DelayRemoved {
        /// By how much the phases lead those of the model, as a time.
        lead_ms: f64,
        /// Delay of the model.
        delay_ms: f64,
    },
    /// The phases do not belong to the configured rate and delays.
    #[error(
        "the phases of the FRF differ from those of the model by a delay of {excess_ms:+.3} ms, more than half of a period of the loop ({period_ms:.3} ms), so it was measured at another loop.rate_hz, or the configured delays are wrong; set loop.rate_hz and the delays (`bench calibrate` measures them), or give the recording, which contains them"
    )]
    OtherDelay {
        /// Delay of the FRF beyond that of the model.
        excess_ms: f64,
        /// Period of the loop.
        period_ms: f64,
    },
    /// Not metres per ampere, or another stage.
    #[error(
        "the FRF is {ratio:.2e} times the response of the model at {frequency_hz:.4} Hz, so its unit is not m/A, or it is of another stage than the configured one; convert its unit, or give the configuration of its stage (--config)"
    )]
    Gain {
        /// Measured response over that of the model.
        ratio: f64,
        /// Where.
        frequency_hz: f64,
    },
}

impl FrfError {
    /// Whether data or files are the reason, and not options or settings.
    pub fn is_failure(&self) -> bool {
        matches!(self, FrfError::Recording(_) | FrfError::Analysis(_))
    }
}

impl MeasuredFrf {
    /// The FRF of a CSV file, or of a recording, which ends in `.mcap`, with its data for a fit.
    ///
    /// # Errors
    /// When the file cannot be read, or has no response from current to displacement.
    pub fn read(path: &Path) -> Result<MeasuredFrf, FrfError> {
        if path.extension() == Some(OsStr::new("mcap")) {
            MeasuredFrf::of_recording(path)
        } else {
            MeasuredFrf::of_csv(path)
        }
    }

    fn of_csv(path: &Path) -> Result<MeasuredFrf, FrfError> {
        let frf = frf_csv::read(path).map_err(|why| FrfError::Csv {
            path: path.display().to_string(),
            why,
        })?;
        Ok(MeasuredFrf {
            frf,
            recorded: None,
            cautions: Vec::new(),
        })
    }

    fn of_recording(path: &Path) -> Result<MeasuredFrf, FrfError> {
        let (recording, signals) = open_with_signals(path)?;
        let plan = Plan::of(&recording)?;
        Ok(MeasuredFrf {
            frf: recorded_frf(&recording, signals, &plan)?,
            recorded: Some(Box::new(plan.config)),
            cautions: cautions(&recording),
        })
    }

    /// Settings of the recorded run that differ from a configuration and affect the plant, as warnings.
    pub fn differences(&self, config: &Config) -> Vec<String> {
        let Some(recorded) = &self.recorded else {
            return Vec::new();
        };
        let plant = (recorded.plant != config.plant).then(|| {
            "the recording was made with other settings of the plant ([plant]) than the configuration has, so that what lies outside of its band is bounded by another model; give the configuration of the recording (--config, --set)".to_string()
        });
        plant.into_iter().collect()
    }

    /// First and last frequency in hertz; 0 without any.
    pub fn band_hz(&self) -> (f64, f64) {
        self.frf.band_hz()
    }
}

/// The response of a recorded run with this plan, from command (A) to reading (m): that of [`analyse`](crate::analyse), without the
/// fit of the modes.
///
/// # Errors
/// When the recording has no excitation, or gives no response.
pub fn recorded_frf(
    recording: &Recording,
    signals: ReadSignals,
    plan: &Plan,
) -> Result<Frf, FrfError> {
    match plan.kind {
        RunKind::Chirp | RunKind::Control => {
            Ok(measured_response(recording, signals, &plan.config)?)
        }
        RunKind::Calibrate | RunKind::Quiet | RunKind::StageCheck => {
            Err(FrfError::Kind(recording.path().display().to_string()))
        }
    }
}

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
        None => check_delay(&measured.frf, model, &mean_age),
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
