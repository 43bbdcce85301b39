//! No tick allocates.
use assert_no_alloc::assert_no_alloc;
use bench::rt::clock::TickTiming;
use bench::rt::servo::Request;
use bench_hal::Tick;

use crate::programs::programs;
use crate::quiet::{Quiet, Says};
use crate::{all_trips, stage, weak};

#[test]
fn programs_do_not_allocate() {
    let config = stage();
    for (name, program) in programs(&config) {
        let mut quiet = Quiet::running(&config, &[], program);
        quiet.run(5100);
        assert!(
            quiet.has_done(&name) && quiet.trip.is_none(),
            "{name}: {} commands",
            quiet.commands
        );
    }
}

#[test]
fn trips_and_later_ticks_do_not_allocate() {
    for (reason, fault, current_a) in all_trips() {
        let mut quiet = Quiet::running(&weak(), &[(0..10_000, fault)], Box::new(Says(current_a)));
        quiet.run(8000);
        assert_eq!(quiet.trip, Some(reason), "{fault:?}");
        for order in [
            Request::Arm,
            Request::Start(Box::new(Says(0.01))),
            Request::Stop,
            Request::Clear,
            Request::Stop,
        ] {
            quiet.order(order);
        }
        quiet.run(10);
    }
    let mut quiet = Quiet::running(&weak(), &[], Box::new(Says(0.01)));
    for missed in [1, 40, 0, 10, 3] {
        assert_no_alloc(|| quiet.bare_tick(missed));
    }
    quiet.collect();
    assert_eq!(quiet.trip, Some("overruns"));
}

#[test]
fn requests_do_not_allocate_and_programs_are_freed_outside_the_tick() {
    let config = weak();
    let mut quiet = Quiet::new(&config, &[]);
    for round in 0..20 {
        for order in [
            Request::Start(Box::new(Says(0.01))),
            Request::Arm,
            Request::Arm,
            Request::Start(Box::new(Says(0.01))),
        ] {
            quiet.order(order);
            assert_no_alloc(|| quiet.bare_tick(0));
        }
        quiet.order(Request::Start(Box::new(Says(0.02))));
        quiet.order(if round % 2 == 0 {
            Request::Stop
        } else {
            Request::Clear
        });
        quiet.order(Request::Stop);
        // Nobody collects the programs here: after four the ring is full, and they are kept rather than freed in the tick.
        for _ in 0..3 {
            assert_no_alloc(|| quiet.bare_tick(0));
        }
        quiet.collect();
    }
    assert!(quiet.commands >= 20, "{}", quiet.commands);
}

#[test]
fn full_recorder_ring_does_not_allocate_or_block() {
    let mut quiet = Quiet::running(&weak(), &[], Box::new(Says(0.01)));
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
        assert_no_alloc(|| quiet.servo.tick(&moment, &quiet.clock));
    }
    // 1024 slots: four events and 1020 records.
    assert_eq!(quiet.servo.publisher().lost(), 5000 - 1020);
}
