//! Local polynomial and local rational models (LPM, LRM) of the response, fitted to neighbouring bins of the FFT of a whole
//! record.
//!
//! ```text
//! RecordSpectra (bins of U, Y) --Window--> model (least squares) --NoiseFloor--> local: response with standard deviations
//!                                                                           '--> frf_data: the same without smoothing
//! transient: the spectra of a record in motion without its transient
//! joint: the same for a stage in closed loop, by ratios of two models
//! ```

pub(super) mod frf_data;
pub mod joint;
pub(super) mod least_squares;
pub mod local;
mod model;
mod noise_floor;
mod rational;
mod record_spectra;
mod settings;
mod spectra;
mod transient;
mod window;
