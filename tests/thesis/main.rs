//! Requirements from the thesis: its tables, controllers and experiments, tested through the command line.
//!
//! Expected values come from the thesis (misprints are corrected where they are used), from closed forms, or from
//! `tests/python/truth.py`, which is independent of the program.

mod answer;
mod chirp;
mod conditions;
mod control;
mod locus;
mod map;
mod margins;
mod model;
mod plants;
mod quadratic;
mod recording;
mod tables;
mod veering;

use bench_test_support::{program, truth};
