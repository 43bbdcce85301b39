//! Plots and pages of a record. The plots of these tests are kept in `target/tmp` for inspection.

mod amplitudes;
mod attributes;
mod bode;
mod comparison;
mod control;
mod identification;
mod loops;
mod model_pictures;
mod nyquist;
mod overlay;
mod phase;
mod pictures;
mod pole_zero;
mod run;
mod run_kinds;

use bench_test_support::{stage, svg, truth};
