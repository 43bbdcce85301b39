//! The profile `lab`: rates and delays of real devices, in the margins and in measured responses.
mod aliases;
mod delays;
mod margins;
mod measured;
use bench_test_support::simulated;
mod wires;
