//! Fit of modes and their standard deviations to a frequency response, and the verdict from the modes.

mod modes;
mod response;
mod under_control;
mod verdicts;
use bench_test_support::{identified, simulated, synthetic};
