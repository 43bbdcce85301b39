//! Margins from measured frequency responses: closed forms, the model, python-control, and files that are refused.

mod closed_form;
mod closed_loop;
mod command;
mod nyquist;
mod python_control;
mod random_loops;
mod refused;
mod sampled;

use bench_test_support::{program, truth};
