//! The figures of the thesis: all present or with a reason, printed values beside computed ones, drawn within their frames,
//! curves equal to those of Python. They are made once for all tests.

mod all;
mod command;
mod content;
mod pictures;
use bench_test_support::program;
use bench_test_support::svg;
use bench_test_support::truth;
mod values;
