//! Requirements for `bench compare`: differences against the closed form of a stage of two masses, false alarms, and the command.

mod command;
mod two_masses;

use bench_test_support::compared;
use bench_test_support::program;
