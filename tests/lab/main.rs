//! The profile `lab`: rates and delays of real devices, in the margins and in what is measured.
mod aliases;
mod margins;
mod measured;
#[path = "../common/simulated.rs"]
mod simulated;
mod wires;
