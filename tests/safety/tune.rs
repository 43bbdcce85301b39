//! Reference and loop gain of a run in progress change along a ramp, without a step.
use std::f64::consts::TAU;
use std::sync::mpsc::Sender;

use bench_config::{Config, ReferenceSettings};
use bench_control::{ControlLaw, LawInput};
use bench_excitation::Reference;
use bench_experiment::{LiveRig, Plan, Stage, TuneRefusal, check_tune, closed_loop, replay};
use bench_recording::Recording;
use bench_rig::simulated::SimulatedRig;
use bench_rt::program::{Control, Program};
use bench_rt::record::{EventKind, Refusal, RequestKind, TickRecord};
use bench_rt::servo::Request;
use bench_rt::thread::Pace;
use bench_rt::tuning::{Factors, Tune, TuneError};

use crate::safety::rig::{Bench, StillRig, endless, stage};

const RAMP_TICKS: u64 = 500;

fn tune(reference: f64, gain: f64) -> Tune {
    Tune::new(Factors { reference, gain }, RAMP_TICKS).expect("within the limits")
}

/// A law u = K (r - y) in A/m.
struct Proportional(f64);

impl ControlLaw for Proportional {
    fn reset(&mut self, _rest_m: f64) {}
    fn update(&mut self, input: &LawInput) -> f64 {
        self.0 * (input.reference_m - input.position_m)
    }
}

/// A constant reference in metres.
struct Constant(f64);

impl Reference for Constant {
    fn at_m(&self, _tick: u64) -> f64 {
        self.0
    }
}

/// The cycloid of the ramp: 1 before, 0 after.
fn left(tick: u64) -> f64 {
    let x = (tick as f64 / RAMP_TICKS as f64).min(1.0);
    1.0 - x + (TAU * x).sin() / TAU
}

fn control(law: impl ControlLaw + 'static, reference_m: f64) -> Box<dyn Program> {
    let reference = Constant(reference_m);
    Box::new(Control::new(
        Box::new(law),
        Box::new(reference),
        2,
        u64::MAX / 2,
    ))
}

/// The loop around a stage that does not move, with a proportional law, after a change at tick 100.
fn still_after(change: Tune) -> Vec<TickRecord> {
    let mut bench = Bench::running(&stage(), &[], control(Proportional(1e4), 20e-6));
    let mut records: Vec<TickRecord> = (0..100).map(|_| bench.tick()).collect();
    bench.request(Request::Tune(change));
    records.extend((0..2 * RAMP_TICKS).map(|_| bench.tick()));
    records
}

#[test]
fn reference_and_gain_follow_the_ramp() {
    for (record, ticks) in still_after(tune(0.25, 3.0)).iter().skip(100).zip(1..) {
        let reference = 0.25 + 0.75 * left(ticks);
        let gain = 3.0 - 2.0 * left(ticks);
        // The rest position is the mean of +-1 nm; rounding is far below 1e-15 m.
        let expected_m = 20e-6 * reference;
        assert!(
            (record.reference_m - expected_m).abs() < 1.1e-9,
            "{ticks}: {record:?}"
        );
        let error_m = record.reference_m - record.position_m;
        let expected_a = gain * 1e4 * error_m;
        assert!(
            (record.requested_a - expected_a).abs() < 1e-12,
            "{ticks}: {record:?}"
        );
    }
}

#[test]
fn a_second_change_begins_where_the_first_one_is() {
    let mut bench = Bench::running(&stage(), &[], control(Proportional(1e4), 20e-6));
    for _ in 0..100 {
        bench.tick();
    }
    bench.request(Request::Tune(tune(-1.0, 1.0)));
    let mut before = (0..RAMP_TICKS / 2)
        .map(|_| bench.tick())
        .last()
        .expect("ticks");
    bench.request(Request::Tune(tune(1.0, 1.0)));
    for _ in 0..RAMP_TICKS {
        let record = bench.tick();
        // Steepest slope of the cycloid: 2/N of the change, which is at most 2 times 20 um.
        let step_m = (record.reference_m - before.reference_m).abs();
        assert!(step_m < 2.0 / RAMP_TICKS as f64 * 40e-6 + 1e-12, "{step_m}");
        before = record;
    }
    assert!((before.reference_m - 20e-6).abs() < 1.1e-9, "{before:?}");
}

#[test]
fn gain_changes_without_a_step_of_the_current_of_a_loop_at_its_set_point() {
    let mut config = stage();
    config.sim.floor.clear();
    (
        config.sim.probe_noise_rms_m,
        config.sim.probe_quantisation_m,
    ) = (0.0, 0.0);
    config.control.controller = "slow".into();
    config.control.duration_s = 10.0;
    let plan = Plan::control(config).expect("a plan");
    let rig = SimulatedRig::new(&plan.config).expect("a rig");
    let mut bench = Bench::around(&plan.config, rig);
    bench.request(Request::Arm);
    bench.request(Request::Start(plan.program().expect("a program")));
    let settled = (0..25_000).map(|_| bench.tick()).last().expect("ticks");
    assert!(
        settled.requested_a.abs() > 0.01,
        "it holds a current: {settled:?}"
    );
    bench.request(Request::Tune(tune(1.0, 1.3)));
    let changed: Vec<TickRecord> = (0..2 * RAMP_TICKS).map(|_| bench.tick()).collect();
    let largest = |f: &dyn Fn(&TickRecord) -> f64| changed.iter().map(f).fold(0.0, f64::max);
    let current_a = largest(&|tick| (tick.requested_a - settled.requested_a).abs());
    let moved_m = largest(&|tick| (tick.position_m - settled.position_m).abs());
    // 30 % of the current would be a step of 0.3. What is left of the approach to the set-point moves it by less than 1 %.
    assert!(
        current_a < 0.01 * settled.requested_a.abs(),
        "{current_a} A of {settled:?}"
    );
    assert!(moved_m < 0.1e-6, "{moved_m} m");
}

fn refusals(bench: &Bench) -> Vec<Option<Refusal>> {
    let events = bench.events().into_iter();
    let tunes = events.filter_map(|event| match event.kind {
        EventKind::Request(request) => match request.kind {
            RequestKind::Tune(_) => Some(request.refusal),
            _ => None,
        },
        _ => None,
    });
    tunes.collect()
}

#[test]
fn refuses_a_change_without_a_run_and_of_an_excitation() {
    let mut bench = Bench::around(&stage(), StillRig::default());
    bench.request(Request::Tune(tune(0.5, 1.0)));
    bench.tick();
    bench.request(Request::Arm);
    bench.request(Request::Start(endless(|_| 0.1)));
    bench.tick();
    bench.request(Request::Tune(tune(0.5, 1.0)));
    let record = bench.tick();
    assert_eq!(
        refusals(&bench),
        [Some(Refusal::NoRun), Some(Refusal::NotTunable)]
    );
    assert_eq!(record.requested_a, 0.1);
}

#[test]
fn refuses_factors_that_are_not_numbers_or_beyond_their_limits() {
    let new = |reference, gain| Tune::new(Factors { reference, gain }, 1);
    for reference in [f64::NAN, f64::INFINITY, 10.1, -10.1] {
        assert!(
            matches!(new(reference, 1.0), Err(TuneError::Reference(_))),
            "{reference}"
        );
    }
    for gain in [f64::NAN, f64::INFINITY, 0.0, -1.0, 10.1] {
        assert!(matches!(new(1.0, gain), Err(TuneError::Gain(_))), "{gain}");
    }
    assert_eq!(Tune::new(Factors::default(), 0), Err(TuneError::Ramp));
    assert!(new(-10.0, 10.0).is_ok() && new(0.0, 1e-3).is_ok());
}

fn step_plan(controller: &str, amplitude_m: f64) -> Plan {
    let mut config: Config = stage();
    config.control.controller = controller.into();
    config.control.duration_s = 2.0;
    let ReferenceSettings::Step(step) = &mut config.control.reference else {
        panic!("the default reference is a step");
    };
    step.amplitude_m = amplitude_m;
    Plan::control(config).expect("a plan")
}

#[test]
fn refuses_a_gain_with_too_small_a_margin() {
    let mut plan = step_plan("slow", 20e-6);
    let check = |plan: &Plan, gain| {
        let factors = Factors {
            reference: 1.0,
            gain,
        };
        check_tune(plan, factors, Stage::Devices)
    };
    plan.config.control.min_modulus_margin = 0.0;
    // Stability follows from the poles, the gain margin from the response: two computations of one limit.
    let margins = closed_loop(&plan.config).expect("a loop").margins();
    let margin_db = margins.gain_margin_db.expect("a crossing");
    let limit = 10_f64.powf(margin_db / 20.0);
    assert_eq!(check(&plan, 0.999 * limit), Ok(()));
    let refused = check(&plan, 1.001 * limit);
    assert!(
        matches!(refused, Err(TuneRefusal::Margin(_))),
        "{refused:?}"
    );
    // The modulus margin is 0.72 at the gain of the design.
    plan.config.control.min_modulus_margin = 0.7;
    assert_eq!(check(&plan, 1.0), Ok(()));
    let refused = check(&plan, 1.5);
    assert!(
        matches!(refused, Err(TuneRefusal::Margin(_))),
        "{refused:?}"
    );
}

#[test]
fn refuses_a_reference_beyond_the_interlocks() {
    let plan = step_plan("slow", 100e-6);
    let check = |reference| {
        check_tune(
            &plan,
            Factors {
                reference,
                gain: 1.0,
            },
            Stage::Devices,
        )
    };
    assert_eq!(check(-1.0), Ok(()));
    // 10 times 100 um are beyond the soft limit of 900 um.
    assert!(
        matches!(check(10.0), Err(TuneRefusal::Plan(_))),
        "{:?}",
        check(10.0)
    );
    let chirp = Plan::chirp(stage());
    let refused = check_tune(&chirp, Factors::default(), Stage::Devices);
    assert_eq!(refused, Err(TuneRefusal::NoLoop));
}

/// Sends a change as soon as a quarter of the run is done.
fn tune_once(tuner: &Sender<Tune>, change: Tune) -> impl FnMut(u64, u64) {
    let tuner = tuner.clone();
    let mut waits = true;
    move |done, total| {
        if waits && 4 * done > total {
            waits = false;
            tuner.send(change).expect("the rig is open");
        }
    }
}

#[test]
fn a_changed_run_records_the_values_and_replays_bit_for_bit() {
    let mut plan = step_plan("fast", 20e-6);
    plan.config.control.duration_s = 20.0;
    let plan = Plan::control(plan.config).expect("a plan");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rig = Box::new(SimulatedRig::new(&plan.config).expect("a rig"));
    let mut live = LiveRig::open(rig, &plan.config, Pace::Virtual).expect("a thread");
    let change = tune(0.5, 0.8);
    live.tuner().send(tune(9.0, 9.0)).expect("the rig is open"); // before the run: discarded
    let tuner = live.tuner();
    let mut watch = tune_once(&tuner, change);
    let run = live.run(&plan, folder.path(), &mut watch).expect("a run");
    let path = run.path.clone();
    run.finish("{}").expect("a good disk");
    let recording = Recording::open(&path).expect("a recording");
    let events = recording.events().iter();
    let tunes: Vec<_> = events
        .filter_map(|event| match event.kind {
            EventKind::Request(request) => Some(request),
            _ => None,
        })
        .filter(|request| matches!(request.kind, RequestKind::Tune(_)))
        .collect();
    let kinds: Vec<_> = tunes.iter().map(|request| request.kind).collect();
    assert_eq!(kinds, [RequestKind::Tune(change)]);
    assert_eq!(tunes[0].refusal, None, "it was taken while the run went on");
    let replayed = replay(&recording).expect("it can be replayed");
    assert_eq!((replayed.different, replayed.first), (0, None));
    let references = recording
        .ticks()
        .expect("ticks")
        .map(|tick| tick.expect("a tick").reference_m);
    let (lowest, highest) = references.fold((f64::MAX, f64::MIN), |(a, b), r| (a.min(r), b.max(r)));
    assert!(
        highest - lowest < 21e-6,
        "{lowest} to {highest}: no other factor"
    );
}
