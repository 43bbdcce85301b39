//! Readings and set-points at irregular times, resampled to the regular ticks of a loop.

mod kernel;
pub mod resampling;
pub mod setpoint_timing;
