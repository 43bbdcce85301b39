//! Smooth curves through neighbouring bins of the FFT of a whole record.
//!
//! ```text
//! Record (bins of U, Y) --Window--> curve (least squares) --NoiseFloor--> local: the response with its errors
//!                                                                    '--> frf_data: the same without smoothing
//! joint: the same of a stage under control, by ratios of two curves
//! ```

mod bins;
mod curve;
pub mod frf_data;
pub mod joint;
pub mod local;
mod noise_floor;
mod record;
mod resolution;
pub mod settings;
mod squares;
