//! The state Enabling: no amplifier is enabled blind, nothing waits, and a stop or a trip ends it at once.
use bench_hal::Validity;
use bench_rt::arming::State;
use bench_rt::record::{EventKind, Refusal, RequestKind};
use bench_rt::servo::Request;

use crate::safety::faulty_rig::Fault;
use crate::safety::rig::{AmplifierCall, Bench, endless, stage};

/// Healthy ticks before the amplifier is enabled.
const HEALTHY: u64 = 10;
/// The tick in which the loop enables the amplifier, armed in tick 0.
const BEGIN: u64 = HEALTHY - 1;

/// A loop that is armed and started in tick 0.
fn started(faults: &[(std::ops::Range<u64>, Fault)]) -> Bench {
    Bench::running(&stage(), faults, endless(|_| 0.1)).with_healthy_ticks(HEALTHY)
}

fn enable_ticks(bench: &Bench) -> Vec<u64> {
    let calls = bench.amplifier_calls().into_iter();
    let enables = calls.filter(|(_, call)| matches!(call, AmplifierCall::Enable { .. }));
    enables.map(|(tick, _)| tick).collect()
}

/// The ticks in which a current was commanded.
fn current_ticks(bench: &Bench) -> Vec<u64> {
    let calls = bench.amplifier_calls().into_iter();
    let commands = calls.filter(
        |(_, call)| matches!(call, AmplifierCall::Command { current_a, .. } if *current_a != 0.0),
    );
    commands.map(|(tick, _)| tick).collect()
}

#[test]
fn amplifier_is_enabled_after_the_healthy_ticks() {
    let mut bench = started(&[]);
    bench.run(BEGIN);
    assert_eq!(bench.state(), State::Enabling);
    assert_eq!(bench.amplifier_calls(), []);
    bench.run(5);
    assert_eq!(bench.state(), State::Running);
    assert_eq!(enable_ticks(&bench), [BEGIN]);
    assert_eq!(
        current_ticks(&bench),
        (BEGIN..BEGIN + 5).collect::<Vec<_>>()
    );
}

#[test]
fn a_bad_reading_trips_before_the_amplifier_is_enabled() {
    let cases = [
        (Fault::Validity(Validity::Missing), "probe_invalid"),
        (Fault::Validity(Validity::Faulty), "probe_invalid"),
        (Fault::Validity(Validity::OutOfRange), "probe_invalid"),
        (Fault::Position(f64::NAN), "probe_invalid"),
        (Fault::Position(0.5), "travel"),
        (Fault::Age(1_000_000_000), "probe_stale"),
        (Fault::AmplifierFault(7), "amplifier"),
    ];
    for (fault, reason) in cases {
        for at in 0..HEALTHY {
            let mut bench = started(&[(at..at + 1, fault)]);
            bench.run(3 * HEALTHY);
            assert_eq!(bench.state(), State::Tripped, "{fault:?}");
            assert_eq!(
                (enable_ticks(&bench), current_ticks(&bench)),
                (vec![], vec![]),
                "{fault:?}"
            );
            assert_eq!(bench.returned_programs, 1, "{fault:?}");
            let trips: Vec<_> = bench.trips().iter().map(|trip| trip.tick).collect();
            assert_eq!(trips, [at], "{fault:?}");
            bench.assert_recording_complete(at, reason);
        }
    }
}

#[test]
fn a_slow_amplifier_is_waited_for_without_missing_a_tick() {
    let mut bench = started(&[(0..60, Fault::PendingEnable)]);
    bench.run(60);
    assert_eq!(bench.state(), State::Enabling);
    assert!(bench.ticks().iter().all(|record| record.command_a == 0.0));
    bench.run(10);
    assert_eq!(enable_ticks(&bench), [BEGIN]);
    assert_eq!(current_ticks(&bench), (60..70).collect::<Vec<_>>());
    let ticks: Vec<_> = bench.ticks().iter().map(|record| record.tick).collect();
    assert_eq!(ticks, (0..70).collect::<Vec<_>>());
}

#[test]
fn a_stop_while_enabling_acts_in_its_tick() {
    // 5: the readings are being judged; 20: the amplifier is being enabled.
    for (at, has_begun) in [(5, false), (20, true)] {
        for request in [|| Request::Stop, || Request::Finish] {
            let mut bench = started(&[(0..30, Fault::PendingEnable)]);
            bench.run(at);
            assert_eq!(bench.state(), State::Enabling);
            bench.request(request());
            assert_eq!(bench.tick().state, State::Disarmed);
            let last = bench.amplifier_calls().last().copied();
            assert_eq!(last, Some((at, AmplifierCall::Disable)));
            bench.run(100);
            assert_eq!(bench.state(), State::Disarmed);
            assert_eq!(enable_ticks(&bench).len(), usize::from(has_begun));
            assert_eq!(
                (current_ticks(&bench), bench.returned_programs),
                (vec![], 1)
            );
        }
    }
}

#[test]
fn a_fault_while_the_amplifier_is_being_enabled_trips_in_its_tick() {
    let cases = [
        (Fault::Validity(Validity::Faulty), "probe_invalid"),
        (Fault::Position(0.5), "travel"),
        (Fault::AmplifierFault(7), "amplifier"),
        (Fault::FailedEnable(8), "amplifier"),
    ];
    for (fault, reason) in cases {
        let mut bench = started(&[(20..21, fault), (0..30, Fault::PendingEnable)]);
        bench.run(100);
        assert_eq!(bench.state(), State::Tripped, "{fault:?}");
        let last = bench.amplifier_calls().last().copied();
        assert_eq!(last, Some((20, AmplifierCall::Disable)), "{fault:?}");
        assert_eq!(
            (current_ticks(&bench), bench.returned_programs),
            (vec![], 1),
            "{fault:?}"
        );
        bench.assert_recording_complete(20, reason);
    }
}

#[test]
fn healthy_ticks_are_counted_again_after_each_request_to_arm() {
    let mut bench = started(&[]);
    bench.run(BEGIN);
    bench.request(Request::Stop);
    bench.request(Request::Arm);
    bench.run(BEGIN);
    assert_eq!(
        (bench.state(), enable_ticks(&bench)),
        (State::Enabling, vec![])
    );
    bench.run(1);
    assert_eq!(
        (bench.state(), enable_ticks(&bench)),
        (State::Armed, vec![2 * BEGIN])
    );
}

#[test]
fn a_second_program_does_not_replace_the_one_that_waits() {
    let mut bench = started(&[]);
    bench.request(Request::Start(endless(|_| 5.0)));
    bench.run(2 * HEALTHY);
    assert_eq!(bench.returned_programs, 1);
    assert!(bench.ticks().iter().all(|record| record.command_a <= 0.1));
}

/// Why each refused request to arm was refused.
fn refused_arms(bench: &Bench) -> Vec<Refusal> {
    let events = bench.events();
    let arms = events.iter().filter_map(|event| match event.kind {
        EventKind::Request(request) if request.kind == RequestKind::Arm => request.refusal,
        _ => None,
    });
    arms.collect()
}

#[test]
fn the_loop_stays_tripped_until_the_amplifier_has_reset_its_fault() {
    for (end, expected) in [
        (Fault::PendingClear, State::Disarmed),
        (Fault::FailedClear, State::Tripped),
    ] {
        let faults = [
            (50..51, Fault::AmplifierFault(5)),
            (60..90, Fault::PendingClear),
            (90..91, end),
        ];
        let mut bench = started(&faults);
        bench.run(60);
        bench.request(Request::Clear);
        bench.request(Request::Arm);
        bench.run(30);
        assert_eq!(bench.state(), State::Tripped);
        bench.run(10);
        assert_eq!(bench.state(), expected, "{end:?}");
        let cleared = |kind: &EventKind| {
            matches!(
                kind,
                EventKind::State {
                    from: State::Tripped,
                    to: State::Disarmed
                }
            )
        };
        let clears = bench
            .events()
            .iter()
            .filter(|event| cleared(&event.kind))
            .count();
        assert_eq!(clears, usize::from(expected == State::Disarmed));
        let failed = |kind: &EventKind| matches!(kind, EventKind::ResetFailed { code: 6, .. });
        let failures = bench
            .events()
            .iter()
            .filter(|event| failed(&event.kind))
            .count();
        assert_eq!(failures, usize::from(expected == State::Tripped));
        assert_eq!(
            refused_arms(&bench),
            [Refusal::Tripped],
            "Arm in the tick of Clear"
        );
        assert_eq!(enable_ticks(&bench), [BEGIN]);
    }
}
