//! External records: a CSV with named columns or a file of arrays, periodic or not, in any units.

mod arrays;
mod closed_loop;
mod distortion;
mod existing_results;
mod forms;
mod impaired_records;
mod motor_bench;
mod output_kinds;
mod periodic;
mod random_stages;
mod refused;
mod responses;
mod signals;
mod single_record;

use bench_test_support::{program, python};
