//! A measured plant from a file: the FRF that `bench chirp` writes, that of another program, or the recording of an excitation.
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
use bench_base::input_file::{self, MAX_TABLE_BYTES};
use bench_config::Config;
use bench_control::measured::MeasuredLoopError;
use bench_external::frf::{self as external_frf, FrfTableError, PhaseUnit};
use bench_identify::Frf;
use bench_identify::frf_csv::{self, FrfCsvError};
use bench_identify::scatter::SigmaSource;
use bench_recording::{Recording, RecordingError};

/// A measured plant, from command (A) to reading (m).
#[derive(Clone, Debug)]
pub struct MeasuredFrf {
    /// The response.
    pub frf: Frf,
    /// The configuration of the run, if the file is a recording.
    pub recorded: Option<Box<Config>>,
    /// Where its standard deviations come from.
    pub sigma: SigmaSource,
    /// Defects of the run, and what was assumed about a file of another program.
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
    /// The file of another program is no response.
    #[error(transparent)]
    Table(#[from] FrfTableError),
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
    /// Radians where degrees are stated.
    #[error(
        "no phase of the FRF exceeds {largest_deg:.3} deg, although its magnitude has a resonance at {resonance_hz:.4} Hz, across which the phase falls by 180 deg: the phases are probably in radians; give --frf-phase rad, or name the column phase_rad"
    )]
    Radians {
        /// Largest magnitude of a phase.
        largest_deg: f64,
        /// Where the magnitude is the largest.
        resonance_hz: f64,
    },
    /// The complex conjugate of a response.
    #[error(
        "the phase of the FRF rises across its resonances, where that of every stage falls: the response is conjugated (another sign convention of the phase); change the sign of the phases or of the imaginary part, a lag must be negative"
    )]
    Conjugated,
    /// The response has the other sign.
    #[error(
        "the FRF has the other sign than expected: its phase is {phase_deg:.1} deg at the lowest frequency of {frequency_hz:.4} Hz, so that a positive current seems to give a negative displacement; change the sign of the response (add 180 deg to the phases), or that of the probe or the motor if the bench is wired like this"
    )]
    Sign {
        /// Lowest measured frequency.
        frequency_hz: f64,
        /// Phase there.
        phase_deg: f64,
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
    /// The FRF of a table, or of a recording, which ends in `.mcap`, with its data for a fit. `phase` is the unit of the phases of a
    /// table, whatever it states.
    ///
    /// # Errors
    /// When the file cannot be read, or has no response from current to displacement.
    pub fn read(path: &Path, phase: Option<PhaseUnit>) -> Result<MeasuredFrf, FrfError> {
        if path.extension() == Some(OsStr::new("mcap")) {
            MeasuredFrf::of_recording(path)
        } else {
            MeasuredFrf::of_table(path, phase)
        }
    }

    fn of_table(path: &Path, phase: Option<PhaseUnit>) -> Result<MeasuredFrf, FrfError> {
        let bytes = input_file::read(path, MAX_TABLE_BYTES);
        let bytes =
            bytes.map_err(|why| csv_error(path, FrfCsvError::File(path.to_owned(), why)))?;
        let own = std::str::from_utf8(&bytes).ok();
        let own = own.filter(|text| frf_csv::has_own_columns(text));
        match (own, phase) {
            (None, _) => MeasuredFrf::of_external(path, phase),
            (Some(text), None) => MeasuredFrf::of_own_csv(path, text),
            (Some(text), Some(_)) => {
                frf_csv::check_unit(text).map_err(|why| csv_error(path, why))?;
                MeasuredFrf::of_external(path, phase)
            }
        }
    }

    /// The FRF of a file that this program wrote. Without a value in the columns of standard deviations they are estimated.
    fn of_own_csv(path: &Path, text: &str) -> Result<MeasuredFrf, FrfError> {
        match frf_csv::from_str(text) {
            Ok(frf) => Ok(MeasuredFrf {
                frf,
                recorded: None,
                sigma: SigmaSource::Given,
                cautions: Vec::new(),
            }),
            Err(FrfCsvError::Cell { column, text, .. })
                if column == frf_csv::MAGNITUDE_SIGMA && text.is_empty() =>
            {
                MeasuredFrf::of_external(path, None)
            }
            Err(why) => Err(csv_error(path, why)),
        }
    }

    fn of_external(path: &Path, phase: Option<PhaseUnit>) -> Result<MeasuredFrf, FrfError> {
        let imported = external_frf::read(path, phase)?;
        let file = path.display();
        let assumptions = imported.assumptions.into_iter();
        Ok(MeasuredFrf {
            frf: imported.frf,
            recorded: None,
            sigma: imported.sigma,
            cautions: assumptions.map(|text| format!("{file}: {text}")).collect(),
        })
    }

    fn of_recording(path: &Path) -> Result<MeasuredFrf, FrfError> {
        let (recording, signals) = open_with_signals(path)?;
        let plan = Plan::of(&recording)?;
        Ok(MeasuredFrf {
            frf: recorded_frf(&recording, signals, &plan)?,
            recorded: Some(Box::new(plan.config)),
            sigma: SigmaSource::Given,
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

fn csv_error(path: &Path, why: FrfCsvError) -> FrfError {
    FrfError::Csv {
        path: path.display().to_string(),
        why,
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
