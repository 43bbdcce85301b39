//! The arming state machine, transition by transition, in the loop.
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use bench_experiment::Plan;
use bench_hal::{Rig, Validity};
use bench_rt::arming::{State, Transition};
use bench_rt::clock::Virtual;
use bench_rt::live_loop::run_to_end;
use bench_rt::program::{Decision, Program, ProgramInput};
use bench_rt::publisher::Publisher;
use bench_rt::record::{EventKind, LoopMessage, Origin, Refusal, RequestEvent};
use bench_rt::request::RequestSender;
use bench_rt::servo::{Request, Servo};
use bench_rt::servo_run::{Connections, Progress, ServoRun};
use bench_rt::thread::Pace;
use rtrb::{Consumer, RingBuffer};

use crate::safety::faulty_rig::Fault;
use crate::safety::rig::{
    AmplifierCall, Bench, CurrentProgram, LoggedRig, StillRig, endless, interlocks, stage,
};

const STATES: [State; 6] = [
    State::Disarmed,
    State::Enabling,
    State::Armed,
    State::Running,
    State::Settling,
    State::Tripped,
];

/// The state after each transition, by initial state: the diagram in `rt/arming.rs`.
#[rustfmt::skip]
const TRANSITIONS: [(Transition, [State; 6]); 7] = {
    use State::{Armed, Disarmed, Enabling, Running, Settling, Tripped};
    [
        // from:               Disarmed  Enabling  Armed     Running   Settling  Tripped
        (Transition::Arm,     [Enabling, Enabling, Armed,    Running,  Settling, Tripped]),
        (Transition::Enabled, [Disarmed, Armed,    Armed,    Running,  Settling, Tripped]),
        (Transition::Start,   [Disarmed, Enabling, Running,  Running,  Settling, Tripped]),
        (Transition::Finish,  [Disarmed, Disarmed, Disarmed, Settling, Settling, Tripped]),
        (Transition::Stop,    [Disarmed, Disarmed, Disarmed, Disarmed, Disarmed, Tripped]),
        (Transition::Trip,    [Disarmed, Tripped,  Tripped,  Tripped,  Tripped,  Tripped]),
        (Transition::Clear,   [Disarmed, Enabling, Armed,    Running,  Settling, Disarmed]),
    ]
};
/// Length of each of the two ramps at the end of a run in ticks.
const RAMP_TICKS: u64 = 10;

/// Ticks of a probe fault: the trip under test, and the trip that brings the loop into `Tripped` before it.
const TRIP: u64 = 20;
const TRIP_BEFORE: u64 = 5;

/// Healthy ticks before the amplifier is enabled. In the state Enabling two have passed before the tick with the transition.
fn healthy_ticks(state: State, change: Option<Transition>) -> u64 {
    match (state, change) {
        (_, Some(Transition::Enabled)) => 3,
        (_, Some(_)) => 4,
        (State::Enabling, None) => 1000,
        (_, None) => 0,
    }
}

/// A loop in a state, before the tick with a transition.
fn bench_in(state: State, change: Option<Transition>) -> Bench {
    let mut faults = Vec::new();
    if change == Some(Transition::Trip) {
        faults.push((TRIP..TRIP + 1, Fault::Validity(Validity::Faulty)));
    }
    if state == State::Tripped {
        faults.push((
            TRIP_BEFORE..TRIP_BEFORE + 1,
            Fault::Validity(Validity::Faulty),
        ));
    }
    let mut bench = Bench::still(&stage(), &faults)
        .with_ramps(RAMP_TICKS)
        .with_healthy_ticks(healthy_ticks(state, change));
    if !matches!(state, State::Disarmed | State::Enabling) {
        bench.request(Request::Arm);
    }
    if matches!(state, State::Running | State::Settling) {
        bench.request(Request::Start(endless(|_| 0.1)));
    }
    bench.run(TRIP - 2);
    match state {
        State::Enabling => bench.request(Request::Arm),
        State::Settling => bench.request(Request::Finish),
        State::Disarmed | State::Armed | State::Running | State::Tripped => {}
    }
    bench.run(2);
    assert_eq!(bench.state(), state);
    bench
}

#[test]
fn transitions_match_the_state_diagram() {
    for (column, from) in STATES.into_iter().enumerate() {
        for (change, to) in TRANSITIONS {
            let to = to[column];
            let mut bench = bench_in(from, Some(change));
            let events = bench.events().len();
            match change {
                Transition::Arm => bench.request(Request::Arm),
                Transition::Start => bench.request(Request::Start(endless(|_| 0.2))),
                Transition::Finish => bench.request(Request::Finish),
                Transition::Stop => bench.request(Request::Stop),
                Transition::Clear => bench.request(Request::Clear),
                Transition::Enabled | Transition::Trip => {}
            }
            let record = bench.tick();
            assert_eq!(
                (record.state, bench.state()),
                (to, to),
                "{change:?} in {from:?}"
            );
            let changes: Vec<_> = bench.events()[events..]
                .iter()
                .filter(|e| is_state_change(&e.kind))
                .map(|e| e.kind)
                .collect();
            let expected = if from == to {
                vec![]
            } else {
                vec![EventKind::State { from, to }]
            };
            assert_eq!(changes, expected, "{change:?} in {from:?}");
            assert_eq!(
                bench.amplifier_is_on(),
                matches!(to, State::Armed | State::Running | State::Settling),
                "{change:?} in {from:?}"
            );
            assert_eq!(
                record.command_a != 0.0,
                matches!(to, State::Running | State::Settling),
                "{change:?} in {from:?}: {record:?}"
            );
            // Without a run there is no current to ramp down: the loop disarms at once.
            let change = match (change, from) {
                (Transition::Finish, State::Enabling | State::Armed) => Transition::Stop,
                (change, _) => change,
            };
            assert_eq!(
                from.after(change),
                (from != to).then_some(to),
                "{change:?} in {from:?}"
            );
        }
    }
}

fn is_state_change(kind: &EventKind) -> bool {
    matches!(kind, EventKind::State { .. })
}

#[test]
fn completed_program_disarms_in_the_tick_after_its_last_command() {
    let mut bench = Bench::running(&stage(), &[], Box::new(CurrentProgram(|_| 0.1, 10)));
    bench.run(20);
    let commands: Vec<bool> = bench.ticks().iter().map(|r| r.command_a != 0.0).collect();
    assert_eq!(commands, [[true; 10], [false; 10]].concat());
    assert_eq!(
        (
            bench.state(),
            bench.amplifier_is_on(),
            bench.returned_programs
        ),
        (State::Disarmed, false, 1)
    );
    assert!(
        bench
            .events()
            .iter()
            .any(|e| e.tick == 9 && e.kind == EventKind::Completed)
    );
    assert!(bench.outcome().completed);
}

#[test]
fn start_request_does_not_replace_the_running_program() {
    let mut bench = Bench::running(&stage(), &[], endless(|tick| 0.1 + tick as f64 * 1e-3));
    bench.run(5);
    bench.request(Request::Start(endless(|_| 5.0)));
    let record = bench.tick();
    assert_eq!(
        (record.command_a, bench.returned_programs),
        (0.1 + 5.0 * 1e-3, 1)
    );
}

#[test]
fn only_clear_leaves_the_tripped_state_and_a_new_run_needs_arm_and_start() {
    let mut bench = bench_in(State::Tripped, None);
    let trip = bench.outcome().trip.expect("tripped");
    let before = bench.amplifier_calls().len();
    for _ in 0..50 {
        bench.request(Request::Arm);
        bench.request(Request::Start(endless(|_| 0.1)));
        bench.request(Request::Stop);
        assert_eq!(bench.tick().state, State::Tripped);
    }
    assert!(
        bench.amplifier_calls()[before..]
            .iter()
            .all(|(_, call)| *call == AmplifierCall::Disable),
        "the amplifier is only disabled"
    );
    assert_eq!(
        (bench.outcome().trip, bench.returned_programs),
        (Some(trip), 50)
    );

    bench.request(Request::Clear);
    assert_eq!(
        (bench.tick().state, bench.amplifier_is_on()),
        (State::Disarmed, false)
    );
    bench.request(Request::Start(endless(|_| 0.1)));
    assert_eq!(
        (bench.tick().state, bench.amplifier_is_on()),
        (State::Disarmed, false),
        "a start request without arm has no effect"
    );
    bench.request(Request::Arm);
    let armed = bench.tick();
    assert_eq!(
        (armed.state, armed.command_a, bench.amplifier_is_on()),
        (State::Armed, 0.0, true)
    );
    bench.request(Request::Start(endless(|_| 0.1)));
    let running = bench.tick();
    assert_eq!((running.state, running.command_a), (State::Running, 0.1));
}

#[test]
fn loop_stays_tripped_when_the_amplifier_refuses_clear() {
    let faults = [
        (100..101, Fault::AmplifierFault(5)),
        (0..200, Fault::RefusedClear),
    ];
    let mut bench = Bench::running(&stage(), &faults, endless(|_| 0.1));
    bench.run(150);
    assert_eq!(bench.state(), State::Tripped);
    bench.request(Request::Clear);
    bench.tick();
    assert_eq!(
        bench.state(),
        State::Tripped,
        "the amplifier refuses to clear its fault"
    );
    assert_eq!(failed_resets(&bench), [(150, 5)]);
    bench.run(100);
    bench.request(Request::Clear);
    bench.tick();
    assert_eq!(
        (bench.state(), bench.amplifier_is_on()),
        (State::Disarmed, false)
    );
    assert_eq!(failed_resets(&bench).len(), 1);
}

/// Tick and code of each reset that failed.
fn failed_resets(bench: &Bench) -> Vec<(u64, i64)> {
    let events = bench.events();
    let failed = events.iter().filter_map(|event| match event.kind {
        EventKind::ResetFailed { code, .. } => Some((event.tick, code)),
        EventKind::Request(_)
        | EventKind::State { .. }
        | EventKind::Trip(_)
        | EventKind::Completed
        | EventKind::Lost { .. }
        | EventKind::Override
        | EventKind::Clock(_) => None,
    });
    failed.collect()
}

#[test]
fn new_run_resets_the_last_trip() {
    let mut bench = bench_in(State::Tripped, None);
    for request in [
        Request::Clear,
        Request::Arm,
        Request::Start(Box::new(CurrentProgram(|_| 0.1, 5))),
    ] {
        bench.request(request);
    }
    assert!(bench.outcome().trip.is_some());
    bench.run(10);
    assert_eq!(
        (bench.outcome().trip, bench.outcome().completed),
        (None, true)
    );
}

#[test]
fn arm_request_in_other_states_does_not_enable_the_amplifier() {
    for state in STATES.into_iter().filter(|state| *state != State::Disarmed) {
        let mut bench = bench_in(state, None);
        let before = bench.amplifier_calls().len();
        bench.request(Request::Arm);
        bench.run(3);
        let enabled = bench.amplifier_calls()[before..]
            .iter()
            .any(|(_, call)| matches!(call, AmplifierCall::Enable { .. }));
        assert!(!enabled, "enabled again in {state:?}");
    }
}

#[test]
fn every_request_is_acknowledged_with_its_number_and_answer() {
    use Refusal::{NoRun, NoTrip, NotArmed, NotDisarmed, Tripped};
    // By initial state: Disarmed, Enabling, Armed, Running, Settling, Tripped. `None`: accepted.
    let arm = [
        None,
        Some(NotDisarmed),
        Some(NotDisarmed),
        Some(NotDisarmed),
        Some(NotDisarmed),
        Some(Tripped),
    ];
    let start = [
        Some(NotArmed),
        None,
        None,
        Some(NotArmed),
        Some(NotArmed),
        Some(Tripped),
    ];
    let finish = [Some(NoRun), None, None, None, Some(NoRun), Some(Tripped)];
    let no_trip = Some(NoTrip);
    let clear = [no_trip, no_trip, no_trip, no_trip, no_trip, None];
    for (index, state) in STATES.into_iter().enumerate() {
        let expected = [
            (Request::Arm, arm[index]),
            (Request::Start(endless(|_| 0.2)), start[index]),
            (Request::Finish, finish[index]),
            (Request::Stop, None),
            (Request::Clear, clear[index]),
        ];
        for (request, refusal) in expected {
            let mut bench = bench_in(state, None);
            let sent = acknowledged(&bench).len() as u64;
            let kind = request.kind();
            bench.request(request);
            bench.tick();
            let id = sent + 1;
            let answer = acknowledged(&bench).last().copied();
            assert_eq!(
                answer,
                Some(RequestEvent {
                    id,
                    origin: Origin::Supervisor,
                    kind,
                    refusal
                }),
                "in {state:?}"
            );
        }
    }
}

#[test]
fn requests_are_numbered_from_1_in_the_order_in_which_they_were_sent() {
    let mut bench = Bench::still(&stage(), &[]);
    for request in [Request::Stop, Request::Arm, Request::Clear] {
        bench.request(request);
    }
    bench.tick();
    let ids: Vec<u64> = acknowledged(&bench)
        .iter()
        .map(|answer| answer.id)
        .collect();
    assert_eq!(ids, [1, 2, 3]);
    // The numbers and answers are in the recording.
    let (_folder, recording) = bench.recorded();
    assert_eq!(recording.events(), bench.events());
}

/// The answers to the requests so far.
fn acknowledged(bench: &Bench) -> Vec<RequestEvent> {
    let events = bench.events().into_iter();
    let answers = events.filter_map(|event| match event.kind {
        EventKind::Request(answer) => Some(answer),
        _ => None,
    });
    answers.collect()
}

fn loop_around(rig: impl Rig + 'static) -> (Servo, RequestSender, Consumer<LoopMessage>) {
    let (publisher, records) = RingBuffer::new(4096);
    let (requests, taken) = RequestSender::ring(16);
    let (retired, _) = RingBuffer::new(16);
    let connections = Connections {
        requests: taken,
        retired,
        publisher: Publisher::new(publisher),
        progress: Arc::new(Progress::default()),
    };
    let run = ServoRun::new(interlocks(&stage()), connections).with_tail(5);
    (
        Servo::new(Box::new(rig), Box::new(run), 2e-4),
        requests,
        records,
    )
}

/// A program that panics at its eleventh tick.
struct PanickingProgram;

impl Program for PanickingProgram {
    fn decide(&mut self, input: &ProgramInput) -> Decision {
        let tick = input.tick;
        assert!(tick < 10, "panic of the test program");
        Decision {
            requested_a: 0.1,
            active: true,
            ..Decision::default()
        }
    }
    fn ticks(&self) -> u64 {
        100
    }
}

#[test]
fn panic_in_the_loop_disables_the_amplifier() {
    let rig = LoggedRig::new(StillRig::default());
    let log = Arc::clone(&rig.log);
    let (mut servo, mut requests, _records) = loop_around(rig);
    assert!(
        requests.send(Request::Arm).is_ok()
            && requests
                .send(Request::Start(Box::new(PanickingProgram)))
                .is_ok()
    );
    let ended =
        std::thread::spawn(move || run_to_end(&mut servo, Virtual { period_s: 2e-4 })).join();
    assert!(ended.is_err(), "the program panics after ten ticks");
    let calls = log.lock().expect("not poisoned").clone();
    let currents = calls.iter().filter(
        |(_, t)| matches!(t, AmplifierCall::Command { current_a, .. } if *current_a != 0.0),
    );
    assert_eq!(currents.count(), 10);
    assert_eq!(
        calls.last().map(|(_, call)| *call),
        Some(AmplifierCall::Disable)
    );
}

#[test]
fn amplifier_is_not_enabled_without_a_recording() {
    let mut config = stage();
    (
        config.chirp.quiet_before_s,
        config.chirp.duration_s,
        config.chirp.quiet_after_s,
    ) = (0.0, 0.2, 0.0);
    let plan = Plan::chirp(config);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("a_file");
    std::fs::write(&file, "a file instead of a folder").expect("a file");
    // No user, not even root, can create a file in /proc.
    for out in [Path::new("/proc"), &file] {
        for pace in [Pace::Virtual, Pace::Realtime] {
            let rig = LoggedRig::new(StillRig::default());
            let log = Arc::clone(&rig.log);
            let error = bench_experiment::run(&plan, Box::new(rig), pace, out, &mut |_, _| {})
                .err()
                .expect("no recording");
            assert!(error.to_string().contains("nothing was moved"), "{error}");
            // The loop's thread holds the log until it ends.
            let has_ended = (0..6000).any(|_| {
                std::thread::sleep(Duration::from_millis(10));
                Arc::strong_count(&log) == 1
            });
            assert!(has_ended, "the loop still runs");
            let calls = log.lock().expect("not poisoned").clone();
            assert!(
                calls
                    .iter()
                    .all(|(_, call)| *call == AmplifierCall::Disable),
                "{calls:?}"
            );
        }
    }
}
