//! From a response to modes with their errors, and from these to a verdict.
mod intervals;
mod modes;
mod response;
mod rig;
use bench_test_support::simulated;
mod stage;
mod synthetic;
mod under_control;
mod verdicts;
