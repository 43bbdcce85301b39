//! `bench doctor` as a process, and its CAN examination on a bus in memory: findings, output, and no motion.

use bench_test_support::program;
#[path = "../../hal/tests/serial/support/rehearsal.rs"]
#[allow(dead_code, reason = "this test binary uses a part of it")]
mod rehearsal;

mod can;
mod command;
mod probe;
