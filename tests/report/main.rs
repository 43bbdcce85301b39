//! What the report room promises. The pictures that these tests draw are left in `target/tmp`, to look at.

mod bode;
mod map;
mod nyquist;
mod phase;
mod pictures;
mod run;
use bench_test_support::stage;
use bench_test_support::svg;
use bench_test_support::truth;
