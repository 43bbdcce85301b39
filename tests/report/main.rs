//! Plots and pages of a record. The plots that these tests draw are left in `target/tmp`, for inspection.

mod bode;
mod nyquist;
mod phase;
mod pictures;
mod pole_zero;
mod run;
use bench_test_support::stage;
use bench_test_support::svg;
use bench_test_support::truth;
