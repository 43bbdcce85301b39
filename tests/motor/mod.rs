//! The heat of the motor across runs, restarts of the program and crashes.
mod command;
mod common;
mod interrupted;
mod replay;
mod runs;
mod simulated;
