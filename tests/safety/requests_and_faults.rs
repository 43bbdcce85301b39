//! Random sequences of requests and faults: current flows only in a run that was armed and started after the last trip.
use std::ops::Range;

use bench_hal::Validity;
use bench_rt::arming::State;
use bench_rt::record::{Event, EventKind, flag};
use bench_rt::servo::Request;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use crate::safety::faulty_rig::Fault;
use crate::safety::rig::{AmplifierCall, Bench, CurrentProgram, stage};

const TICKS: u64 = 80;

/// A request as a value that proptest can generate.
#[derive(Clone, Copy, Debug)]
enum RandomRequest {
    Arm,
    /// A program with a constant current in amperes and a number of ticks.
    Start(f64, u64),
    Finish,
    Stop,
    Clear,
}

fn requests() -> impl Strategy<Value = Vec<(u64, RandomRequest)>> {
    let current = prop_oneof![
        8 => -5.0..5.0f64,
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(11.0),
    ];
    let request = prop_oneof![
        4 => Just(RandomRequest::Arm),
        4 => (current, 1..40u64).prop_map(|(a, ticks)| RandomRequest::Start(a, ticks)),
        1 => Just(RandomRequest::Finish),
        1 => Just(RandomRequest::Stop),
        3 => Just(RandomRequest::Clear),
    ];
    prop::collection::vec((0..TICKS, request), 0..40)
}

fn faults() -> impl Strategy<Value = Vec<(Range<u64>, Fault)>> {
    let fault = prop_oneof![
        Just(Fault::Validity(Validity::Faulty)),
        Just(Fault::Validity(Validity::OutOfRange)),
        Just(Fault::Position(f64::NAN)),
        Just(Fault::Position(0.00095)),
        Just(Fault::Age(2_000_000)),
        Just(Fault::RepeatedSample),
        Just(Fault::Stuck),
        Just(Fault::AmplifierFault(9)),
        Just(Fault::RefusedCommand(8)),
        Just(Fault::RefusedEnable(7)),
    ];
    prop::collection::vec(
        (0..TICKS, 1..12u64, fault).prop_map(|(at, ticks, f)| (at..at + ticks, f)),
        0..4,
    )
}

fn late() -> impl Strategy<Value = Vec<(u64, u32)>> {
    prop::collection::vec((0..TICKS, 1..60u32), 0..3)
}

fn run(
    requests: &[(u64, RandomRequest)],
    faults: &[(Range<u64>, Fault)],
    late: &[(u64, u32)],
    ramp_ticks: u64,
) -> Bench {
    let mut bench = Bench::still(&stage(), faults).with_ramps(ramp_ticks);
    for step in 0..TICKS {
        // The request ring has 16 slots.
        for (_, request) in requests.iter().filter(|(at, _)| *at == step).take(16) {
            bench.request(match *request {
                RandomRequest::Arm => Request::Arm,
                RandomRequest::Start(current_a, ticks) => {
                    Request::Start(Box::new(CurrentProgram(move |_| current_a, ticks)))
                }
                RandomRequest::Finish => Request::Finish,
                RandomRequest::Stop => Request::Stop,
                RandomRequest::Clear => Request::Clear,
            });
        }
        bench.late_tick(
            late.iter()
                .find(|(at, _)| *at == step)
                .map_or(0, |(_, missed)| *missed),
        );
        let off = matches!(bench.state(), State::Disarmed | State::Tripped);
        assert_eq!(
            bench.amplifier_is_on(),
            !off,
            "the amplifier is on in {:?}",
            bench.state()
        );
    }
    bench
}

/// Whether a current may flow after these events. Written from the requirement, independently of the state machine.
fn may_flow(events: &[Event]) -> bool {
    let place =
        |wanted: &dyn Fn(&EventKind) -> bool| events.iter().rposition(|event| wanted(&event.kind));
    let state =
        |wanted: State| place(&|kind| matches!(kind, EventKind::State { to, .. } if *to == wanted));
    let trip = place(&|kind| matches!(kind, EventKind::Trip(_)));
    let clear = place(&|kind| {
        matches!(
            kind,
            EventKind::State {
                from: State::Tripped,
                to: State::Disarmed
            }
        )
    });
    let (armed, running) = (state(State::Armed), state(State::Running));
    let off = state(State::Disarmed).max(state(State::Tripped));
    trip <= clear && armed > trip.max(clear).max(off) && running > armed
}

fn check_run(bench: &Bench) -> Result<(), TestCaseError> {
    let (calls, events) = (bench.amplifier_calls(), bench.events());
    for record in bench.ticks().iter() {
        // Completion is published after the record of its tick; everything else before it.
        let until = events.iter().filter(|e| e.tick <= record.tick).count();
        let completed = events[..until]
            .iter()
            .rposition(|e| e.kind == EventKind::Completed && e.tick == record.tick);
        let known = &events[..completed.unwrap_or(until)];
        let has_current = calls.iter().any(|(tick, call)| {
            *tick == record.tick
                && matches!(call, AmplifierCall::Command { current_a, refused: false } if *current_a != 0.0)
        });
        let beyond_peak = calls.iter().any(|(tick, call)| {
            *tick == record.tick
                && matches!(call, AmplifierCall::Command { current_a, .. } if !(-9.99..=9.99).contains(current_a))
        });
        prop_assert!(!beyond_peak, "beyond the motor's peak: {record:?}");
        if has_current {
            prop_assert!(matches!(record.state, State::Running | State::Settling));
            prop_assert_eq!(record.flags & flag::TRIPPED, 0);
            prop_assert!(may_flow(known), "{:?} after {:?}", record, known);
        }
        prop_assert_eq!(record.command_a != 0.0, has_current, "{:?}", record);
    }
    let numbers: Vec<u64> = bench.ticks().iter().map(|r| r.tick + 1).collect();
    let missed: u64 = bench
        .ticks()
        .iter()
        .map(|r| u64::from(r.missed_ticks))
        .sum();
    prop_assert_eq!(
        numbers.len() as u64 + missed,
        *numbers.last().expect("ticks")
    );
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2000,
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn current_flows_only_after_arm_and_start_since_the_last_trip(
        requests in requests(), faults in faults(), late in late(), ramp_ticks in 0..12u64,
    ) {
        check_run(&run(&requests, &faults, &late, ramp_ticks))?;
    }
}

#[test]
fn generators_cover_runs_trips_clears_and_completions() {
    // Otherwise the property would be tested on runs in which nothing happens.
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig {
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let (mut with_current, mut trips, mut second_runs, mut completed) = (0, 0, 0, 0);
    let mut settling = 0;
    for _ in 0..500 {
        let tree = (requests(), faults(), late())
            .new_tree(&mut runner)
            .expect("generators without filters");
        let (requests, faults, late) = proptest::strategy::ValueTree::current(&tree);
        let bench = run(&requests, &faults, &late, 5);
        settling += usize::from(
            bench
                .ticks()
                .iter()
                .any(|r| r.state == State::Settling && r.command_a != 0.0),
        );
        let events = bench.events();
        let trip = events
            .iter()
            .position(|e| matches!(e.kind, EventKind::Trip(_)));
        let is_start = |e: &Event| {
            matches!(
                e.kind,
                EventKind::State {
                    to: State::Running,
                    ..
                }
            )
        };
        with_current += usize::from(bench.ticks().iter().any(|r| r.command_a != 0.0));
        trips += usize::from(trip.is_some());
        second_runs += usize::from(trip.is_some_and(|trip| events[trip..].iter().any(is_start)));
        completed += usize::from(events.iter().any(|e| e.kind == EventKind::Completed));
    }
    assert!(
        [with_current, trips, second_runs, completed, settling]
            .iter()
            .all(|n| *n >= 25),
        "of 500: {with_current} with current, {trips} trips, {second_runs} runs after one, {completed} completed, {settling} settling with current"
    );
}

#[test]
fn virtual_pace_loses_no_message_with_a_full_request_ring() {
    // A full request ring with as many events as possible: the last run starts, and its first command is refused.
    let mut bench = Bench::still(&stage(), &[(0..10, Fault::RefusedCommand(1))]);
    bench.tick();
    for _ in 0..7 {
        bench.request(Request::Arm);
        bench.request(Request::Stop);
    }
    bench.request(Request::Arm);
    bench.request(Request::Start(crate::safety::rig::endless(|_| 0.1)));
    let before = bench.all.len();
    bench.tick();
    let published = bench.all.len() - before;
    assert!(
        published <= bench_rt::publisher::SLOTS_PER_TICK,
        "{published} in one tick"
    );
    // Request and state for each request except the last, which waits; armed, running, trip, tripped; then the record.
    assert_eq!(published, 15 * 2 + 1 + 4 + 1);
}
