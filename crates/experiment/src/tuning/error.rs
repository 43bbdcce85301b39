//! Why measured responses cannot be used for a design.

use super::disturbance::DisturbanceError;
use crate::analysis::FrfError;
use bench_control::ControllerError;
use bench_identify::modal::FitError;
use bench_plant::PlantError;

/// Measured responses that cannot be used for a design.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TuneSourceError {
    /// A file that cannot be used.
    #[error("{}{why}", prefix(.file, .why))]
    File {
        /// The file.
        file: String,
        /// What is wrong.
        why: Box<FrfError>,
    },
    /// No modes can be fitted.
    #[error("{file}: {why}")]
    Fit {
        /// The file.
        file: String,
        /// Why not.
        why: FitError,
    },
    /// The file cannot be read for its digest.
    #[error("cannot read {file}: {why}; check that it is a file and that you may read it")]
    Read {
        /// The file.
        file: String,
        /// Why not.
        why: std::io::Error,
    },
    /// A stage without a spring, or whose first mode was not measured.
    #[error(
        "{file}: the static response was not measured: by the fit it is {ratio:.2e} times the response at the first frequency, {first_hz:.4} Hz, or a mode lies below it; repeat `bench chirp` with a chirp.start_hz below the first mode (a free body, a stage without a spring to ground, is not supported)"
    )]
    Static {
        /// The file.
        file: String,
        /// Static response by the fit over that at the first frequency.
        ratio: f64,
        /// First measured frequency.
        first_hz: f64,
    },
    /// The static response cannot be that of the bench.
    #[error(
        "{file}: the response is {response_m_per_a:.2e} m/A at {frequency_hz:.4} Hz, so the full current of {current_a} A (amplifier.current_limit_a) would move the stage by {ratio:.1e} times the permitted travel of {travel_m} m (interlock.soft_limit_m): the unit is probably not m/A; convert the file to m/A, or correct these settings"
    )]
    Unit {
        /// The file.
        file: String,
        /// Magnitude of the response.
        response_m_per_a: f64,
        /// Its frequency.
        frequency_hz: f64,
        /// Largest current.
        current_a: f64,
        /// Largest travel.
        travel_m: f64,
        /// Travel at the largest current over the permitted one.
        ratio: f64,
    },
    /// Recordings of different loop rates.
    #[error(
        "{first} was measured at {first_hz} Hz (loop.rate_hz), but {second} at {second_hz} Hz; one controller runs at one rate, so repeat `bench chirp` for one of them at the rate of the other, or leave it out"
    )]
    Rates {
        /// A file.
        first: String,
        /// Its rate.
        first_hz: f64,
        /// A file with another rate.
        second: String,
        /// Its rate.
        second_hz: f64,
    },
    /// Two responses of one operating point.
    #[error(
        "{first} and {second} are of the same operating point: {why}; leave one of them out, or average repetitions in one chirp (chirp.repetitions)"
    )]
    SamePoint {
        /// A file.
        first: String,
        /// Another file.
        second: String,
        /// How that is seen.
        why: String,
    },
    /// A recording gives no disturbance.
    #[error(transparent)]
    Disturbance(#[from] DisturbanceError),
    /// The zeros of the fit cannot be computed.
    #[error(transparent)]
    Zeros(#[from] PlantError),
    /// The designed controller cannot be used.
    #[error(transparent)]
    Controller(#[from] ControllerError),
}

impl TuneSourceError {
    /// Whether data or files are the reason, and not options or settings.
    pub fn is_failure(&self) -> bool {
        match self {
            TuneSourceError::File { why, .. } => why.is_failure(),
            TuneSourceError::Disturbance(error) => error.is_failure(),
            TuneSourceError::Fit { .. }
            | TuneSourceError::Zeros(_)
            | TuneSourceError::Controller(_) => true,
            TuneSourceError::Read { .. }
            | TuneSourceError::Static { .. }
            | TuneSourceError::Unit { .. }
            | TuneSourceError::Rates { .. }
            | TuneSourceError::SamePoint { .. } => false,
        }
    }
}

/// The name of the file, unless the message contains it.
fn prefix(file: &str, why: &FrfError) -> String {
    match why {
        FrfError::Csv { .. } | FrfError::Table(_) | FrfError::Recording(_) | FrfError::Kind(_) => {
            String::new()
        }
        _ => format!("{file}: "),
    }
}
