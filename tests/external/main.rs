//! External records: a CSV with named columns, periodic or not, in any units.

use bench_test_support::program;
use bench_test_support::python;

mod motor_bench;
mod single_record;
mod periodic;
mod refused;
mod signals;
