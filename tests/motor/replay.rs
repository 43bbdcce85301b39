//! The interlocks start with the heat of the motor, and a replay starts with the same heat.
use bench_experiment::{Plan, replay, run};
use bench_recording::Recording;
use bench_rig::simulated::SimulatedRig;
use bench_rt::arming::Trip;
use bench_rt::thread::Pace;

use crate::motor::common::{LIMIT_A, hot};

#[test]
fn warm_motor_trips_although_the_run_was_not_refused_and_replays_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut plan = Plan::chirp(hot(folder.path()));
    plan.motor.thermal_a2 = 0.99 * LIMIT_A * LIMIT_A;
    let rig = Box::new(SimulatedRig::new(&plan.config).expect("a stage"));
    let out = folder.path().join("recordings");
    let run = run(&plan, rig, Pace::Virtual, &out, &mut |_, _| ()).expect("a run");
    let path = run.path.clone();
    let (trip, tick) = run.end.servo.trip.expect("the motor is too warm");
    run.finish("{}").expect("a recording");
    // i^2 heats by (3.708^2/2 - 5.4) A^2 in tau: the remaining 0.01 * 5.467 A^2 take about 0.4 s at 5 kHz after the quiet 0.1 s.
    assert!(matches!(trip, Trip::ContinuousCurrent { .. }), "{trip}");
    assert!((1000..5000).contains(&tick), "tick {tick}");

    let recording = Recording::open(&path).expect("a recording");
    let replayed = replay(&recording).expect("it replays");
    assert_eq!((replayed.different, replayed.first), (0, None));
    assert!(replayed.ticks > tick);
}
