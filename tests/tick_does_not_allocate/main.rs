//! A tick does not allocate and makes no system call, with every program and every fault.
mod allocation;
mod drivers;
mod programs;
mod system_calls;
mod test_loop;

use assert_no_alloc::AllocDisabler;
use bench_config::{Config, Source, load};
use bench_hal::Validity;
use bench_test_support::faulty_rig;

use faulty_rig::Fault;

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

fn stage() -> Config {
    load(&Source::default()).expect("the profile is valid")
}

/// A trip of every kind: reason, fault, and commanded current in amperes.
fn all_trips() -> Vec<(&'static str, Fault, f64)> {
    vec![
        ("travel", Fault::Position(0.00095), 0.01),
        ("peak_current", Fault::Offset(0.0), 9.99),
        ("continuous_current", Fault::Offset(0.0), 9.0),
        ("command_not_finite", Fault::Offset(0.0), f64::NAN),
        ("probe_invalid", Fault::Validity(Validity::Faulty), 0.01),
        ("probe_stale", Fault::Age(2_000_000), 0.01),
        ("probe_stale", Fault::RepeatedSample, 0.01),
        ("probe_stuck", Fault::Stuck, 0.3),
        ("amplifier", Fault::AmplifierFault(3), 0.01),
        ("amplifier", Fault::RefusedCommand(4), 0.01),
        ("amplifier", Fault::RefusedEnable(5), 0.01),
        ("amplifier", Fault::ReturnedCurrent(f64::NAN), 0.01),
        ("set_point_not_accepted", Fault::ReturnedCurrent(3.0), 0.01),
        ("amplifier_disabled", Fault::ReportsDisabled, 0.01),
        ("current_not_followed", Fault::MeasuredOffset(1.0), 0.01),
    ]
}

/// The stage with a very small motor force, so that a constant current does not move it to the soft limit.
fn weak_motor() -> Config {
    let mut config = stage();
    let (peak_a, rated_a) = (
        config.motor.peak_current_a(),
        config.motor.continuous_current_a(),
    );
    config.motor.force_constant_n_per_a = 1e-3;
    (config.motor.peak_force_n, config.motor.continuous_force_n) = (peak_a * 1e-3, rated_a * 1e-3);
    config
}
