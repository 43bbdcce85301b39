//! From recorded signals to a frequency response function (FRF) that says how far it can be trusted.
//!
//! ```text
//! Signals -> drift removed -> FFT of the whole record -> a curve through each neighbourhood of bins -> Frf -> CSV, plot
//! ```
//!
//! - [`local::estimate`]: the default. For records that begin and end at rest, as every run of the bench does.
//! - [`frf_data()`]: the same record without smoothing, for a fit.
//! - [`joint::estimate`]: plant, loop and sensitivities of a stage under control.
//! - [`response`]: as the configuration chooses.
//! - [`repeated::mean`]: repetitions of one excitation, each at rest at its ends, averaged.
//! - [`periodic::estimate`]: periods of one excitation, averaged.
//! - [`harmonics`], [`linearity`]: what stands between the lines of a multisine: distortion, odd and even, beside noise.
//! - [`with_distortion`]: what is alike in every period and yet no response.
//! - [`welch::estimate`]: averaged segments, for records that do not, and for comparison with other programs.
//! - [`align::Readings`] and [`edges`]: readings and set-points of irregular times on the regular ones of a loop.
//! - [`delay::beyond`]: how much later than a model a response answers.
//! - [`table`]: records of other hands, a CSV with named columns.
//! - [`csv`]: the file in which an FRF leaves the bench, and comes back.
//!
//! Sign convention of all estimators: y = H u, so a lag of the output is a negative phase.

mod band;
mod block;
mod configured;
pub mod csv;
mod curves;
pub mod delay;
mod error;
mod estimator;
mod frf;
mod lines;
pub mod modal;
mod moments;
pub mod repeated;
mod signals;
mod spectrum;
pub mod table;
mod times;
pub mod verdict;
pub mod welch;

pub use crate::config::{Estimator, LocalModel, ResolutionPoint};
pub use block::FrfDatum;
pub use configured::response;
pub use curves::frf_data::frf_data;
pub use curves::settings::EstimatorSettings;
pub use curves::{joint, local};
pub use error::IdentifyError;
pub use frf::{Frf, FrfPoint, PHASE_SIGMA_LIMIT_RAD, Unit, wrapped_phase_rad};
pub use lines::distortion::with_distortion;
pub use lines::{harmonics, linearity, periodic};
pub use moments::RunningStats;
pub use signals::Signals;
pub use times::{align, edges};
