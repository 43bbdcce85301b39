//! The estimators of frequency responses, against analytic plants and against scipy.

mod accuracy;
mod bad_data;
mod curves;
mod frf_csv;
mod harmonics;
mod joint;
mod noise;
use bench_test_support::python;
mod repeated;
mod noise_sides;
use bench_test_support::stage;
mod welch;
