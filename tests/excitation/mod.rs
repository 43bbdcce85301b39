//! All excitations give the same response and modes, and a run matches its plan.
mod averages;
mod identified;
mod linearity;
mod plans;
mod rig;
mod unfinished;

use bench_test_support::{program, simulated, truth};
