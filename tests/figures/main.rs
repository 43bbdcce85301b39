//! The figures of the thesis: each there or with its reason, printed beside computed, drawn within its frame, and its
//! curves those of Python. All are made once, for all tests.

mod all;
mod command;
mod content;
mod pictures;
use bench_test_support::program;
use bench_test_support::svg;
use bench_test_support::truth;
mod values;
