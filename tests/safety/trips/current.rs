//! Trips by the command, the heat of the motor, and a current that does not follow its command.
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
        // tau q' = i^2 - q from q = 0 reaches i_c^2 at t = -tau ln(1 - (i_c/i)^2). The loop takes Euler's steps of c = T/tau:
        // (1 - c)^n = exp(-t/tau) has n = (t/T) c/-ln(1 - c) = (t/T)(1 - c/2), at most 1.5 ticks of 150,000 fewer. The
        // command of tick k heats until the end of its period, so the tick that is refused is the one with k < n <= k + 1.
        let (period_s, square) = (
            config.servo.period_s(),
            (rated_a / current_a) * (rated_a / current_a),
        );
        let warm_s = -tau_s * f64::ln(1.0 - square);
        let n = warm_s / period_s * (1.0 - period_s / tau_s / 2.0);
        let mut bench = Bench::running(&config, &[], endless(move |_| current_a));
        let at = first_trip(&mut bench, 0) as f64;
        assert!(
            (n - 1.01..=n + 0.01).contains(&at),
            "{current_a} A: tick {at}, warm after {n} ticks"
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
    // Six time constants: the heat is at 99.75 % of where it settles.
    for _ in 0..300_000 {
        let record = bench.tick();
        assert_eq!((record.state, bench.trips().len()), (State::Running, 0));
        bench.all.drain(..bench.all.len().saturating_sub(4));
    }
}

#[test]
fn non_finite_command_trips_and_is_not_sent() {
    for nonsense in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -f64::NAN] {
        let program = endless(move |tick| if tick == AT { nonsense } else { SOME_A });
        let mut bench = Bench::running(&stage(), &[], program);
        trips(&mut bench, AT, "command_not_finite");
        let asked = bench
            .amplifier_calls()
            .iter()
            .any(|(_, t)| matches!(t, AmplifierCall::Command { current_a, .. } if !current_a.is_finite()));
        assert!(!asked, "the amplifier never saw it");
        let largest = Bench::running(
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
        runs_without_trip(&mut { largest }, AT + 10);
    }
}

#[test]
fn thermal_state_is_kept_after_clear_and_arm() {
    // Tripped at i_c; from there the same current trips again at once, long before a cold winding would.
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
    // The tick of the trip cooled the winding by i_c^2/50,000, one of 9.9 A heats it 17 times as much: one at most passes.
    bench.run(3);
    assert_eq!(bench.trips().len(), 2);
    assert!(bench.trips()[1].tick <= first + 2, "{:?}", bench.trips());
}

#[test]
fn thermal_model_includes_missed_ticks() {
    // 9.9 A with three of four ticks missed: the winding warms by the clock, not by the ticks that were served. Overruns
    // are allowed here. Closed form as above; what is seen only every fourth tick may be seen three ticks late.
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
            "{at}: judged at the end of a window of {ticks} ticks"
        );
        assert_off_after_trip(&bench, at, "current_not_followed");
    }
}
