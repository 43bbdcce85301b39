//! The configured computing delay of one period on devices: a set-point is sent in the tick after the one that computed it.
use std::time::Duration;

use bench_config::Config;
use bench_experiment::{Plan, replay};
use bench_hal::can::Id;
use bench_hal::can::bus::{BusEvent, CanBus, MemoryEndpoint};
use bench_hal::can::pdo::{Direction, cob_id, unpack};
use bench_hal::{CurrentAmplifier, Rig};
use bench_recording::Recording;
use bench_rig::devices::deferred::{Deferred, OutputTiming};
use bench_rig::simulated::SimulatedRig;
use bench_rt::arming::State;
use bench_rt::record::{EventKind, TickRecord};
use bench_rt::servo::Request;
use bench_rt::thread::Pace;
use bench_test_support::faulty_rig::{Fault, FaultyRig};
use bench_test_support::loop_rig::{Bench, StillRig, endless, stage};

use crate::devices::amplifier::{Lab, config};

/// The set-points that the drive has received since the last call, in counts, in their order.
fn set_points(listener: &mut MemoryEndpoint) -> Vec<i16> {
    let frames = std::iter::from_fn(|| listener.receive(Duration::ZERO).expect("a bus"));
    let targets = frames.map(|event| match event {
        BusEvent::Frame(frame) => unpack(frame.data()).expect("a set-point").1,
        BusEvent::Condition(condition) => panic!("{condition:?}"),
    });
    targets.collect()
}

fn set_point_id(config: &Config) -> Id {
    let node = bench_rig::devices::can_amplifier(&config.amplifier.device)
        .expect("a drive")
        .address()
        .node;
    cob_id(Direction::Receive, 1, node)
}

/// An armed loop on the emulated drive, and a listener for its set-points.
fn armed(timing: OutputTiming) -> (Lab, MemoryEndpoint) {
    let mut lab = Lab::with_timing(config(&[]), timing);
    lab.arm();
    let mut listener = lab.host().bus().connect(&[set_point_id(&config(&[]))]);
    set_points(&mut listener);
    (lab, listener)
}

/// A ramp of 2 mA for each tick: one count of a drive with 2 A rated current.
fn ramp_a(tick: u64) -> f64 {
    0.002 * (tick + 1) as f64
}

#[test]
fn drive_receives_each_set_point_in_the_configured_tick() {
    for (timing, first) in [(OutputTiming::SameTick, 1), (OutputTiming::NextTick, 0)] {
        let (mut lab, mut listener) = armed(timing);
        lab.bench().request(Request::Start(endless(ramp_a)));
        for tick in 0..50 {
            let record = lab.bench().tick();
            assert_eq!(set_points(&mut listener), [first + tick], "{timing:?}");
            let command_a = 0.002 * f64::from(tick + 1);
            assert!((record.command_a - command_a).abs() < 1e-9, "{record:?}");
        }
        assert_eq!(lab.bench().trips(), []);
    }
}

#[test]
fn stop_and_trip_send_zero_in_their_tick_and_discard_the_set_point() {
    for request in [Some(Request::Stop), None] {
        let (mut lab, mut listener) = armed(OutputTiming::NextTick);
        let program = endless(|tick| if tick < 20 { ramp_a(tick) } else { f64::NAN });
        lab.bench().request(Request::Start(program));
        lab.bench().run(20);
        assert_eq!(set_points(&mut listener).last(), Some(&19));
        let expected = match request {
            Some(_) => State::Disarmed,
            None => State::Tripped,
        };
        if let Some(request) = request {
            lab.bench().request(request);
        }
        let record = lab.bench().tick();
        assert_eq!((record.state, record.command_a), (expected, 0.0));
        // The loop sends zero in this tick; the thread of the driver repeats it until the drive confirms.
        assert_eq!(set_points(&mut listener).first(), Some(&0));
        lab.bench().run(50);
        let later = set_points(&mut listener);
        assert!(later.iter().all(|target| *target == 0), "{later:?}");
        // The next run begins with zero, not with the set-point that was discarded.
        lab.bench().request(Request::Clear);
        lab.bench().run(200);
        lab.arm();
        assert!(set_points(&mut listener).iter().all(|target| *target == 0));
    }
}

/// The configured stage with a delay of one period in the model, or enforced by the loop.
fn simulated(config: &Config, enforced: bool) -> Box<dyn Rig> {
    let mut config = config.clone();
    assert_eq!(config.servo.computing_delay_periods, 1);
    if !enforced {
        return Box::new(SimulatedRig::new(&config).expect("a rig"));
    }
    config.servo.computing_delay_periods = 0;
    OutputTiming::NextTick.apply(SimulatedRig::new(&config).expect("a rig"))
}

/// The records of a closed loop, and whether its replay is identical.
fn closed_loop(config: &Config, enforced: bool) -> Vec<TickRecord> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let plan = Plan::control(config.clone()).expect("a plan");
    let rig = simulated(config, enforced);
    let run = bench_experiment::run(&plan, rig, Pace::Virtual, folder.path(), &mut |_, _| {});
    let run = run.expect("a run");
    let path = run.path.clone();
    run.finish("{}").expect("a good disk");
    let recording = Recording::open(&path).expect("a recording");
    let replayed = replay(&recording).expect("it can be replayed");
    assert_eq!((replayed.different, replayed.first), (0, None));
    assert_eq!(replayed.ticks, recording.tick_count());
    let ticks = recording.ticks().expect("readable");
    ticks.map(|record| record.expect("readable")).collect()
}

#[test]
fn enforced_delay_equals_the_delay_of_the_model_bit_for_bit_and_replays() {
    let mut config = stage();
    config.control.controller = "fast".into();
    config.control.duration_s = 1.0;
    config.amplifier.slew_limit_a_per_s = 200.0; // limits the beginning of the step
    let (model, enforced) = (closed_loop(&config, false), closed_loop(&config, true));
    assert!(
        model
            .iter()
            .filter(|record| record.command_a != 0.0)
            .count()
            > 4000
    );
    assert_eq!(format!("{model:?}"), format!("{enforced:?}"));
}

#[test]
fn amplifier_that_gives_another_current_than_announced_trips() {
    let faults = [(100..101, Fault::ReturnedCurrent(0.11))];
    let rig = Deferred::new(FaultyRig::new(StillRig::default(), &faults));
    let mut bench = Bench::around(&stage(), rig);
    bench.request(Request::Arm);
    bench.request(Request::Start(endless(|_| 0.1)));
    bench.run(100);
    assert_eq!(bench.trips(), []);
    assert_eq!(bench.tick().command_a, 0.0);
    let trips = bench.trips();
    let [trip] = &trips[..] else {
        panic!("{trips:?}")
    };
    assert!(matches!(trip.kind, EventKind::Trip(trip) if trip.reason() == "amplifier"));
}

#[test]
fn rejects_a_computing_delay_of_two_periods_with_devices() {
    let mut config = config(&[]);
    config.servo.computing_delay_periods = 2;
    let refused = OutputTiming::of(&config.servo).expect_err("refused");
    assert_eq!(
        refused.to_string(),
        "loop.computing_delay_periods is 2, but with real devices a command is sent in its tick (0) or in the next one (1); set it to 0 or 1"
    );
    assert!(bench_rig::devices::check(&config).is_err());
    for periods in [0, 1] {
        config.servo.computing_delay_periods = periods;
        assert!(bench_rig::devices::check(&config).is_ok());
    }
    let mut simulated = stage();
    simulated.servo.computing_delay_periods = 2;
    assert!(bench_rig::devices::check(&simulated).is_ok());
}

#[test]
fn a_disable_discards_the_set_point_of_the_last_tick() {
    let mut rig = Deferred::new(StillRig::default());
    rig.begin_enable().expect("it can be enabled");
    assert_eq!(rig.command(0.5), Ok(0.5));
    rig.disable();
    assert!(rig.command(0.5).is_err(), "disabled");
}
