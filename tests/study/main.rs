//! `bench model study`: manufacturing tolerances, at the process boundary.
//!
//! Truth comes from closed forms and from `tests/python/study.py`, which shares no line with the program.

#[path = "../thesis/program.rs"]
mod program;
#[path = "../thesis/truth.rs"]
#[allow(dead_code, reason = "each test binary takes what it needs")]
mod truth;

mod figures;
mod files;
mod interrupted;
mod refused;
mod tables;
