//! Spectral lines of a periodic excitation, from whole periods: the response with the noise from the scatter of the periods,
//! and distortion from the lines that the excitation omits.

pub mod distortion;
mod excited;
pub mod harmonics;
pub mod linearity;
mod lines;
pub mod periodic;
mod pooled;
pub mod settling;
pub(crate) mod useful_band;
