//! The figures of the thesis: each is present or has a reason for its absence, computed values are compared with printed ones, curves are
//! inside their frames and equal those of Python. The figures are made once for all tests.

mod all;
mod command;
mod content;
mod pictures;
mod values;

use bench_test_support::{program, svg, truth};
