//! No tick allocates.
use assert_no_alloc::assert_no_alloc;
use bench_experiment::{Plan, residuals};
use bench_hal::Tick;
use bench_rt::clock::TickTiming;
use bench_rt::servo::Request;
use bench_rt::tuning::{Factors, Tune};

use crate::faulty_rig::Fault;
use crate::programs::programs;
use crate::test_loop::{ConstantCurrent, TestLoop};
use crate::{all_trips, stage, weak_motor};

#[test]
fn programs_do_not_allocate() {
    let config = stage();
    for (name, program) in programs(&config) {
        let mut test_loop = TestLoop::running(&config, &[], program);
        test_loop.run(5100);
        assert!(
            test_loop.has_done(&name) && test_loop.trip.is_none(),
            "{name}: {} commands",
            test_loop.commands
        );
    }
}

#[test]
fn trips_and_later_ticks_do_not_allocate() {
    for (reason, fault, current_a) in all_trips() {
        let mut test_loop = TestLoop::running(
            &weak_motor(),
            &[(0..10_000, fault)],
            Box::new(ConstantCurrent(current_a)),
        );
        test_loop.run(8000);
        assert_eq!(test_loop.trip, Some(reason), "{fault:?}");
        for request in [
            Request::Arm,
            Request::Start(Box::new(ConstantCurrent(0.01))),
            Request::Stop,
            Request::Clear,
            Request::Stop,
        ] {
            test_loop.request(request);
        }
        test_loop.run(10);
    }
    let mut test_loop = TestLoop::running(&weak_motor(), &[], Box::new(ConstantCurrent(0.01)));
    for missed in [1, 40, 0, 10, 3] {
        assert_no_alloc(|| test_loop.bare_tick(missed));
    }
    test_loop.collect();
    assert_eq!(test_loop.trip, Some("overruns"));
}

#[test]
fn requests_do_not_allocate_and_programs_are_freed_outside_the_tick() {
    let config = weak_motor();
    let mut test_loop = TestLoop::new(&config, &[]);
    for round in 0..20 {
        for request in [
            Request::Start(Box::new(ConstantCurrent(0.01))),
            Request::Arm,
            Request::Arm,
            Request::Start(Box::new(ConstantCurrent(0.01))),
        ] {
            test_loop.request(request);
            assert_no_alloc(|| test_loop.bare_tick(0));
        }
        test_loop.request(Request::Start(Box::new(ConstantCurrent(0.02))));
        test_loop.request(if round % 2 == 0 {
            Request::Stop
        } else {
            Request::Clear
        });
        test_loop.request(Request::Stop);
        // No one takes the ended programs: after four the ring is full, and the tick keeps them instead of freeing them.
        for _ in 0..3 {
            assert_no_alloc(|| test_loop.bare_tick(0));
        }
        test_loop.collect();
    }
    assert!(test_loop.commands >= 20, "{}", test_loop.commands);
}

#[test]
fn a_change_of_reference_and_gain_does_not_allocate() {
    let plan = Plan::control(stage()).expect("a plan");
    let program = plan.program().expect("a program");
    let mut test_loop = TestLoop::running(&plan.config, &[], program);
    for number in 0..6000_u32 {
        if number % 500 == 499 {
            let factors = Factors {
                reference: 0.5,
                gain: 1.0 + 1e-4 * f64::from(number),
            };
            let tune = Tune::new(factors, 300).expect("within the limits");
            test_loop.request(Request::Tune(tune));
        }
        assert_no_alloc(|| test_loop.bare_tick(0));
        test_loop.collect();
    }
    assert!(test_loop.commands > 1000, "{}", test_loop.commands);
}

#[test]
fn comparison_with_the_model_and_its_trip_do_not_allocate() {
    let mut config = stage();
    config.control.controller = "fast".into();
    let plan = Plan::control(config).expect("a plan");
    // An offset of 100 um of the probe, within the travel limit.
    for (faults, trip) in [
        (vec![], None),
        (
            vec![(4000..6000, Fault::Offset(100e-6))],
            Some("model_error"),
        ),
    ] {
        let residuals = residuals(&plan).expect("a model");
        assert!(residuals.is_some(), "on by default");
        let mut test_loop = TestLoop::with_residuals(&plan.config, &faults, residuals);
        test_loop.request(Request::Arm);
        test_loop.request(Request::Start(plan.program().expect("a program")));
        test_loop.run(5100);
        assert_eq!(test_loop.trip, trip);
    }
}

#[test]
fn full_recorder_ring_does_not_allocate_or_block() {
    let mut test_loop = TestLoop::running(&weak_motor(), &[], Box::new(ConstantCurrent(0.01)));
    for number in 0..5000u64 {
        let tick = Tick {
            number,
            scheduled_ns: number * 200_000,
        };
        let moment = TickTiming {
            tick,
            woke_ns: tick.scheduled_ns,
            missed: 0,
        };
        assert_no_alloc(|| test_loop.servo.tick(&moment, &test_loop.clock));
    }
    // 1024 slots: five events and 955 records; the last 64 slots are for events.
    assert_eq!(test_loop.servo.run().publisher().lost(), 5000 - 955);
}
