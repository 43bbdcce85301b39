//! `bench calibrate`: its estimates, its file, and the effect of a calibration on a run.
mod files;
pub mod skewed_rig;
mod steps;
