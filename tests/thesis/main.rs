//! The thesis as a specification of the program: its tables, controllers and experiments, at the process boundary.
//!
//! Expected figures come from the thesis (its misprints corrected where they are used), from closed forms, or from
//! `tests/python/truth.py`, which shares no line with the program.

mod chirp;
mod conditions;
mod control;
mod locus;
mod map;
mod margins;
mod model;
mod plants;
use bench_test_support::program;
mod quadratic;
mod recording;
mod tables;
use bench_test_support::truth;
mod veering;
