//! Requirements for shaping, prefilter and feedforward of `bench control`: plans against an independent simulation in Python, and runs
//! of the simulated stage.

mod inversion;
mod minimum_time;
mod plans;
mod refused;
mod runs;

use bench_config::{Config, OptionSetting, Purpose, Source, load};
use bench_experiment::Plan;
use bench_test_support::{program, truth};

/// The stage with the fast controller and these settings.
fn config(sets: &[&str]) -> Config {
    load(&Source {
        config: None,
        sets: sets.iter().map(|set| set.to_string()).collect(),
        options: Vec::<OptionSetting>::new(),
        purpose: Purpose::Control,
    })
    .expect("valid settings")
}

fn plan(sets: &[&str]) -> Plan {
    Plan::control(config(sets)).expect("a plan")
}
