//! Modes with their standard deviations from a response, and the verdict from the modes.

mod modes;
mod response;
mod under_control;
mod verdicts;
use bench_test_support::{identified, simulated, synthetic};
