//! The statistical suite: properties over many seeds, such as the coverage of a 95 % confidence interval.
//!
//! It takes minutes of processor time: `cargo test --features statistical --test statistical`. `.ci/run` runs it.

mod comparisons;
mod coverage;
mod estimators;
mod external_records;
mod fit_intervals;
mod frf_bias_and_coverage;
mod frf_noise;
mod held_out_designs;
mod joint_estimate;
mod measured_designs;
mod measured_margins;
mod missed_ticks;
mod modes;
mod residual_monitor;
mod sequential;
mod stage_check;
mod verdicts;
