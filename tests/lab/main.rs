//! The profile `lab`: rates and delays of real devices, in the margins and in what is measured.
mod aliases;
mod margins;
mod measured;
mod wires;
