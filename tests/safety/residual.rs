//! The residual monitor: a position that does not answer the current trips below 10 % of the travel limit and below 2 A.
use std::sync::{Arc, Mutex};
use std::task::Poll;

use bench_config::{Config, Source, load};
use bench_experiment::{Plan, replay, residuals, run};
use bench_hal::{AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, Reading, Tick};
use bench_recording::Recording;
use bench_rig::simulated::SimulatedRig;
use bench_rt::arming::Trip;
use bench_rt::interlock::Interlocks;
use bench_rt::program::Decision;
use bench_rt::thread::Pace;

use crate::safety::rig::interlocks;

/// 10 % of the travel limit of 900 um.
const TRAVEL_M: f64 = 90e-6;
const CURRENT_A: f64 = 2.0;

/// What is wrong between amplifier and probe.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Wiring {
    Correct,
    /// The probe returns noise of +-0.5 um only.
    DetachedProbe,
    /// The probe measures another stage, which oscillates by 12 um at 7 Hz.
    OtherStage,
    /// The force has the opposite sign.
    SwappedLeads,
    /// The amplifier accepts the set-points, but there is no force.
    LostCable,
}

/// Largest true position and current up to now.
#[derive(Clone, Copy, Debug, Default)]
struct Extremes {
    position_m: f64,
    current_a: f64,
}

struct WrongRig {
    inner: SimulatedRig,
    wiring: Wiring,
    random: u64,
    extremes: Arc<Mutex<Extremes>>,
}

impl WrongRig {
    /// Uniform between -1 and 1, by a linear congruential generator (Knuth's MMIX).
    fn uniform(&mut self) -> f64 {
        self.random = self
            .random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.random >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

impl CurrentAmplifier for WrongRig {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        self.inner.begin_enable()
    }
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        self.inner.poll_enable()
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        let force_sign = match self.wiring {
            Wiring::Correct | Wiring::DetachedProbe | Wiring::OtherStage => 1.0,
            Wiring::SwappedLeads => -1.0,
            Wiring::LostCable => 0.0,
        };
        let mut extremes = self.extremes.lock().expect("no test panics with it");
        extremes.current_a = extremes.current_a.max(current_a.abs());
        self.inner.command(force_sign * current_a)?;
        Ok(current_a)
    }
    fn disable(&mut self) {
        self.inner.disable();
    }
    fn status(&self) -> AmplifierStatus {
        self.inner.status()
    }
}

impl DisplacementProbe for WrongRig {
    fn latest(&mut self, now: Tick) -> Reading {
        let reading = self.inner.latest(now);
        let noise_m = 0.5e-6 * self.uniform();
        let true_m = self.inner.true_position_m().abs();
        let mut extremes = self.extremes.lock().expect("no test panics with it");
        extremes.position_m = extremes.position_m.max(true_m);
        let position_m = match self.wiring {
            Wiring::Correct | Wiring::SwappedLeads | Wiring::LostCable => reading.position_m,
            Wiring::DetachedProbe => noise_m,
            Wiring::OtherStage => {
                let phase = std::f64::consts::TAU * 7.0 * now.scheduled_ns as f64 * 1e-9;
                12e-6 * phase.sin() + noise_m
            }
        };
        Reading {
            position_m,
            ..reading
        }
    }
}

fn config(sets: &[&str]) -> Config {
    let sets = sets.iter().map(|set| set.to_string()).collect();
    load(&Source {
        sets,
        ..Source::default()
    })
    .expect("valid")
}

/// The trip and the extremes of a run, whose recording must replay bit for bit.
fn run_wired(plan: &Plan, wiring: Wiring) -> (Option<Trip>, Extremes) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let extremes = Arc::new(Mutex::new(Extremes::default()));
    let rig = WrongRig {
        inner: SimulatedRig::new(&plan.config).expect("a rig"),
        wiring,
        random: 1,
        extremes: Arc::clone(&extremes),
    };
    let ended = run(
        plan,
        Box::new(rig),
        Pace::Virtual,
        folder.path(),
        &mut |_, _| {},
    );
    let ended = ended.expect("a run");
    let (path, trip) = (ended.path.clone(), ended.end.servo.trip);
    ended.finish("{}").expect("a good disk");
    let replayed = replay(&Recording::open(&path).expect("a recording")).expect("replayable");
    assert_eq!(replayed.different, 0, "{wiring:?}: {replayed:?}");
    let extremes = *extremes.lock().expect("no test panics with it");
    println!("{wiring:?}: {trip:?}, {extremes:?}");
    (trip.map(|(trip, _)| trip), extremes)
}

fn trips_early(plan: &Plan, wiring: Wiring) {
    let (trip, extremes) = run_wired(plan, wiring);
    assert!(
        matches!(trip, Some(Trip::ModelError { .. })),
        "{wiring:?}: {trip:?}"
    );
    assert!(
        extremes.position_m < TRAVEL_M && extremes.current_a < CURRENT_A,
        "{wiring:?}: {extremes:?}"
    );
}

fn loop_plan(controller: &str, amplitude: &str, more: &[&str]) -> Plan {
    let controller = format!("control.controller={controller}");
    let amplitude = format!("control.reference.amplitude_m={amplitude}");
    let mut sets = vec![
        controller.as_str(),
        amplitude.as_str(),
        "control.duration_s=3",
    ];
    sets.extend(more);
    Plan::control(config(&sets)).expect("a plan")
}

const WRONG: [Wiring; 4] = [
    Wiring::DetachedProbe,
    Wiring::OtherStage,
    Wiring::SwappedLeads,
    Wiring::LostCable,
];

#[test]
fn wrong_wiring_trips_early_with_the_slow_controller() {
    for amplitude in ["10um", "50um"] {
        WRONG
            .into_iter()
            .for_each(|wiring| trips_early(&loop_plan("slow", amplitude, &[]), wiring));
    }
}

#[test]
fn wrong_wiring_trips_early_with_the_fast_controller() {
    for amplitude in ["10um", "50um"] {
        WRONG
            .into_iter()
            .for_each(|wiring| trips_early(&loop_plan("fast", amplitude, &[]), wiring));
    }
}

#[test]
fn wrong_wiring_trips_early_in_a_chirp() {
    let plan = Plan::chirp(config(&[]));
    WRONG
        .into_iter()
        .for_each(|wiring| trips_early(&plan, wiring));
}

/// The fast controller is designed for D = +10 %. At D = -10 % its loop is unstable (section 6.2). The oscillation is about the
/// reference, so its step must leave room below the limit.
#[test]
fn growing_oscillation_of_the_wrong_asymmetry_trips_early() {
    for amplitude in ["10um", "30um"] {
        let plan = loop_plan("fast", amplitude, &["sim.asymmetry_offset=-0.2"]);
        trips_early(&plan, Wiring::Correct);
    }
}

#[test]
fn loop_that_is_unstable_by_the_model_trips_early() {
    for amplitude in ["10um", "30um", "50um"] {
        let plan = loop_plan("fast", amplitude, &["plant.mass_asymmetry=-0.1"]);
        trips_early(&plan, Wiring::Correct);
    }
}

/// Switched off with a reason, the other interlocks decide: the same faults go further.
#[test]
fn monitor_is_off_with_a_reason() {
    let off = "interlock.model_error_off=\"model not known yet\"";
    for (controller, wiring) in [
        ("fast", Wiring::DetachedProbe),
        ("slow", Wiring::DetachedProbe),
        ("fast", Wiring::SwappedLeads),
        ("slow", Wiring::SwappedLeads),
        ("fast", Wiring::OtherStage),
        ("fast", Wiring::LostCable),
    ] {
        let (trip, extremes) = run_wired(&loop_plan(controller, "50um", &[off]), wiring);
        assert!(!matches!(trip, Some(Trip::ModelError { .. })), "{trip:?}");
        assert!(
            extremes.current_a > CURRENT_A || extremes.position_m > TRAVEL_M,
            "{extremes:?}"
        );
    }
    let plan = loop_plan("fast", "50um", &[off, "sim.asymmetry_offset=-0.2"]);
    let (_, extremes) = run_wired(&plan, Wiring::Correct);
    assert!(extremes.position_m > TRAVEL_M, "{extremes:?}");
}

#[test]
fn correct_wiring_runs_to_its_end() {
    for controller in ["slow", "fast"] {
        let (trip, _) = run_wired(&loop_plan(controller, "50um", &[]), Wiring::Correct);
        assert_eq!(trip, None);
    }
    assert_eq!(
        run_wired(&Plan::chirp(config(&[])), Wiring::Correct).0,
        None
    );
}

/// The interlocks of a plan with its monitor, at the beginning of a run.
fn monitored(plan: &Plan) -> Interlocks {
    let residuals = residuals(plan).expect("a model");
    assert!(residuals.is_some(), "the monitor is on by default");
    let mut interlocks = interlocks(&plan.config).with_residuals(residuals);
    interlocks.begin_run();
    interlocks
}

/// One tick of a closed loop: position and reference in metres.
fn closed_tick(
    interlocks: &mut Interlocks,
    position_m: f64,
    reference_m: f64,
    applied_a: f64,
) -> Result<(), Trip> {
    let checked = interlocks.check_motion(position_m, 0);
    let decision = Decision {
        reference_m,
        requested_a: applied_a,
        active: true,
        ..Decision::default()
    };
    interlocks.record_motion(&decision, 1.0, applied_a);
    checked
}

/// Every run has its own rest position, and its models begin at rest.
#[test]
fn second_run_is_compared_from_its_own_rest() {
    for amplitude in ["10um", "50um"] {
        let plan = loop_plan("fast", amplitude, &[]);
        let mut interlocks = monitored(&plan);
        for _ in 0..3000 {
            // The first run ends with a position that the second one must not know.
            let _ = closed_tick(&mut interlocks, 0.0, 50e-6, 0.3);
        }
        interlocks.begin_run();
        for tick in 0..5000 {
            let checked = closed_tick(&mut interlocks, 100e-6, 100e-6, 0.0);
            assert_eq!(checked, Ok(()), "tick {tick}");
        }
    }
}

#[test]
fn reference_counts_from_the_rest_position_where_it_replaces_the_model() {
    let plan = loop_plan("fast", "10um", &["plant.mass_asymmetry=-0.1"]);
    let mut interlocks = monitored(&plan);
    for tick in 0..5000 {
        let checked = closed_tick(&mut interlocks, 100e-6, 100e-6, 0.0);
        assert_eq!(checked, Ok(()), "tick {tick}");
    }
    let mut later = (0..100).map(|_| closed_tick(&mut interlocks, 100e-6, 150e-6, 0.0));
    let trip = later.find_map(Result::err);
    assert!(matches!(trip, Some(Trip::ModelError { .. })), "{trip:?}");
}

/// Settings that are accepted without a reason, each with the smallest effect that is.
const WEAKEST: [[&str; 2]; 4] = [
    [
        "interlock.model_error_ratio=0.125",
        "interlock.model_error_share=0.5",
    ],
    [
        "interlock.model_error_ratio=0.1949",
        "interlock.model_error_share=0.05",
    ],
    [
        "interlock.model_error_ratio=0.0625",
        "interlock.model_error_share=0.75",
    ],
    [
        "interlock.model_error_ratio=0.02",
        "interlock.model_error_share=0.91",
    ],
];

/// The reference fault: the fast controller at D = -10 %. Without the monitor it reaches 679 um and 9.87 A. An accepted monitor trips
/// at a deviation of a quarter of the travel limit, 225 um, and the swing after the trip adds less than that: the stage stays within half
/// of the limit, 450 um. The current grows with the motion: at most 9.87 A x 450/679.
#[test]
fn weakest_accepted_monitor_trips_on_the_growing_oscillation() {
    for sets in WEAKEST {
        let sets = [&sets[..], &["sim.asymmetry_offset=-0.2"]].concat();
        let (trip, extremes) = run_wired(&loop_plan("fast", "50um", &sets), Wiring::Correct);
        assert!(
            matches!(trip, Some(Trip::ModelError { .. })),
            "{sets:?}: {trip:?}"
        );
        assert!(
            extremes.position_m < 450e-6 && extremes.current_a < 9.87 * 450.0 / 679.0,
            "{sets:?}: {extremes:?}"
        );
    }
}

/// A position that stays at rest trips at a modelled motion of at most a quarter of the travel limit, 225 um; the low-pass of the plant,
/// with two time constants of 1/92 s, lets it go on for 22 ms, and the true position oscillates by up to its static part.
#[test]
fn weakest_accepted_monitor_trips_on_a_detached_probe() {
    for sets in WEAKEST {
        for controller in ["slow", "fast"] {
            let plan = loop_plan(controller, "50um", &sets);
            let (trip, extremes) = run_wired(&plan, Wiring::DetachedProbe);
            assert!(
                matches!(trip, Some(Trip::ModelError { .. })),
                "{sets:?}: {trip:?}"
            );
            assert!(extremes.position_m < 2.0 * 225e-6, "{sets:?}: {extremes:?}");
        }
    }
}
