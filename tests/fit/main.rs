//! From a response to modes with their errors, and from these to a verdict.

mod modes;
mod response;
mod under_control;
mod verdicts;
use bench_test_support::{identified, simulated, synthetic};
