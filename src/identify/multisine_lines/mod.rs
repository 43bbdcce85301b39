//! Spectral lines of a periodic excitation, from whole periods: the response with the noise from the scatter of the periods,
//! and distortion from the lines that the excitation omits.

pub mod distortion;
pub mod harmonics;
pub mod linearity;
pub mod periodic;
