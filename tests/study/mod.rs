//! `bench model study`: manufacturing tolerances, at the process boundary.
//!
//! Reference values come from closed forms and from `tests/python/study.py`, which is independent of the program.

use bench_test_support::program;
use bench_test_support::truth;

mod figures;
mod files;
mod interrupted;
mod refused;
mod tables;
