//! The figures of the thesis: each there or with its reason, printed beside computed, drawn within its frame, and its
//! curves those of Python. All are made once, for all tests.

mod all;
mod command;
mod content;
mod pictures;
#[path = "../thesis/program.rs"]
mod program;
#[allow(
    dead_code,
    reason = "made for the tests of report, which use all of it"
)]
#[path = "../report/svg.rs"]
mod svg;
#[allow(
    dead_code,
    reason = "made for the tests of the thesis, which use all of it"
)]
#[path = "../thesis/truth.rs"]
mod truth;
mod values;
