//! Trips by the reading: travel, validity, age, and a constant position.
use super::*;

#[test]
fn allows_travel_up_to_the_soft_limit_and_trips_one_bit_beyond() {
    let config = stage();
    for side in [1.0, -1.0] {
        let limit_m = config.interlock.soft_limit_m;
        let faults = [(AT..AT + 200, Fault::Position(side * limit_m))];
        runs_without_trip(&mut Bench::running(&config, &faults, constant()), AT + 400);
        let beyond_m = side * limit_m.next_up();
        let mut bench = Bench::running(
            &config,
            &[(AT..AT + 1, Fault::Position(beyond_m))],
            constant(),
        );
        let trip = trips(&mut bench, AT, "travel");
        assert_eq!(
            trip,
            Trip::Travel {
                position_m: beyond_m,
                limit_m
            }
        );
    }
}

#[test]
fn invalid_reading_trips_at_any_position() {
    for validity in [Validity::OutOfRange, Validity::Faulty, Validity::Missing] {
        let mut bench = Bench::running(
            &stage(),
            &[(AT..AT + 1, Fault::Validity(validity))],
            constant(),
        );
        trips(&mut bench, AT, "probe_invalid");
        let record = bench.ticks().at(AT);
        assert_eq!(
            (record.validity, record.flags & flag::INVALID),
            (validity, flag::INVALID)
        );
    }
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut bench = Bench::running(
            &stage(),
            &[(AT..AT + 1, Fault::Position(value))],
            constant(),
        );
        trips(&mut bench, AT, "probe_invalid");
    }
    runs_without_trip(
        &mut Bench::running(
            &stage(),
            &[(AT..AT + 1, Fault::Validity(Validity::Valid))],
            constant(),
        ),
        AT + 10,
    );
}

#[test]
fn allows_the_stale_limit_and_trips_one_nanosecond_above() {
    // interlock.probe_stale_s = 1 ms.
    let config = stage();
    assert_eq!(config.interlock.probe_stale_s, 0.001);
    runs_without_trip(
        &mut Bench::running(&config, &[(AT..AT + 50, Fault::Age(1_000_000))], constant()),
        AT + 100,
    );
    let faults = [(AT..AT + 1, Fault::Age(1_000_001))];
    let trip = trips(
        &mut Bench::running(&config, &faults, constant()),
        AT,
        "probe_stale",
    );
    let Trip::ProbeStale { age_s, limit_s } = trip else {
        panic!("{trip:?}")
    };
    assert!(
        (age_s - 0.001000001).abs() < 1e-15 && (limit_s - 0.001).abs() < 1e-15,
        "{trip:?}"
    );
}

#[test]
fn repeated_measurement_trips_as_stale_independent_of_stated_age() {
    // The last new measurement is at tick 99. 1 ms are five ticks of 0.2 ms, so tick 104 is the last one that may use it.
    let config = stage();
    runs_without_trip(
        &mut Bench::running(&config, &[(AT..AT + 5, Fault::RepeatedSample)], constant()),
        AT + 100,
    );
    let trip = trips(
        &mut Bench::running(&config, &[(AT..AT + 50, Fault::RepeatedSample)], constant()),
        AT + 5,
        "probe_stale",
    );
    let Trip::ProbeStale { age_s, .. } = trip else {
        panic!("{trip:?}")
    };
    assert!((age_s - 0.0012).abs() < 1e-12, "six ticks old: {trip:?}");
}

/// A current step within the time in which the position may be constant.
fn stepping(from_a: f64, to_a: f64) -> Box<dyn bench_rt::program::Program> {
    endless(move |tick| if tick < AT + 50 { from_a } else { to_a })
}

#[test]
fn constant_position_under_changing_current_trips_as_stuck() {
    // probe_stuck_s = 0.1 s is 500 ticks. The last change is at tick 99, so tick 599 is within the limit and tick 600 beyond.
    let mut config = stage();
    assert_eq!(config.interlock.probe_stuck_s, 0.1);
    config.interlock.probe_stuck_current_a = 0.25;
    let stuck = |ticks: u64| [(AT..AT + ticks, Fault::Stuck)];
    runs_without_trip(
        &mut Bench::running(&config, &stuck(500), stepping(SOME_A, 0.5)),
        AT + 1000,
    );
    let trip = trips(
        &mut Bench::running(&config, &stuck(1000), stepping(SOME_A, 0.5)),
        AT + 500,
        "probe_stuck",
    );
    let Trip::ProbeStuck {
        unchanged_s,
        limit_s,
    } = trip
    else {
        panic!("{trip:?}")
    };
    assert!(
        (unchanged_s - 0.1002).abs() < 1e-12 && (limit_s - 0.1).abs() < 1e-12,
        "{trip:?}"
    );
    // A change of 0.25 A is exact in binary: no trip at the limit, a trip one bit above.
    runs_without_trip(
        &mut Bench::running(&config, &stuck(1000), stepping(0.25, 0.5)),
        AT + 1500,
    );
    trips(
        &mut Bench::running(&config, &stuck(1000), stepping(0.25, 0.5f64.next_up())),
        AT + 500,
        "probe_stuck",
    );
    trips(
        &mut Bench::running(&config, &stuck(1000), stepping(0.125, -0.25)),
        AT + 500,
        "probe_stuck",
    );
}
