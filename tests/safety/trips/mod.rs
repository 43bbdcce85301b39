//! Every trip reason, on both sides of its limit.
mod amplifier;
mod current;
mod probe;

use bench_config::Config;
use bench_hal::Validity;
use bench_rt::arming::{State, Trip};
use bench_rt::record::{EventKind, flag};
use bench_rt::servo::Request;

use crate::safety::faulty_rig::Fault;
use crate::safety::rig::{AmplifierCall, Bench, endless, stage};

/// Tick in which a fault begins.
const AT: u64 = 100;
/// Ticks observed after a trip: 0.1 s.
const AFTER: u64 = 500;
/// A non-zero current within all limits.
const SOME_A: f64 = 0.1;

fn runs_without_trip(bench: &mut Bench, ticks: u64) {
    bench.run(ticks);
    assert_eq!(bench.trips(), [], "a trip within the limits");
    let last = bench.tick();
    assert!(
        last.state == State::Running && last.command_a != 0.0,
        "the run continues: {last:?}"
    );
}

/// Asserts that the run has current and no trip before tick `at`, and trips in it.
fn trips(bench: &mut Bench, at: u64, reason: &str) -> Trip {
    runs_without_trip(bench, at - 1);
    bench.run(1 + AFTER);
    assert_off_after_trip(bench, at, reason)
}

/// Asserts what holds for every trip: zero current, the amplifier off, one event, and a complete recording.
fn assert_off_after_trip(bench: &Bench, at: u64, reason: &str) -> Trip {
    let record = bench.ticks().at(at);
    assert_eq!(
        record.command_a.to_bits(),
        0,
        "no current in the tick of the trip: {record:?}"
    );
    assert_eq!(
        (record.state, record.flags & flag::TRIPPED),
        (State::Tripped, flag::TRIPPED),
        "{record:?}"
    );
    assert!(
        bench
            .ticks()
            .iter()
            .all(|r| (r.flags & flag::TRIPPED != 0) == (r.tick == at)),
        "exactly one tick has the flag"
    );
    assert!(
        bench
            .ticks()
            .iter()
            .filter(|r| r.tick >= at)
            .all(|r| r.command_a.to_bits() == 0)
    );

    let calls = bench.amplifier_calls();
    let has_current = |call: &AmplifierCall| matches!(call, AmplifierCall::Command { current_a, refused: false } if *current_a != 0.0);
    assert!(
        !calls
            .iter()
            .any(|(tick, call)| *tick >= at && has_current(call)),
        "a current was commanded in or after the tick of the trip"
    );
    let in_tick: Vec<AmplifierCall> = calls
        .iter()
        .filter(|(tick, _)| *tick == at)
        .map(|(_, call)| *call)
        .collect();
    assert_eq!(
        in_tick.last(),
        Some(&AmplifierCall::Disable),
        "disabled in the tick of the trip: {in_tick:?}"
    );
    assert!(
        !calls
            .iter()
            .any(|(tick, call)| *tick > at && *call != AmplifierCall::Disable),
        "only disable calls after the trip"
    );
    assert!(!bench.amplifier_is_on());

    assert_eq!(bench.trips().len(), 1, "{:?}", bench.trips());
    let EventKind::Trip(trip) = bench.trips()[0].kind else {
        unreachable!()
    };
    assert_eq!(
        (trip.reason(), bench.trips()[0].tick),
        (reason, at),
        "{trip:?}"
    );
    let tripped = |e: &bench_rt::record::Event| {
        e.tick == at
            && matches!(
                e.kind,
                EventKind::State {
                    from: State::Enabling | State::Armed | State::Running,
                    to: State::Tripped
                }
            )
    };
    assert_eq!(bench.events().iter().filter(|e| tripped(e)).count(), 1);
    assert_eq!(bench.outcome().trip, Some((trip, at)));
    bench.assert_recording_complete(at, reason);
    trip
}

/// The tick of the first trip, with `missed` ticks missed before every tick. Panics after 200,000 served ticks without a trip.
fn first_trip(bench: &mut Bench, missed: u32) -> u64 {
    for _ in 0..200_000 {
        bench.late_tick(missed);
        if let Some(trip) = bench.trips().first() {
            return trip.tick;
        }
        bench.all.drain(..bench.all.len().saturating_sub(8));
    }
    panic!("no trip");
}

fn constant() -> Box<dyn bench_rt::program::Program> {
    endless(|_| SOME_A)
}

#[test]
fn trips_above_the_allowed_missed_ticks_per_second() {
    let config = stage();
    assert_eq!(config.interlock.overruns_per_s, 50);
    for (missed, beyond) in [(vec![50], 51), (vec![20, 20, 10], 1)] {
        let late = |bench: &mut Bench| {
            for missed in &missed {
                bench.late_tick(*missed);
            }
        };
        let mut bench = Bench::running(&config, &[], constant());
        bench.run(AT);
        late(&mut bench);
        runs_without_trip(&mut bench, 10);
        let mut bench = Bench::running(&config, &[], constant());
        bench.run(AT);
        if missed.len() > 1 {
            late(&mut bench);
        }
        let at = bench.late_tick(beyond).tick;
        bench.run(AFTER);
        let trip = assert_off_after_trip(&bench, at, "overruns");
        assert_eq!(
            trip,
            Trip::Overruns {
                count: 51,
                limit: 50
            }
        );
    }
}

#[test]
fn missed_ticks_are_counted_in_a_sliding_second() {
    let config = stage();
    // 30 missed ticks every 0.6 s: at most two such gaps are within a second, which gives 60.
    let mut bench = Bench::running(&config, &[], constant());
    bench.run(AT);
    bench.late_tick(30);
    bench.run(2999 - 30);
    let at = bench.late_tick(30).tick;
    bench.run(AFTER);
    assert_off_after_trip(&bench, at, "overruns");
    // One, then 49 after 0.9 s, then 49 more 0.2 s later: the last second has 98.
    let mut bench = Bench::running(&config, &[], constant());
    bench.run(AT);
    bench.late_tick(1);
    bench.run(4500);
    bench.late_tick(49);
    bench.run(1000);
    let at = bench.late_tick(49).tick;
    bench.run(AFTER);
    let trip = assert_off_after_trip(&bench, at, "overruns");
    assert_eq!(
        trip,
        Trip::Overruns {
            count: 98,
            limit: 50
        }
    );
    // 25 every 0.505 s: at most two such gaps, 50 ticks, are within one second.
    let mut bench = Bench::running(&config, &[], constant());
    for _ in 0..20 {
        bench.late_tick(25);
        bench.run(2500);
    }
    assert_eq!(bench.trips(), []);
}

#[test]
fn armed_loop_trips_like_a_running_loop() {
    let cases = [
        (Fault::Validity(Validity::Faulty), "probe_invalid"),
        (Fault::Position(0.00095), "travel"),
        (Fault::Age(2_000_000), "probe_stale"),
        (Fault::AmplifierFault(1), "amplifier"),
        (Fault::RefusedCommand(2), "amplifier"),
    ];
    for (fault, reason) in cases {
        let mut bench = Bench::still(&stage(), &[(AT..AT + 1, fault)]);
        bench.request(Request::Arm);
        bench.run(AT);
        assert_eq!(bench.state(), State::Armed);
        bench.run(1 + AFTER);
        assert_off_after_trip(&bench, AT, reason);
    }
}

#[test]
fn disarmed_loop_records_faults_without_a_trip() {
    let faults = [
        (10..20, Fault::Validity(Validity::Missing)),
        (30..40, Fault::Position(0.00095)),
        (50..60, Fault::AmplifierFault(1)),
    ];
    let mut bench = Bench::still(&stage(), &faults);
    bench.run(AT);
    assert_eq!(
        (bench.events(), bench.amplifier_calls()),
        (Vec::new(), Vec::new())
    );
    assert_eq!(
        bench
            .ticks()
            .iter()
            .filter(|r| r.flags & flag::INVALID != 0)
            .count(),
        10
    );
}
