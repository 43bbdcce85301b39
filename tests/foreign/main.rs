//! Signals of other hands: a CSV with named columns, periodic or not, in any units.

#[path = "../thesis/program.rs"]
mod program;
#[path = "../identify/python.rs"]
mod python;

mod motor_bench;
mod once;
mod periodic;
mod refused;
mod signals;
