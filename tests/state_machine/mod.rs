//! The state machine of the loop against a model of it, for random sequences of requests, faults and signals.
//!
//! In every tick: state, command, answers to the requests and heat of the motor are those of the model; current flows only in
//! `Running` or `Settling`, with a valid lease, a reading that was judged and a motor below its limit; an amplifier that must be off
//! is disabled.
//!
//! `BENCH_SEQUENCES` and `BENCH_SEQUENCE_TICKS` set number and length of the sequences, `BENCH_RANDOM_SEED` their seed; all are printed:
//!
//! `BENCH_SEQUENCES=100000 BENCH_SEQUENCE_TICKS=10000 cargo test --release --test operation state_machine -- --nocapture`

mod model;
mod sequence;
mod test_loop;

use std::cell::RefCell;
use std::collections::HashMap;

use bench_config::{Config, Source, load};
use bench_rt::arming::State;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestCaseResult, TestRunner};

use model::{Cause, Expected, Model, RunSettings};
use sequence::{Happening, Timeline, happenings};
use test_loop::{Done, TestLoop};

const CAUSES: [Cause; 7] = [
    Cause::Check,
    Cause::Enable,
    Cause::Command,
    Cause::Heat,
    Cause::Signal,
    Cause::Lease,
    Cause::Completion,
];

/// How often something occurred in all sequences.
#[derive(Debug, Default)]
struct Coverage {
    causes: HashMap<Cause, u64>,
    ticks_with_current: u64,
    settling_ticks: u64,
    exchanged_runs: u64,
}

fn number_from(variable: &str, default: u64) -> u64 {
    match std::env::var(variable) {
        Ok(text) => text.parse().expect("a whole number"),
        Err(_) => default,
    }
}

/// The stage with a motor that heats up within a few hundred ticks.
fn config() -> Config {
    let mut config = load(&Source::default()).expect("the profile is valid");
    config.motor.thermal_time_constant_s = 0.03;
    config
}

fn settings() -> impl Strategy<Value = RunSettings> {
    (0..12u64, 1..6u64, 10..80u64).prop_map(|(ramp_ticks, healthy_ticks, lease_ticks)| {
        RunSettings {
            ramp_ticks,
            healthy_ticks,
            lease_ticks,
        }
    })
}

/// One sequence; `coverage` counts what occurred.
fn follows_the_model(
    settings: RunSettings,
    happenings: &[(u64, Happening)],
    ticks: u64,
    coverage: &mut Coverage,
) -> TestCaseResult {
    let config = config();
    let (mut model, mut real) = (
        Model::new(&config, settings),
        TestLoop::new(&config, settings),
    );
    let mut timeline = Timeline::new(happenings);
    for step in 0..ticks {
        let inputs = timeline.at(step);
        if inputs.exchanges {
            coverage.exchanged_runs += u64::from(model.state == State::Running);
            model.exchange();
            real.exchange();
        }
        let expected = model.tick(&inputs, real.next_tick(inputs.missed));
        let done = real.tick(&inputs);
        check(&model, &expected, &done)?;
        check_off(&model, &real, &done)?;
        check_requests(&model, &real, &done)?;
        coverage.ticks_with_current += u64::from(has_current(&done));
        coverage.settling_ticks +=
            u64::from(has_current(&done) && expected.state == State::Settling);
    }
    for cause in model.causes {
        *coverage.causes.entry(cause).or_default() += 1;
    }
    Ok(())
}

fn has_current(done: &Done) -> bool {
    done.calls
        .command_a
        .is_some_and(|current_a| current_a != 0.0)
}

fn check(model: &Model, expected: &Expected, done: &Done) -> TestCaseResult {
    prop_assert_eq!(done.record.state, expected.state, "{:?}", done);
    let command_a = done.calls.command_a;
    prop_assert_eq!(
        command_a.is_some(),
        expected.command_a.is_some(),
        "{:?}",
        done
    );
    if let (Some(command_a), Some(expected_a)) = (command_a, expected.command_a) {
        // The sines of two libraries differ by rounding.
        prop_assert!(
            (command_a - expected_a).abs() < 1e-12,
            "{expected_a} {done:?}"
        );
    }
    if has_current(done) {
        let may_flow = matches!(expected.state, State::Running | State::Settling);
        prop_assert!(may_flow && model.is_supervised(), "{done:?}");
        let heat = model.heat();
        prop_assert!(heat.thermal_a2 <= heat.limit_a2, "{heat:?} {done:?}");
    }
    Ok(())
}

/// Each request is answered in its tick, with its number; the amplifier is enabled and reset once for each request.
fn check_requests(model: &Model, real: &TestLoop, done: &Done) -> TestCaseResult {
    let answers = done.answers.iter();
    let accepted: Vec<bool> = answers.map(|answer| answer.refusal.is_none()).collect();
    prop_assert_eq!(&accepted, &model.accepted, "{:?}", done);
    let first = real.sent() + 1 - accepted.len() as u64;
    let numbers = done.answers.iter().map(|answer| answer.id);
    prop_assert!(numbers.eq(first..=real.sent()), "{:?}", done);
    prop_assert_eq!(real.begun(), model.begun);
    Ok(())
}

/// After a tick in which the amplifier must be off, it is disabled. The model and the loop agree about the heat of the motor.
fn check_off(model: &Model, real: &TestLoop, done: &Done) -> TestCaseResult {
    if matches!(model.state, State::Disarmed | State::Tripped) {
        prop_assert!(!real.amplifier_is_enabled(), "{done:?}");
        prop_assert!(
            done.calls.command_a.is_none() || done.calls.ended_disabled,
            "{done:?}"
        );
    }
    let (real_a2, heat) = (real.thermal_a2(), model.heat());
    prop_assert!(
        (real_a2 - heat.thermal_a2).abs() < 1e-9,
        "{real_a2} {heat:?}"
    );
    Ok(())
}

#[test]
fn loop_follows_the_model_of_its_state_machine() {
    let sequences = number_from("BENCH_SEQUENCES", 2000);
    let ticks = number_from("BENCH_SEQUENCE_TICKS", 300);
    let seed = number_from("BENCH_RANDOM_SEED", 1);
    println!("{sequences} sequences of {ticks} ticks, seed {seed}");
    let mut runner = TestRunner::new(ProptestConfig {
        cases: u32::try_from(sequences).expect("less than 2^32"),
        rng_seed: RngSeed::Fixed(seed),
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let coverage = RefCell::new(Coverage::default());
    let result = runner.run(
        &(settings(), happenings(ticks)),
        |(settings, happenings)| {
            follows_the_model(settings, &happenings, ticks, &mut coverage.borrow_mut())
        },
    );
    result.unwrap_or_else(|failure| panic!("{failure}"));
    let coverage = coverage.into_inner();
    println!("{coverage:?}");
    // Otherwise the property would be tested on sequences in which nothing happens.
    let causes = CAUSES.map(|cause| coverage.causes.get(&cause).copied().unwrap_or(0));
    let least = sequences / 50;
    assert!(
        causes.iter().all(|count| *count >= least) && coverage.exchanged_runs >= least,
        "{coverage:?}"
    );
    let all_ticks = sequences * ticks;
    assert!(coverage.ticks_with_current > all_ticks / 20, "{coverage:?}");
    assert!(coverage.settling_ticks > all_ticks / 1000, "{coverage:?}");
}
