//! The estimators of frequency responses, against analytic plants and scipy.

mod accuracy;
mod bad_data;
mod curves;
mod frf_csv;
mod harmonics;
mod joint;
mod noise;
mod noise_sides;
mod repeated;
mod welch;

use bench_test_support::{python, stage};
