//! Errors of figures.

use bench_config::ConfigError;
use bench_control::ControllerError;
use bench_experiment::{AnalysisError, RunError};
use bench_plant::PlantError;
use bench_recording::RecordingError;
use bench_report::ReportError;
use bench_rig::devices::DevicesError;

/// Why a figure could not be made.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// An unknown number.
    #[error("unknown figure or table {unknown}; known are {known}")]
    Unknown {
        /// The number given.
        unknown: String,
        /// All numbers.
        known: String,
    },
    /// A plant's settings are refused.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A plant cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A controller is refused.
    #[error(transparent)]
    Controller(#[from] ControllerError),
    /// The picture cannot be drawn.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// The simulated stage cannot be made.
    #[error(transparent)]
    Devices(#[from] DevicesError),
    /// A run of the simulated stage failed.
    #[error(transparent)]
    Session(#[from] RunError),
    /// Its recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Its recording contains no response.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// A computation or run did not give what the figure needs.
    #[error("{0}; run the command below the figure to see why")]
    Run(String),
    /// The result cannot be printed, or the program was stopped.
    #[error("{0}")]
    Output(String),
    /// A file cannot be written.
    #[error("cannot write {path}: {why}; free some space or choose another folder with --out")]
    Write {
        /// Its path.
        path: String,
        /// The message of the system.
        why: String,
    },
}
