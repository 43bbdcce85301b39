//! Stop flags and the arm lease end a run without the supervisor.
use std::sync::Arc;
use std::time::Duration;

use bench_experiment::{Plan, Run, StopCause, replay};
use bench_recording::Recording;
use bench_rig::simulated::SimulatedRig;
use bench_rt::arming::State;
use bench_rt::record::{EventKind, Origin, Refusal, RequestEvent, RequestKind};
use bench_rt::servo::Request;
use bench_rt::supervision::{ArmLease, StopFlags};
use bench_rt::thread::Pace;

use crate::safety::rig::{AmplifierCall, Bench, Log, LoggedRig, endless, stage};

const RAMP_TICKS: u64 = 10;
const LEASE_TICKS: u64 = 50;

fn running() -> Bench {
    Bench::running(&stage(), &[], endless(|_| 0.1)).with_ramps(RAMP_TICKS)
}

fn requests_of(bench: &Bench, origin: Origin) -> Vec<(u64, RequestKind, Option<Refusal>)> {
    let events = bench.events().into_iter();
    let requests = events.filter_map(|event| match event.kind {
        EventKind::Request(request) if request.origin == origin => {
            assert_eq!(
                request.id, 0,
                "only requests of the supervisor are numbered"
            );
            Some((event.tick, request.kind, request.refusal))
        }
        _ => None,
    });
    requests.collect()
}

#[test]
fn first_signal_settles_and_second_signal_cuts_in_the_tick_that_sees_it() {
    let flags = StopFlags::default();
    let mut bench = running().with_stop_flags(&flags);
    bench.run(20);
    assert_eq!(bench.state(), State::Running);
    flags.raise();
    let record = bench.tick();
    assert_eq!((record.tick, record.state), (20, State::Settling));
    assert!(record.command_a > 0.0, "no step of the current");
    bench.run(3);
    flags.raise();
    let record = bench.tick();
    assert_eq!(
        (record.tick, record.state, record.command_a.to_bits()),
        (24, State::Disarmed, 0)
    );
    flags.raise();
    bench.run(5);
    let signals = requests_of(&bench, Origin::Signal);
    assert_eq!(
        signals,
        [
            (20, RequestKind::Finish, None),
            (24, RequestKind::Stop, None)
        ]
    );
    assert_eq!(bench.outcome().stopped_by, Some(Origin::Signal));
    assert!(!bench.amplifier_is_on());
}

#[test]
fn two_signals_in_one_tick_cut_the_current_in_it() {
    let flags = StopFlags::default();
    let mut bench = running().with_stop_flags(&flags);
    bench.run(20);
    flags.raise();
    flags.raise();
    let record = bench.tick();
    assert_eq!(
        (record.state, record.command_a.to_bits()),
        (State::Disarmed, 0)
    );
}

#[test]
fn a_signal_before_the_first_tick_prevents_the_run() {
    let flags = StopFlags::default();
    let mut bench = running().with_stop_flags(&flags);
    flags.raise();
    bench.run(5);
    assert!(bench.ticks().iter().all(|record| record.command_a == 0.0));
    assert!(!bench.amplifier_is_on());
}

#[test]
fn lease_without_renewal_ends_the_run_along_a_ramp_at_its_tick() {
    let lease = Arc::new(ArmLease::default());
    let mut bench = running().with_lease(&lease, LEASE_TICKS);
    bench.run(7);
    lease.renew();
    bench.run(1 + LEASE_TICKS - 1);
    assert_eq!(bench.state(), State::Running, "renewed at tick 7");
    let record = bench.tick();
    assert_eq!(
        (record.tick, record.state),
        (7 + LEASE_TICKS, State::Settling)
    );
    bench.run(3 * RAMP_TICKS);
    assert_eq!(bench.state(), State::Disarmed);
    let requests = requests_of(&bench, Origin::Lease);
    assert_eq!(requests, [(7 + LEASE_TICKS, RequestKind::Finish, None)]);
    assert_eq!(bench.outcome().stopped_by, Some(Origin::Lease));
}

#[test]
fn renewed_lease_does_not_end_the_run() {
    let lease = Arc::new(ArmLease::default());
    let mut bench = running().with_lease(&lease, LEASE_TICKS);
    for _ in 0..20 {
        lease.renew();
        bench.run(LEASE_TICKS);
    }
    assert_eq!(bench.state(), State::Running);
    assert_eq!(bench.outcome().stopped_by, None);
}

#[test]
fn missed_ticks_use_up_the_lease() {
    let lease = Arc::new(ArmLease::default());
    let mut bench = running().with_lease(&lease, LEASE_TICKS);
    bench.tick();
    let record = bench.late_tick(LEASE_TICKS as u32 - 3);
    assert_eq!(record.state, State::Running);
    assert_eq!(bench.tick().state, State::Settling);
}

#[test]
fn an_expired_lease_disarms_an_armed_loop_and_is_silent_without_a_run() {
    let lease = Arc::new(ArmLease::default());
    let mut bench = Bench::still(&stage(), &[]).with_lease(&lease, LEASE_TICKS);
    bench.run(2 * LEASE_TICKS);
    assert_eq!(requests_of(&bench, Origin::Lease), []);
    bench.request(Request::Arm);
    bench.run(2);
    assert_eq!(bench.state(), State::Disarmed);
    assert!(!bench.amplifier_is_on());
}

/// Waits until the amplifier was enabled and disabled again, for at most a minute: a supervisor that hangs.
fn hang_until_disabled(log: &Log) {
    for _ in 0..6000 {
        let calls = log.lock().expect("no test panics with it").clone();
        let is_enabled = |call: &AmplifierCall| matches!(call, AmplifierCall::Enable { .. });
        let enabled = calls.iter().any(|(_, call)| is_enabled(call));
        if enabled && matches!(calls.last(), Some((_, AmplifierCall::Disable))) {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("the run goes on without its supervisor");
}

/// A run of an hour in real time whose supervisor hangs after 300 ticks.
fn run_with_hanging_supervisor(folder: &std::path::Path) -> Run {
    let mut config = stage();
    // Longer than a supervisor that does not hang has to wait for a processor on a busy machine.
    (config.servo.rate_hz, config.servo.arm_lease_s) = (1000.0, Some(3.0));
    config.interlock.overruns_per_s = 1_000_000;
    config.control.controller = "slow".into();
    config.control.duration_s = 3600.0;
    let plan = Plan::control(config).expect("a plan");
    let rig = LoggedRig::new(SimulatedRig::new(&plan.config).expect("a rig"));
    let log = Arc::clone(&rig.log);
    let mut watch = |ticks: u64, _| {
        if ticks >= 300 {
            hang_until_disabled(&log);
        }
    };
    bench_experiment::run(&plan, Box::new(rig), Pace::Realtime, folder, &mut watch).expect("a run")
}

#[test]
fn a_hanging_supervisor_leaves_no_run_unattended() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run = run_with_hanging_supervisor(folder.path());
    assert_eq!(run.end.stop_cause, Some(StopCause::LeaseExpired));
    assert!(!run.end.servo.completed && run.end.servo.trip.is_none());
    assert_eq!(run.end.servo.stopped_by, Some(Origin::Lease));
    let path = run.path.clone();
    run.finish("{}").expect("a good disk");
    let recording = Recording::open(&path).expect("a recording");
    let expected = RequestEvent {
        id: 0,
        origin: Origin::Lease,
        kind: RequestKind::Finish,
        refusal: None,
    };
    let mut events = recording.events().iter();
    assert!(events.any(|event| event.kind == EventKind::Request(expected)));
    let replayed = replay(&recording).expect("it can be replayed");
    assert_eq!((replayed.different, replayed.first), (0, None));
    assert!(replayed.ticks >= 300);
}
