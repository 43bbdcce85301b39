//! `bench doctor` from outside, and on a bus in memory: what it finds, what it says, and that nothing moves.

use bench_test_support::program;
#[path = "../../hal/tests/serial/support/rehearsal.rs"]
#[allow(dead_code, reason = "this test binary takes what it needs")]
mod rehearsal;

mod can;
mod command;
mod probe;
