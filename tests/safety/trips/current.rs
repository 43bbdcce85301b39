//! Trips by the command, by the thermal model of the motor, and by a measured current that does not follow its command.
use super::*;

#[test]
fn allows_peak_current_and_trips_one_bit_above() {
    let config = stage();
    let limit_a = config.motor.peak_current_a();
    for side in [1.0, -1.0] {
        let spike =
            |peak_a: f64| endless(move |tick| if tick == AT { side * peak_a } else { SOME_A });
        let mut bench = Bench::running(&config, &[], spike(limit_a));
        runs_without_trip(&mut bench, AT + 100);
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
fn continuous_current_trips_at_the_tick_of_the_closed_form() {
    let config = stage();
    let (rated_a, tau_s) = (
        config.motor.continuous_current_a(),
        config.motor.thermal_time_constant_s,
    );
    for current_a in [2.4, -3.0, 5.0, 9.9] {
        // tau q' = i^2 - q from q = 0 reaches i_c^2 at t = -tau ln(1 - (i_c/i)^2). The loop uses Euler steps of c = T/tau:
        // (1 - c)^n = exp(-t/tau) has n = (t/T) c/-ln(1 - c) = (t/T)(1 - c/2), at most 1.5 ticks of 150,000 fewer. The command of
        // tick k heats until the end of its period, so the loop trips in the tick with k < n <= k + 1.
        let (period_s, square) = (
            config.servo.period_s(),
            (rated_a / current_a) * (rated_a / current_a),
        );
        let limit_s = -tau_s * f64::ln(1.0 - square);
        let n = limit_s / period_s * (1.0 - period_s / tau_s / 2.0);
        let mut bench = Bench::running(&config, &[], endless(move |_| current_a));
        let at = first_trip(&mut bench, 0) as f64;
        assert!(
            (n - 1.01..=n + 0.01).contains(&at),
            "{current_a} A: tick {at}, expected after {n} ticks"
        );
    }
}

#[test]
fn continuous_current_trip_switches_the_amplifier_off() {
    // 9.9 A and 2.338 A: 0.574 s, tick 2869 by the closed form of the test above.
    let config = stage();
    let rated_a = config.motor.continuous_current_a();
    let warm_s =
        -config.motor.thermal_time_constant_s * f64::ln(1.0 - (rated_a / 9.9) * (rated_a / 9.9));
    let at = (warm_s / config.servo.period_s() - 1.0).ceil() as u64;
    let trip = trips(
        &mut Bench::running(&config, &[], endless(|_| 9.9)),
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
fn rated_current_does_not_trip_in_six_time_constants() {
    let config = stage();
    let rated_a = config.motor.continuous_current_a();
    let mut bench = Bench::running(&config, &[], endless(move |_| rated_a * 0.9999));
    // Six time constants: the thermal state is at 99.75 % of its final value.
    for _ in 0..300_000 {
        let record = bench.tick();
        assert_eq!((record.state, bench.trips().len()), (State::Running, 0));
        bench.all.drain(..bench.all.len().saturating_sub(4));
    }
}

#[test]
fn non_finite_command_trips_and_is_not_sent() {
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -f64::NAN] {
        let program = endless(move |tick| if tick == AT { value } else { SOME_A });
        let mut bench = Bench::running(&stage(), &[], program);
        trips(&mut bench, AT, "command_not_finite");
        let sent = bench
            .amplifier_calls()
            .iter()
            .any(|(_, t)| matches!(t, AmplifierCall::Command { current_a, .. } if !current_a.is_finite()));
        assert!(!sent, "the amplifier received it");
        let smallest = Bench::running(
            &stage(),
            &[],
            endless(|tick| {
                if tick == AT {
                    f64::MIN_POSITIVE
                } else {
                    SOME_A
                }
            }),
        );
        runs_without_trip(&mut { smallest }, AT + 10);
    }
}

#[test]
fn thermal_state_is_kept_after_clear_and_arm() {
    // The first trip is at i_c. From there the same current trips again at once, long before it would with a cold winding.
    let config: Config = stage();
    let mut bench = Bench::running(&config, &[], endless(|_| 9.9));
    let first = first_trip(&mut bench, 0);
    for request in [
        Request::Clear,
        Request::Arm,
        Request::Start(endless(|_| 9.9)),
    ] {
        bench.request(request);
    }
    // The tick of the trip cools the winding by i_c^2/50,000; a tick of 9.9 A heats it 17 times as much, so at most one passes.
    bench.run(3);
    assert_eq!(bench.trips().len(), 2);
    assert!(bench.trips()[1].tick <= first + 2, "{:?}", bench.trips());
}

#[test]
fn thermal_model_includes_missed_ticks() {
    // 9.9 A with three of four ticks missed: the thermal model uses the elapsed time, not the number of served ticks. Missed
    // ticks cause no trip here. Closed form as above; the trip is up to three ticks late, because every fourth tick is served.
    let mut config = stage();
    config.interlock.overruns_per_s = 1_000_000;
    let rated_a = config.motor.continuous_current_a();
    let warm_s =
        -config.motor.thermal_time_constant_s * f64::ln(1.0 - (rated_a / 9.9) * (rated_a / 9.9));
    let expected = warm_s / config.servo.period_s() - 1.0;
    let mut bench = Bench::running(&config, &[], endless(|_| 9.9));
    bench.tick();
    let at = first_trip(&mut bench, 3) as f64;
    assert!(
        (expected - 1.0..=expected + 4.0).contains(&at),
        "tick {at}, expected {expected}"
    );
}

#[test]
fn trips_on_measured_current_beyond_tolerance() {
    let config = stage();
    let (error_a, ticks) = (
        config.interlock.current_error_a,
        config.interlock.current_error_s * config.servo.rate_hz,
    );
    for sign in [-1.0, 1.0] {
        let close = Fault::MeasuredOffset(sign * 0.9 * error_a);
        runs_without_trip(
            &mut Bench::running(&config, &[(0..u64::MAX, close)], constant()),
            2000,
        );
        let far = Fault::MeasuredOffset(sign * 1.1 * error_a);
        let mut bench = Bench::running(&config, &[(0..u64::MAX, far)], constant());
        bench.run(2 * ticks as u64);
        let at = bench.trips().first().map_or(0, |event| event.tick);
        assert!(
            (ticks as u64..=ticks as u64 + 3).contains(&at),
            "tick {at}: evaluated at the end of a window of {ticks} ticks"
        );
        assert_off_after_trip(&bench, at, "current_not_followed");
    }
}
