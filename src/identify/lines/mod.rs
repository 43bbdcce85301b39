//! Single lines of a periodic excitation, each from whole periods: the response with the noise by their scatter, and what
//! stands between the lines.

pub mod distortion;
pub mod harmonics;
pub mod linearity;
pub mod periodic;
