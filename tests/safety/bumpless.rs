//! Bumpless closing of the loop: neither a probe offset nor an old set-point causes a step of the current.
use std::ops::Range;

use bench_config::{Config, ReferenceSettings};
use bench_control::{ControlLaw, Controller, ControllerText, LawInput, SectionController};
use bench_excitation::{HoldReference, Reference, ReferenceContext};
use bench_rig::simulated::SimulatedRig;
use bench_rt::arming::State;
use bench_rt::program::{Control, Program, ProgramInput};
use bench_rt::record::{TickRecord, flag};
use bench_rt::servo::Request;

use crate::safety::faulty_rig::{Fault, FaultyRig};
use crate::safety::rig::{Bench, stage};

const ALWAYS: Range<u64> = 0..u64::MAX;

/// Largest deviation of a reading at rest from the mean of half a second, exceeded with a probability of 1e-8 per tick.
/// The probe has a noise of 40 nm and a quantisation of 30 nm/sqrt(12). The 8 Hz line of the floor moves the stage (29 Hz) by
/// a/w^2 = 24 nm, the 70 Hz line (second mode at 83 Hz, a/(83 Hz^2 - 70 Hz^2)) by at most 23 nm. The sum is about 50 nm RMS;
/// six sigma are 300 nm. Twice this value allows for modes that the floor excites.
const REST_M: f64 = 0.6e-6;

fn config(controller: &str, seed: u64) -> Config {
    let mut config = stage();
    config.control.controller = controller.into();
    config.sim.seed = seed;
    config
}

fn controller(config: &Config) -> Controller {
    let text = ControllerText::find(&config.control.controller).expect("a controller");
    Controller::new(
        &text.sections(config.servo.rate_hz).expect("valid"),
        config.servo.period_s(),
    )
}

fn reference(config: &Config, settings: &ReferenceSettings) -> Box<dyn Reference> {
    let context = ReferenceContext {
        chirp: &config.chirp,
        period_s: config.servo.period_s(),
        file: None,
    };
    settings.design().build(&context).expect("no file")
}

fn program(config: &Config, settle: u64, closed: u64) -> Control {
    let reference = reference(config, &config.control.reference);
    let law = SectionController::new(controller(config));
    Control::new(Box::new(law), reference, settle, closed)
}

/// For each tick, the largest command that control errors of at most 1 m can cause: the sum of the magnitudes of the impulse
/// response.
fn largest_gains(config: &Config, ticks: usize) -> Vec<f64> {
    let controller = controller(config);
    let mut state = controller.at_rest();
    let impulse = (0..ticks).map(|tick| {
        controller
            .update(&mut state, if tick == 0 { 1.0 } else { 0.0 })
            .abs()
    });
    impulse
        .scan(0.0, |sum, h| Some(*sum + h).inspect(|s| *sum = *s))
        .collect()
}

fn input(tick: u64, position_m: f64) -> ProgramInput {
    ProgramInput {
        tick,
        position_m,
        ..ProgramInput::default()
    }
}

fn error(reference_m: f64) -> LawInput {
    LawInput {
        reference_m,
        ..LawInput::default()
    }
}

fn closed(bench: &Bench, from: u64) -> Vec<TickRecord> {
    bench
        .ticks()
        .iter()
        .filter(|r| r.tick >= from && r.flags & flag::ACTIVE != 0)
        .copied()
        .collect()
}

/// Asserts that the first commands are those of a controller at rest whose input is only the noise at rest.
fn assert_bumpless(config: &Config, records: &[TickRecord], offset_m: f64, what: &str) {
    let gains = largest_gains(config, 50);
    assert!(records.len() >= gains.len());
    for (record, gain) in records.iter().zip(&gains) {
        assert!(
            (record.reference_m - offset_m).abs() < REST_M,
            "{what}: the origin is the rest position: {record:?}"
        );
        assert!(
            (record.position_m - record.reference_m).abs() < REST_M,
            "{what}: {record:?}"
        );
        assert!(
            record.command_a.abs() <= gain * REST_M,
            "{what}: beyond {} A: {record:?}",
            gain * REST_M
        );
    }
    assert!(
        records.iter().any(|r| r.command_a != 0.0),
        "{what}: the loop is closed"
    );
    // With an origin of zero the controller would receive the offset: 300 um instead of REST_M.
}

#[test]
fn closing_the_loop_with_probe_offset_is_bumpless() {
    for name in ["fast", "slow"] {
        for (seed, offset_m) in [(1, 300e-6), (2, -300e-6), (3, 0.0), (4, 850e-6)] {
            let mut config = config(name, seed);
            config.control.reference = ReferenceSettings::Hold(HoldReference {});
            let rig = SimulatedRig::new(&config).expect("a rig");
            let mut bench = Bench::around(
                &config,
                FaultyRig::new(rig, &[(ALWAYS, Fault::Offset(offset_m))]),
            );
            bench.request(Request::Arm);
            bench.request(Request::Start(Box::new(program(&config, 2500, 2500))));
            bench.run(5000);
            assert_eq!(bench.trips(), []);
            assert_bumpless(
                &config,
                &closed(&bench, 0),
                offset_m,
                &format!("{name}, offset {offset_m}"),
            );
        }
    }
}

#[test]
fn no_current_flows_before_the_loop_closes() {
    let config = config("fast", 1);
    let rig = SimulatedRig::new(&config).expect("a rig");
    let mut bench = Bench::around(
        &config,
        FaultyRig::new(rig, &[(ALWAYS, Fault::Offset(300e-6))]),
    );
    bench.request(Request::Arm);
    bench.request(Request::Start(Box::new(program(&config, 2500, 100))));
    bench.run(2500);
    assert!(
        bench
            .ticks()
            .iter()
            .all(|r| r.state == State::Running && r.command_a.to_bits() == 0)
    );
    let mean_m = bench.ticks().iter().map(|r| r.position_m).sum::<f64>() / 2500.0;
    let origin_m = bench.ticks().last().expect("ticks").reference_m;
    // A running mean of 2500 values of 3e-4; each step has a relative rounding error of 1e-16.
    assert!(
        (origin_m - mean_m).abs() < 1e-16,
        "{origin_m:e} for {mean_m:e}"
    );
}

#[test]
fn second_run_starts_from_rest_without_the_old_set_point() {
    for name in ["fast", "slow"] {
        // The first run ends at a step of 50 um, held by current. Then the stage returns to rest: 10 s are 16 time constants of
        // its first mode (zeta w = 1.66 1/s), 50 um e^-16 = 6 pm.
        let mut config = config(name, 5);
        let rig = SimulatedRig::new(&config).expect("a rig");
        let mut bench = Bench::around(
            &config,
            FaultyRig::new(rig, &[(ALWAYS, Fault::Offset(100e-6))]),
        );
        bench.request(Request::Arm);
        bench.request(Request::Start(Box::new(program(&config, 2500, 10_000))));
        bench.run(12_500);
        let end = *bench.ticks().last().expect("ticks");
        assert!(
            (end.reference_m - 150e-6).abs() < REST_M && end.command_a.abs() > 0.01,
            "{name}: {end:?}"
        );
        bench.run(50_000);

        config.control.reference = ReferenceSettings::Hold(HoldReference {});
        let from = bench.ticks().last().expect("ticks").tick + 1;
        bench.request(Request::Arm);
        bench.request(Request::Start(Box::new(program(&config, 2500, 2500))));
        bench.run(5000);
        let second = closed(&bench, from);
        assert_bumpless(&config, &second, 100e-6, &format!("{name}, second run"));

        // Bit for bit the decisions of a new program with the same positions.
        let mut fresh = program(&config, 2500, 2500);
        let records = bench.ticks();
        for (tick, record) in records
            .iter()
            .filter(|r| r.tick >= from && r.state == State::Running)
            .enumerate()
        {
            let decision = fresh.decide(&input(tick as u64, record.position_m));
            let bits = [record.requested_a, record.reference_m].map(f64::to_bits);
            assert_eq!(
                [decision.requested_a, decision.reference_m].map(f64::to_bits),
                bits,
                "{name}: {record:?}"
            );
        }
    }
}

#[test]
fn reused_controller_starts_from_rest() {
    for name in ["fast", "slow"] {
        let mut config = config(name, 6);
        config.control.reference = ReferenceSettings::Hold(HoldReference {});
        let mut used = SectionController::new(controller(&config));
        let last_a = (0..1000).map(|_| used.update(&error(100e-6))).last();
        assert!(
            last_a.is_some_and(|current_a| current_a.abs() > 1e-3),
            "{last_a:?}"
        );
        let hold = || reference(&config, &ReferenceSettings::Hold(HoldReference {}));
        let mut after = Control::new(Box::new(used), hold(), 10, 100);
        let mut fresh = Control::new(
            Box::new(SectionController::new(controller(&config))),
            hold(),
            10,
            100,
        );
        for tick in 0..110 {
            let position_m = 1e-6 * (tick % 3) as f64;
            assert_eq!(
                after.decide(&input(tick, position_m)),
                fresh.decide(&input(tick, position_m)),
                "{name} at tick {tick}"
            );
        }
    }
}
