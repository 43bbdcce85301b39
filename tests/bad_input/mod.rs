//! Invalid input: the program ends with an exit code and a message; it does not panic, hang or die of a signal.
//!
//! `program::run_program` asserts this for every call. The tests below check the content of the message.

mod files;
mod flags;
mod random;
use bench_test_support::program;
