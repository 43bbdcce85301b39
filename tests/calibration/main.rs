//! What `bench calibrate` finds, and what a calibration does to a run.
mod files;
mod skewed_rig;
mod steps;
