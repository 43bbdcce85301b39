//! Every reason to trip, from both sides of its limit.
use bench::config::Config;
use bench::rt::arming::{State, Trip};
use bench::rt::record::{EventKind, flag};
use bench::rt::servo::Request;
use bench_hal::Validity;

use crate::faulty_rig::Fault;
use crate::rig::{Bench, Told, says, stage};

/// When faults begin, unless a test says otherwise.
const AT: u64 = 100;
/// Ticks watched after a trip: a tenth of a second.
const AFTER: u64 = 500;
/// A current that disturbs no interlock, but is none.
const SOME_A: f64 = 0.1;

fn nothing_trips(bench: &mut Bench, ticks: u64) {
    bench.run(ticks);
    assert_eq!(bench.trips(), [], "nothing may trip inside the limits");
    let last = bench.tick();
    assert!(
        last.state == State::Running && last.command_a != 0.0,
        "the run goes on: {last:?}"
    );
}

/// Runs up to the tick `at` with current and without a trip, through it, and on: there it must trip.
fn trips(bench: &mut Bench, at: u64, reason: &str) -> Trip {
    nothing_trips(bench, at - 1);
    bench.run(1 + AFTER);
    prove_that_it_is_off(bench, at, reason)
}

/// What every trip promises, whatever its reason.
fn prove_that_it_is_off(bench: &Bench, at: u64, reason: &str) -> Trip {
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
        "one tick is flagged"
    );
    assert!(
        bench
            .ticks()
            .iter()
            .filter(|r| r.tick >= at)
            .all(|r| r.command_a.to_bits() == 0)
    );

    let told = bench.told();
    let taken = |told: &Told| matches!(told, Told::Command { current_a, refused: false } if *current_a != 0.0);
    assert!(
        !told.iter().any(|(tick, told)| *tick >= at && taken(told)),
        "a current went out in or after the trip"
    );
    let in_tick: Vec<Told> = told
        .iter()
        .filter(|(tick, _)| *tick == at)
        .map(|(_, told)| *told)
        .collect();
    assert_eq!(
        in_tick.last(),
        Some(&Told::Disable),
        "disabled in the tick of the trip: {in_tick:?}"
    );
    assert!(
        !told
            .iter()
            .any(|(tick, told)| *tick > at && *told != Told::Disable),
        "left alone after it"
    );
    assert!(!bench.is_on());

    assert_eq!(bench.trips().len(), 1, "{:?}", bench.trips());
    let EventKind::Trip(trip) = bench.trips()[0].kind else {
        unreachable!()
    };
    assert_eq!(
        (trip.reason(), bench.trips()[0].tick),
        (reason, at),
        "{trip:?}"
    );
    let tripped = |e: &bench::rt::record::Event| {
        e.tick == at
            && matches!(
                e.kind,
                EventKind::State {
                    from: State::Armed | State::Running,
                    to: State::Tripped
                }
            )
    };
    assert_eq!(bench.events().iter().filter(|e| tripped(e)).count(), 1);
    assert_eq!(bench.servo().last_trip(), Some((trip, at)));
    bench.prove_that_the_recording_is_complete(at, reason);
    trip
}

/// The tick of the first trip, every tick being late by so many; none within 40 s is a failure.
fn first_trip(bench: &mut Bench, missed: u32) -> u64 {
    for _ in 0..200_000 {
        bench.late_tick(missed);
        if let Some(trip) = bench.trips().first() {
            return trip.tick;
        }
        bench.all.drain(..bench.all.len().saturating_sub(8));
    }
    panic!("nothing trips");
}

fn constant() -> Box<dyn bench::rt::program::Program> {
    says(|_| SOME_A)
}

#[test]
fn travel_up_to_the_soft_limit_runs_on_and_one_bit_beyond_it_trips() {
    let config = stage();
    for side in [1.0, -1.0] {
        let limit_m = config.interlock.soft_limit_m;
        let faults = [(AT..AT + 200, Fault::At(side * limit_m))];
        nothing_trips(&mut Bench::running(&config, &faults, constant()), AT + 400);
        let beyond_m = side * limit_m.next_up();
        let mut bench = Bench::running(&config, &[(AT..AT + 1, Fault::At(beyond_m))], constant());
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
fn a_command_of_the_peak_current_goes_out_and_one_bit_more_trips() {
    let config = stage();
    let limit_a = config.motor.peak_current_a();
    for side in [1.0, -1.0] {
        let spike = |peak_a: f64| says(move |tick| if tick == AT { side * peak_a } else { SOME_A });
        let mut bench = Bench::running(&config, &[], spike(limit_a));
        nothing_trips(&mut bench, AT + 100);
        assert_eq!(bench.ticks().at(AT).command_a, side * limit_a);
        let trip = trips(
            &mut Bench::running(&config, &[], spike(limit_a.next_up())),
            AT,
            "peak_current",
        );
        assert_eq!(
            trip,
            Trip::PeakCurrent {
                command_a: side * limit_a.next_up(),
                limit_a
            }
        );
    }
}

#[test]
fn continuous_current_trips_when_the_winding_is_warm_by_the_closed_form_and_not_a_tick_before() {
    let config = stage();
    let (rated_a, tau_s) = (
        config.motor.continuous_current_a(),
        config.motor.thermal_time_constant_s,
    );
    for current_a in [2.4, -3.0, 5.0, 9.9] {
        // tau q' = i^2 - q from q = 0 reaches i_c^2 at t = -tau ln(1 - (i_c/i)^2). The loop takes Euler's steps of c = T/tau:
        // (1 - c)^n = exp(-t/tau) has n = (t/T) c/-ln(1 - c) = (t/T)(1 - c/2), at most 1.5 ticks of 150,000 fewer. The
        // command of tick k heats until the end of its period, so the tick that is refused is the one with k < n <= k + 1.
        let (period_s, square) = (
            config.servo.period_s(),
            (rated_a / current_a) * (rated_a / current_a),
        );
        let warm_s = -tau_s * f64::ln(1.0 - square);
        let n = warm_s / period_s * (1.0 - period_s / tau_s / 2.0);
        let mut bench = Bench::running(&config, &[], says(move |_| current_a));
        let at = first_trip(&mut bench, 0) as f64;
        assert!(
            (n - 1.01..=n + 0.01).contains(&at),
            "{current_a} A: tick {at}, warm after {n} ticks"
        );
    }
}

#[test]
fn the_trip_by_continuous_current_is_as_safe_as_any_other() {
    // 9.9 A and 2.338 A: 0.574 s, tick 2869 by the closed form of the test above.
    let config = stage();
    let rated_a = config.motor.continuous_current_a();
    let warm_s =
        -config.motor.thermal_time_constant_s * f64::ln(1.0 - (rated_a / 9.9) * (rated_a / 9.9));
    let at = (warm_s / config.servo.period_s() - 1.0).ceil() as u64;
    let trip = trips(
        &mut Bench::running(&config, &[], says(|_| 9.9)),
        at,
        "continuous_current",
    );
    let Trip::ContinuousCurrent { thermal_a, limit_a } = trip else {
        panic!("{trip:?}")
    };
    // One tick heats by 98 A^2/50,000 = 0.002 A^2, that is 0.0004 A.
    assert!(
        limit_a == rated_a && thermal_a > limit_a && thermal_a < limit_a + 0.0005,
        "{trip:?}"
    );
}

#[test]
fn the_rated_current_flows_for_ever() {
    let config = stage();
    let rated_a = config.motor.continuous_current_a();
    let mut bench = Bench::running(&config, &[], says(move |_| rated_a * 0.9999));
    // Six time constants: the heat is at 99.75 % of where it settles.
    for _ in 0..300_000 {
        let record = bench.tick();
        assert_eq!((record.state, bench.trips().len()), (State::Running, 0));
        bench.all.drain(..bench.all.len().saturating_sub(4));
    }
}

#[test]
fn a_command_that_is_not_finite_is_no_current_and_a_trip() {
    for nonsense in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -f64::NAN] {
        let program = says(move |tick| if tick == AT { nonsense } else { SOME_A });
        let mut bench = Bench::running(&stage(), &[], program);
        trips(&mut bench, AT, "command_not_finite");
        let asked = bench
            .told()
            .iter()
            .any(|(_, t)| matches!(t, Told::Command { current_a, .. } if !current_a.is_finite()));
        assert!(!asked, "the amplifier never saw it");
        let largest = Bench::running(
            &stage(),
            &[],
            says(|tick| {
                if tick == AT {
                    f64::MIN_POSITIVE
                } else {
                    SOME_A
                }
            }),
        );
        nothing_trips(&mut { largest }, AT + 10);
    }
}

#[test]
fn a_reading_that_is_not_valid_trips_whatever_its_position() {
    for validity in [Validity::OutOfRange, Validity::Faulty, Validity::Missing] {
        let mut bench =
            Bench::running(&stage(), &[(AT..AT + 1, Fault::Says(validity))], constant());
        trips(&mut bench, AT, "probe_invalid");
        let record = bench.ticks().at(AT);
        assert_eq!(
            (record.validity, record.flags & flag::INVALID),
            (validity, flag::INVALID)
        );
    }
    for nonsense in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut bench = Bench::running(&stage(), &[(AT..AT + 1, Fault::At(nonsense))], constant());
        trips(&mut bench, AT, "probe_invalid");
    }
    nothing_trips(
        &mut Bench::running(
            &stage(),
            &[(AT..AT + 1, Fault::Says(Validity::Valid))],
            constant(),
        ),
        AT + 10,
    );
}

#[test]
fn a_reading_as_old_as_allowed_is_used_and_one_nanosecond_older_trips() {
    // interlock.probe_stale_s = 1 ms.
    let config = stage();
    assert_eq!(config.interlock.probe_stale_s, 0.001);
    nothing_trips(
        &mut Bench::running(&config, &[(AT..AT + 50, Fault::Old(1_000_000))], constant()),
        AT + 100,
    );
    let faults = [(AT..AT + 1, Fault::Old(1_000_001))];
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
fn a_probe_that_repeats_its_last_measurement_trips_when_that_is_too_old_whatever_age_it_claims() {
    // Last new measurement at tick 99; 1 ms are five ticks of 0.2 ms: tick 104 is the last that may use it.
    let config = stage();
    nothing_trips(
        &mut Bench::running(&config, &[(AT..AT + 5, Fault::Frozen)], constant()),
        AT + 100,
    );
    let trip = trips(
        &mut Bench::running(&config, &[(AT..AT + 50, Fault::Frozen)], constant()),
        AT + 5,
        "probe_stale",
    );
    let Trip::ProbeStale { age_s, .. } = trip else {
        panic!("{trip:?}")
    };
    assert!((age_s - 0.0012).abs() < 1e-12, "six ticks old: {trip:?}");
}

/// A current that steps from one to another in the middle of the time that a probe may be stuck.
fn stepping(from_a: f64, to_a: f64) -> Box<dyn bench::rt::program::Program> {
    says(move |tick| if tick < AT + 50 { from_a } else { to_a })
}

#[test]
fn a_position_that_does_not_move_while_the_current_does_trips_after_the_time_allowed() {
    // interlock: 0.1 s are 500 ticks; the last change is seen at tick 99, so tick 599 is within and tick 600 beyond.
    let mut config = stage();
    assert_eq!(config.interlock.probe_stuck_s, 0.1);
    config.interlock.probe_stuck_current_a = 0.25;
    let stuck = |ticks: u64| [(AT..AT + ticks, Fault::Stuck)];
    nothing_trips(
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
    // Changes of 0.25 A are exact in binary: at the limit nothing trips, one bit beyond it does.
    nothing_trips(
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

#[test]
fn as_many_missed_ticks_as_allowed_in_a_second_run_on_and_one_more_trips() {
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
        nothing_trips(&mut bench, 10);
        let mut bench = Bench::running(&config, &[], constant());
        bench.run(AT);
        if missed.len() > 1 {
            late(&mut bench);
        }
        let at = bench.late_tick(beyond).tick;
        bench.run(AFTER);
        let trip = prove_that_it_is_off(&bench, at, "overruns");
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
fn overruns_are_counted_over_any_second_wherever_it_begins() {
    let config = stage();
    // 30 ticks missed every 0.6 s: at most two such moments lie within a second, 60 ticks.
    let mut bench = Bench::running(&config, &[], constant());
    bench.run(AT);
    bench.late_tick(30);
    bench.run(2999 - 30);
    let at = bench.late_tick(30).tick;
    bench.run(AFTER);
    prove_that_it_is_off(&bench, at, "overruns");
    // One, then 49 after 0.9 s, then 49 more 0.2 s later: within the last second there are 98.
    let mut bench = Bench::running(&config, &[], constant());
    bench.run(AT);
    bench.late_tick(1);
    bench.run(4500);
    bench.late_tick(49);
    bench.run(1000);
    let at = bench.late_tick(49).tick;
    bench.run(AFTER);
    let trip = prove_that_it_is_off(&bench, at, "overruns");
    assert_eq!(
        trip,
        Trip::Overruns {
            count: 98,
            limit: 50
        }
    );
    // 25 every 0.505 s: never more than two such moments, 50 ticks, within one second.
    let mut bench = Bench::running(&config, &[], constant());
    for _ in 0..20 {
        bench.late_tick(25);
        bench.run(2500);
    }
    assert_eq!(bench.trips(), []);
}

#[test]
fn a_fault_of_the_amplifier_trips_with_the_code_of_the_device() {
    let faults = [(AT..AT + 1, Fault::Faulted(0x2310))];
    let trip = trips(
        &mut Bench::running(&stage(), &faults, constant()),
        AT,
        "amplifier",
    );
    assert!(
        matches!(trip, Trip::Amplifier { code: 0x2310, .. }),
        "{trip:?}"
    );
}

#[test]
fn an_amplifier_that_refuses_a_command_is_switched_off_in_that_tick() {
    let mut bench = Bench::running(&stage(), &[(AT..AT + 1, Fault::Refuses(-7))], constant());
    assert!(matches!(
        trips(&mut bench, AT, "amplifier"),
        Trip::Amplifier { code: -7, .. }
    ));
    let in_tick: Vec<Told> = bench
        .told()
        .iter()
        .filter(|(tick, _)| *tick == AT)
        .map(|(_, told)| *told)
        .collect();
    assert_eq!(
        in_tick,
        [
            Told::Command {
                current_a: SOME_A,
                refused: true
            },
            Told::Disable
        ]
    );
    assert_eq!(
        bench.ticks().at(AT).requested_a,
        SOME_A,
        "the record says what was asked for"
    );
}

#[test]
fn an_amplifier_that_claims_to_give_what_is_no_number_is_switched_off() {
    for nonsense in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut bench = Bench::running(
            &stage(),
            &[(AT..AT + 1, Fault::Gives(nonsense))],
            constant(),
        );
        nothing_trips(&mut bench, AT - 1);
        bench.run(1 + AFTER);
        // The command went out before the answer came: the record shows zero, the amplifier is disabled in the same tick.
        assert_eq!(bench.ticks().at(AT).command_a.to_bits(), 0);
        assert_eq!((bench.state(), bench.is_on()), (State::Tripped, false));
        assert_eq!((bench.trips().len(), bench.trips()[0].tick), (1, AT));
        let EventKind::Trip(trip) = bench.trips()[0].kind else {
            unreachable!()
        };
        assert_eq!(trip.reason(), "amplifier");
        let told = bench.told();
        assert!(
            !told
                .iter()
                .any(|(tick, told)| *tick > AT && *told != Told::Disable)
        );
        assert_eq!(
            told.iter().rev().find(|(tick, _)| *tick == AT),
            Some(&(AT, Told::Disable))
        );
    }
}

#[test]
fn an_amplifier_that_cannot_be_enabled_trips_and_the_program_behind_it_does_not_start() {
    let mut bench = Bench::still(&stage(), &[(AT..AT + 1, Fault::DoesNotEnable(31))]);
    bench.run(AT);
    bench.order(Request::Arm);
    bench.order(Request::Start(constant()));
    bench.run(1 + AFTER);
    assert!(matches!(
        prove_that_it_is_off(&bench, AT, "amplifier"),
        Trip::Amplifier { code: 31, .. }
    ));
    assert_eq!(bench.handed_back, 1, "the program is handed back unused");
}

#[test]
fn an_armed_loop_without_a_program_trips_as_a_running_one() {
    let cases = [
        (Fault::Says(Validity::Faulty), "probe_invalid"),
        (Fault::At(0.00095), "travel"),
        (Fault::Old(2_000_000), "probe_stale"),
        (Fault::Faulted(1), "amplifier"),
        (Fault::Refuses(2), "amplifier"),
    ];
    for (fault, reason) in cases {
        let mut bench = Bench::still(&stage(), &[(AT..AT + 1, fault)]);
        bench.order(Request::Arm);
        bench.run(AT);
        assert_eq!(bench.state(), State::Armed);
        bench.run(1 + AFTER);
        prove_that_it_is_off(&bench, AT, reason);
    }
}

#[test]
fn a_disarmed_loop_reads_and_records_whatever_the_probe_says_and_does_not_trip() {
    let faults = [
        (10..20, Fault::Says(Validity::Missing)),
        (30..40, Fault::At(0.00095)),
        (50..60, Fault::Faulted(1)),
    ];
    let mut bench = Bench::still(&stage(), &faults);
    bench.run(AT);
    assert_eq!((bench.events(), bench.told()), (Vec::new(), Vec::new()));
    assert_eq!(
        bench
            .ticks()
            .iter()
            .filter(|r| r.flags & flag::INVALID != 0)
            .count(),
        10
    );
}

#[test]
fn a_hot_motor_stays_hot_through_clear_and_arm() {
    // Tripped at i_c; from there the same current trips again at once, long before a cold winding would.
    let config: Config = stage();
    let mut bench = Bench::running(&config, &[], says(|_| 9.9));
    let first = first_trip(&mut bench, 0);
    for order in [Request::Clear, Request::Arm, Request::Start(says(|_| 9.9))] {
        bench.order(order);
    }
    // The tick of the trip cooled the winding by i_c^2/50,000, one of 9.9 A heats it 17 times as much: one at most passes.
    bench.run(3);
    assert_eq!(bench.trips().len(), 2);
    assert!(bench.trips()[1].tick <= first + 2, "{:?}", bench.trips());
}

#[test]
fn current_that_flows_through_missed_ticks_heats_the_motor_as_well() {
    // 9.9 A with three of four ticks missed: the winding warms by the clock, not by the ticks that were served. Overruns
    // are allowed here. Closed form as above; what is seen only every fourth tick may be seen three ticks late.
    let mut config = stage();
    config.interlock.overruns_per_s = 1_000_000;
    let rated_a = config.motor.continuous_current_a();
    let warm_s =
        -config.motor.thermal_time_constant_s * f64::ln(1.0 - (rated_a / 9.9) * (rated_a / 9.9));
    let expected = warm_s / config.servo.period_s() - 1.0;
    let mut bench = Bench::running(&config, &[], says(|_| 9.9));
    bench.tick();
    let at = first_trip(&mut bench, 3) as f64;
    assert!(
        (expected - 1.0..=expected + 4.0).contains(&at),
        "tick {at}, expected {expected}"
    );
}

#[test]
fn a_measured_current_that_is_not_the_commanded_one_trips_within_its_time_and_a_close_one_does_not()
{
    let config = stage();
    let (error_a, ticks) = (
        config.interlock.current_error_a,
        config.interlock.current_error_s * config.servo.rate_hz,
    );
    for sign in [-1.0, 1.0] {
        let close = Fault::MeasuresBeyond(sign * 0.9 * error_a);
        nothing_trips(
            &mut Bench::running(&config, &[(0..u64::MAX, close)], constant()),
            2000,
        );
        let far = Fault::MeasuresBeyond(sign * 1.1 * error_a);
        let mut bench = Bench::running(&config, &[(0..u64::MAX, far)], constant());
        bench.run(2 * ticks as u64);
        let at = bench.trips().first().map_or(0, |event| event.tick);
        assert!(
            (ticks as u64..=ticks as u64 + 3).contains(&at),
            "{at}: judged at the end of a window of {ticks} ticks"
        );
        prove_that_it_is_off(&bench, at, "current_not_followed");
    }
}
