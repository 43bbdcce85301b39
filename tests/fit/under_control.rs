//! Identification in closed loop with the fast controller: plant, loop, modes and zeros equal those of the open loop.
use std::f64::consts::TAU;

use bench_config::{Config, ReferenceSettings, Source, load};
use bench_excitation::SweptReference;
use bench_experiment::{Analysis, AnalysisError, Plan, ReadSignals, analyse, never_cancels};
use bench_identify::verdict::Cnmp;
use bench_plant::LoopPlant;
use bench_recording::Recording;
use bench_rig::simulated::modes as simulated_modes;
use bench_rt::arming::State;

use crate::fit::identified::analysed;
use crate::fit::simulated;

/// The default stage at 5 kHz.
fn config(sets: &[&str]) -> Config {
    let sets = sets.iter().map(|set| set.to_string()).collect();
    load(&Source {
        sets,
        ..Source::default()
    })
    .expect("the profile is valid")
}

fn identified_in_closed_loop(sets: &[&str]) -> Analysis {
    let config = config(
        &[
            &["control.reference={ kind = \"chirp\", travel_m = 20e-6 }"],
            sets,
        ]
        .concat(),
    );
    let plan = Plan::control(config).expect("a plan");
    simulated::analysed(&plan, &plan.config).expect("an analysis")
}

/// Upper limit of sigma/|H| for the comparison: errors below 4 sigma are then below 1 %.
const MAX_RELATIVE_SIGMA: f64 = 0.0025;

#[test]
fn closed_loop_plant_equals_the_rig_and_the_open_loop_within_1_percent() {
    let (closed, plain) = (identified_in_closed_loop(&[]), config(&[]));
    let open = analysed(&plain, &plain).frf;
    let rig = LoopPlant::with_mean_age(
        &plain,
        &simulated_modes(&plain.plant, &plain.sim).expect("modes"),
    );
    let mut compared = 0;
    for (k, f) in closed
        .frf
        .frequency_hz
        .iter()
        .enumerate()
        .filter(|(_, f)| (0.5..450.0).contains(*f))
    {
        let response = closed.frf.response[k];
        // The two records differ in length by half a second, and therefore in their bins. The open-loop response at the nearest bin is
        // corrected by the ratio of the rig's responses at the two frequencies.
        let near = open
            .frequency_hz
            .partition_point(|other| other < f)
            .min(open.len() - 1);
        let ratio = rig.response(TAU * f) / rig.response(TAU * open.frequency_hz[near]);
        let is_accurate = closed.frf.magnitude_sigma[k] < MAX_RELATIVE_SIGMA * response.norm()
            && open.magnitude_sigma[near] < MAX_RELATIVE_SIGMA * open.response[near].norm();
        if !is_accurate {
            continue;
        }
        compared += 1;
        assert!(
            (response / rig.response(TAU * f) - 1.0).norm() < 0.01,
            "{f} Hz: {response} differs from the rig"
        );
        // Two independent errors, each below 4 sigma = 1 %: 1.4 % together.
        assert!(
            (response / (open.response[near] * ratio) - 1.0).norm() < 0.014,
            "{f} Hz: {response} differs from the open loop"
        );
    }
    assert!(
        compared as f64 > 0.7 * closed.frf.len() as f64,
        "{compared} of {}",
        closed.frf.len()
    );
}

#[test]
fn closed_loop_record_gives_modes_zeros_and_margins() {
    let closed = identified_in_closed_loop(&[]);
    let modes = closed.fit.as_ref().expect("modes").modes();
    // Modes of the thesis model at Y1o = 8 % of L and D = +10 %, as in tests/support/src/stage.rs (computed from masses and beams).
    for (mode, (omega_rad_s, residue_per_kg)) in modes.iter().zip([
        (183.936_395, 0.471_522_5),
        (516.656_503, -0.031_943_85),
        (538.998_918, 0.020_850_64),
    ]) {
        assert!(
            (mode.omega_rad_s.value / omega_rad_s - 1.0).abs() < 5e-4,
            "{mode:?}"
        );
        assert!(
            (mode.residue_per_kg.value / residue_per_kg - 1.0).abs() < 0.03,
            "{mode:?}"
        );
    }
    assert_eq!(
        closed.verdict.cnmp,
        Cnmp::Detected,
        "{}",
        closed.verdict.why
    );
    let closed_loop = closed.closed.expect("a loop");
    let (measured, predicted) = (
        closed_loop.margins.modulus_margin,
        closed_loop.predicted.modulus_margin,
    );
    // Measured 0.42 +- 0.0007. The unmodelled modes, which the prediction does not contain, reduce it by 0.001.
    assert!(
        measured.sigma < 0.005 && (measured.value - predicted).abs() < 4.0 * measured.sigma + 2e-3,
        "{measured:?}"
    );
    let crossover = closed_loop.margins.crossover_rad_s.expect("a crossover");
    assert!(
        (crossover.value / closed_loop.predicted.crossover_rad_s.expect("one") - 1.0).abs() < 2e-3,
        "{crossover:?}"
    );
}

/// With the plan from the model, the stage moves at most by the requested travel (plus floor vibration), and the command is at most
/// the amplitude of `[chirp]`.
#[test]
fn planned_sweep_stays_within_travel_and_current() {
    let set = "control.reference={ kind = \"chirp\", travel_m = 10e-6 }";
    let plan = Plan::control(config(&[set, "chirp.duration_s=40"])).expect("a plan");
    let ReferenceSettings::Chirp(SweptReference { amplitude, .. }) = &plan.config.control.reference
    else {
        panic!()
    };
    assert!(amplitude.len() > 10 && amplitude.iter().all(|point| point.amplitude_m > 0.0));
    let folder = tempfile::tempdir().expect("a folder");
    let recording =
        Recording::open(&simulated::recorded(&plan, folder.path())).expect("a recording");
    let (mut travel_m, mut current_a) = (0.0_f64, 0.0_f64);
    for record in recording
        .ticks()
        .expect("ticks")
        .map(|record| record.expect("a tick"))
    {
        travel_m = travel_m.max(record.position_m.abs());
        current_a = current_a.max(record.command_a.abs());
    }
    // Upper limit: 10 um, plus 5 sigma of 0.05 um of floor vibration, 0.04 um of probe noise, and 10 % because a sweep through a
    // resonance at this rate may exceed the steady state for which it is planned.
    assert!((5e-6..11.5e-6).contains(&travel_m), "{travel_m}");
    assert!((0.5..3.3).contains(&current_a), "{current_a}");
    let predicted_extremes = plan.predicted_extremes.expect("a prediction");
    assert!(
        (predicted_extremes.travel_m - travel_m).abs() < 0.5e-6
            && (predicted_extremes.current_a / current_a - 1.0).abs() < 0.02
    );
    assert_eq!(
        bench_experiment::replay(&recording)
            .expect("a replay")
            .different,
        0
    );
}

/// The slow controller hardly follows a reference at 450 Hz: the current of the chirp would need an amplitude of 60 m there.
#[test]
fn recorded_sweep_with_the_slow_controller_gives_the_same_plan() {
    let set = "control.reference={ kind = \"chirp\", travel_m = 20e-6 }";
    let sets = [
        set,
        "control.controller=slow",
        "chirp.duration_s=10",
        "chirp.fade_in_s=1",
    ];
    let plan = Plan::control(config(&sets)).expect("a plan");
    let ReferenceSettings::Chirp(SweptReference { amplitude, .. }) = &plan.config.control.reference
    else {
        panic!()
    };
    // The amplitude of the reference is limited to the soft limit of 0.9 mm. At low frequencies, where the loop follows, it is the travel.
    let largest_m = amplitude
        .iter()
        .map(|point| point.amplitude_m)
        .fold(0.0, f64::max);
    assert!((0.89e-3..=0.9e-3).contains(&largest_m), "{largest_m}");
    assert!(
        (19e-6..21e-6).contains(&amplitude[0].amplitude_m),
        "{amplitude:?}"
    );
    let folder = tempfile::tempdir().expect("a folder");
    let recording =
        Recording::open(&simulated::recorded(&plan, folder.path())).expect("a recording");
    assert_eq!(
        Plan::of(&recording).expect("the same plan").config,
        plan.config
    );
}

#[test]
fn rejects_sweep_beyond_an_interlock_before_any_motion() {
    let point = |set: &str| {
        format!("control.reference={{ kind = \"chirp\", travel_m = 1e-6, amplitude = [{set}] }}")
    };
    for (amplitude, limit) in [
        (
            "{ frequency_hz = 1.0, amplitude_m = 800e-6 }",
            "the motor's peak current",
        ),
        // A static displacement of 600 um needs 4 A; the continuous current of the motor is 2.3 A.
        (
            "{ frequency_hz = 30.0, amplitude_m = 600e-6 }, { frequency_hz = 60.0, amplitude_m = 1e-6 }",
            "thermal current",
        ),
    ] {
        let error = Plan::control(config(&[&point(amplitude)]))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains(limit) && error.contains("control.reference"),
            "{error}"
        );
    }
}

#[test]
fn rejects_analysis_without_swept_reference_and_names_the_remedy() {
    let plan = Plan::control(config(&["control.duration_s=1"])).expect("a plan");
    let error = simulated::analysed(&plan, &plan.config)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("step") && error.contains("--reference chirp"),
        "{error}"
    );
}

/// A recording that ends before the loop closes has neither command nor reference.
#[test]
fn run_that_trips_before_the_loop_closes_gives_no_response() {
    let swept = "control.reference={ kind = \"chirp\", travel_m = 20e-6 }";
    // Sigma is a third of the soft limit: one reading in 370 exceeds it, of 2500 readings before the loop closes.
    let sets = [
        swept,
        "chirp.duration_s=10",
        "chirp.fade_in_s=1",
        "sim.probe_noise_rms_m=3e-4",
    ];
    let plan = Plan::control(config(&sets)).expect("a plan");
    let folder = tempfile::tempdir().expect("a folder");
    let (path, ended) = simulated::ended(&plan, folder.path());
    let (_, tick) = ended.trip.expect("a trip");
    assert!(
        (tick as f64) < plan.config.control.settle_s * 5000.0,
        "{ended:?}"
    );
    let recording = Recording::open(&path).expect("a recording");
    let running = recording
        .ticks()
        .expect("ticks")
        .filter(|tick| tick.as_ref().expect("whole").state == State::Running);
    assert!(running.count() > 10, "the program did not run");
    let answer = analyse(
        &recording,
        ReadSignals::default(),
        &plan.config,
        &mut never_cancels,
    );
    assert!(
        matches!(answer, Err(AnalysisError::NothingRan)),
        "{:?}",
        answer.err()
    );
}
