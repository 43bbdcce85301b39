//! Whatever it is fed, the program answers with an exit code and a sentence: it never panics, dies or hangs.
//!
//! `program::run_in` asserts that of every single call; the tests below say what the sentence must hold.

mod files;
mod flags;
mod random;
use bench_test_support::program;
