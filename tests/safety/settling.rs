//! The end of a run: reference and current go to zero along ramps; a trip and a stop request cut the current at once.
use bench_config::Config;
use bench_control::{Controller, ControllerText, SectionController};
use bench_excitation::Reference;
use bench_hal::Validity;
use bench_rig::simulated::SimulatedRig;
use bench_rt::arming::State;
use bench_rt::program::{Control, Excite, Program};
use bench_rt::record::{EventKind, TickRecord, flag};
use bench_rt::servo::Request;
use bench_rt::settling::{Settling, SettlingStep};

use crate::safety::faulty_rig::Fault;
use crate::safety::rig::{Bench, CurrentProgram, endless, stage};

/// Three periods of the first mode of the stage, 22.87 Hz, at 5 kHz.
const RAMP_TICKS: u64 = 656;
/// The position at which the runs end in metres.
const END_M: f64 = 600e-6;
/// Ticks before the loop closes.
const REST_TICKS: u64 = 500;

/// Ticks in closed loop: a ramp to [`END_M`] of 1 s, and 1 s there.
const CLOSED_TICKS: u64 = 10_000;

/// A ramp to [`END_M`], from the tick at which the loop closes.
struct RampToEnd;

impl Reference for RampToEnd {
    fn at_m(&self, tick: u64) -> f64 {
        END_M * (tick as f64 / 5000.0).min(1.0)
    }
}

fn config(controller: &str) -> Config {
    let mut config = stage();
    config.control.controller = controller.into();
    config
}

fn to_end_position(config: &Config) -> Box<dyn Program> {
    let text = ControllerText::find(&config.control.controller).expect("a controller");
    let sections = text.sections(config.servo.rate_hz).expect("valid");
    let law = SectionController::new(Controller::new(&sections, config.servo.period_s()));
    Box::new(Control::new(
        Box::new(law),
        Box::new(RampToEnd),
        REST_TICKS,
        CLOSED_TICKS,
    ))
}

/// A loop of the simulated stage that runs `program`, until half a second after its end.
fn simulated(config: &Config, program: Box<dyn Program>, ramp_ticks: u64, ticks: u64) -> Bench {
    let rig = SimulatedRig::new(config).expect("a valid plant");
    let mut bench = Bench::around(config, rig).with_ramps(ramp_ticks);
    bench.request(Request::Arm);
    bench.request(Request::Start(program));
    bench.run(ticks);
    bench
}

/// The records after the program was completed.
fn after_completion(bench: &Bench) -> Vec<TickRecord> {
    let events = bench.events();
    let end = events
        .iter()
        .find(|event| event.kind == EventKind::Completed);
    let end = end.expect("the program is completed").tick;
    let records = bench.ticks();
    records.iter().filter(|r| r.tick > end).copied().collect()
}

fn lowest_m(records: &[TickRecord]) -> f64 {
    let positions = records.iter().map(|record| record.position_m);
    positions.fold(f64::INFINITY, f64::min)
}

/// The largest change of the command from a tick to the next in amperes.
fn largest_step_a(records: &[TickRecord]) -> f64 {
    let steps = records
        .windows(2)
        .map(|pair| (pair[1].command_a - pair[0].command_a).abs());
    steps.fold(0.0, f64::max)
}

#[test]
fn completion_at_600_um_swings_by_less_than_5_percent_of_the_swing_without_ramps() {
    for controller in ["slow", "fast"] {
        let config = config(controller);
        let ticks = REST_TICKS + CLOSED_TICKS + 2 * RAMP_TICKS + 2500;
        let swing_m = |ramp_ticks| {
            let program = to_end_position(&config);
            let bench = simulated(&config, program, ramp_ticks, ticks);
            assert_eq!(bench.trips(), [], "{controller}");
            let after = after_completion(&bench);
            assert!(after[0].position_m > 0.98 * END_M, "{controller}");
            assert_eq!(bench.state(), State::Disarmed);
            -lowest_m(&after)
        };
        let (cut_m, ramp_m) = (swing_m(0), swing_m(RAMP_TICKS));
        // One step of the current lets the stage swing to nearly the same distance on the other side: damping 0.9 %.
        assert!(
            (0.9 * END_M..END_M).contains(&cut_m),
            "{controller}: {cut_m}"
        );
        assert!(
            ramp_m < 0.05 * cut_m && ramp_m > -END_M,
            "{controller}: {ramp_m}"
        );
    }
}

#[test]
fn ended_closed_loop_returns_to_rest_and_then_disarms() {
    let config = config("fast");
    let program = to_end_position(&config);
    let ticks = REST_TICKS + CLOSED_TICKS + 2 * RAMP_TICKS + 10;
    let bench = simulated(&config, program, RAMP_TICKS, ticks);
    let after = after_completion(&bench);
    let settling = after
        .iter()
        .take_while(|record| record.state == State::Settling);
    let settling = settling.count() as u64;
    assert!(
        (RAMP_TICKS..=2 * RAMP_TICKS).contains(&settling),
        "{settling}"
    );
    // The reference falls from its last value to the rest position during the first ramp.
    let references: Vec<f64> = after[..RAMP_TICKS as usize - 1]
        .iter()
        .map(|record| record.reference_m)
        .collect();
    assert!(
        references.is_sorted_by(|a, b| a >= b),
        "the reference falls"
    );
    let first_m = references[0];
    assert!((0.99 * END_M..1.01 * END_M).contains(&first_m), "{first_m}");
    let last_m = references[references.len() - 1];
    assert!(last_m.abs() < 0.01 * END_M, "{last_m}");
    let switched_off = &after[settling as usize..];
    assert!(
        switched_off
            .iter()
            .all(|r| r.state == State::Disarmed && r.command_a == 0.0)
    );
    assert!(!bench.amplifier_is_on());
}

#[test]
fn finish_request_fades_an_excitation_without_a_step() {
    let config = stage();
    let excitation = config.chosen_excitation().expect("settings").build();
    let rig = SimulatedRig::new(&config).expect("a valid plant");
    let mut bench = Bench::around(&config, rig).with_ramps(RAMP_TICKS);
    bench.request(Request::Arm);
    bench.request(Request::Start(Box::new(Excite(excitation))));
    bench.run(30_000);
    let before: Vec<TickRecord> = bench.ticks().iter().copied().collect();
    bench.request(Request::Finish);
    bench.run(2 * RAMP_TICKS + 10);
    let all: Vec<TickRecord> = bench.ticks().iter().copied().collect();
    let after = &all[before.len() - 1..];
    assert!(before.iter().any(|record| record.command_a.abs() > 0.01));
    // The amplifier resolves steps of 1 mA here; the faded excitation never changes faster than the excitation itself.
    let (before_a, after_a) = (largest_step_a(&before), largest_step_a(after));
    assert!(after_a <= before_a + 1e-3, "{after_a} after {before_a}");
    assert_eq!(bench.state(), State::Disarmed);
    assert!(!bench.outcome().completed);
}

#[test]
fn program_without_own_settling_is_scaled_by_the_ramp() {
    let mut bench = Bench::running(&stage(), &[], Box::new(CurrentProgram(|_| 2.0, 50)));
    bench = bench.with_ramps(100);
    bench.run(300);
    let after = after_completion(&bench);
    let commands: Vec<f64> = after.iter().map(|record| record.command_a).collect();
    assert!(commands.is_sorted_by(|a, b| a >= b), "the current falls");
    // The cycloid: half of the current after half of the ramp, slope 2 / length there, zero at the end.
    assert!((0.98..1.02).contains(&commands[49]), "{}", commands[49]);
    assert!(commands[0] > 1.999 && commands[0] < 2.0);
    assert!(largest_step_a(&after) < 2.0 * 2.0 / 100.0 * 1.01);
    assert_eq!(commands[100..], [0.0; 150]);
}

#[test]
fn stop_request_cuts_the_current_while_it_settles() {
    let mut bench = Bench::running(&stage(), &[], endless(|_| 2.0)).with_ramps(100);
    bench.run(20);
    bench.request(Request::Finish);
    bench.run(20);
    let settling = bench.tick();
    assert!(settling.state == State::Settling && settling.command_a > 1.0);
    bench.request(Request::Stop);
    let cut = bench.tick();
    assert_eq!((cut.state, cut.command_a), (State::Disarmed, 0.0));
    assert!(!bench.amplifier_is_on());
}

#[test]
fn trip_cuts_the_current_while_it_settles() {
    let faults = [
        (Fault::Validity(Validity::Faulty), "probe_invalid"),
        (Fault::Position(0.00095), "travel"),
        (Fault::AmplifierFault(9), "amplifier"),
        (Fault::RefusedCommand(8), "amplifier"),
    ];
    for (fault, reason) in faults {
        let mut bench = Bench::running(&stage(), &[(60..1000, fault)], endless(|_| 2.0));
        bench = bench.with_ramps(100);
        bench.run(20);
        bench.request(Request::Finish);
        bench.run(100);
        let records: Vec<TickRecord> = bench.ticks().iter().copied().collect();
        assert_eq!(records[59].state, State::Settling, "{reason}");
        assert!(records[59].command_a > 0.5, "{reason}");
        assert!(
            records[60..]
                .iter()
                .all(|r| r.state == State::Tripped && r.command_a == 0.0),
            "{reason}"
        );
        bench.assert_recording_complete(60, reason);
    }
}

#[test]
fn run_without_current_disarms_at_once() {
    let mut bench = Bench::running(&stage(), &[], endless(|_| 0.0)).with_ramps(100);
    bench.run(20);
    bench.request(Request::Finish);
    assert_eq!(bench.tick().state, State::Disarmed);
}

#[test]
fn residual_of_the_ramp_follows_the_closed_form() {
    // An undamped oscillator that rests at 1 while the input is 1. After the ramp it swings with the amplitude
    // |sin(pi f T)| / (pi f T |1 - (f T)^2|). Exact steps of 1/2000 of the ramp; the held input adds terms of that order.
    const TICKS: u64 = 2000;
    for f_t in [0.5, 1.5, 2.5, 2.75, 3.0, 3.4, 4.5] {
        let angle = std::f64::consts::TAU * f_t / TICKS as f64;
        let (sin, cos) = angle.sin_cos();
        let mut settling = Settling::new(TICKS);
        let (mut x, mut v) = (1.0, 0.0);
        while let SettlingStep::Program { scale: input } = settling.next(0.0) {
            (x, v) = (
                input + (x - input) * cos + v * sin,
                -(x - input) * sin + v * cos,
            );
        }
        let swing = f64::hypot(x, v);
        let turns = std::f64::consts::PI * f_t;
        let expected = (turns.sin() / (turns * (1.0 - f_t * f_t))).abs();
        assert!(
            (swing - expected).abs() < 2e-3,
            "f T = {f_t}: {swing}, closed form {expected}"
        );
    }
}

/// In the ramps the tick of the program goes on, up to the last one, and the records do not belong to the experiment any more.
#[test]
fn program_goes_on_in_the_first_ramp() {
    let mut bench =
        Bench::running(&stage(), &[], endless(|tick| 1e-3 * tick as f64)).with_ramps(10);
    bench.run(50);
    let before = *bench.ticks().last().expect("ticks");
    bench.request(Request::Finish);
    for ticks in 1..10u64 {
        let record = bench.tick();
        assert_eq!(record.state, State::Settling);
        let SettlingStep::Program { scale } = step(ticks) else {
            panic!("the first ramp has ten ticks");
        };
        let expected_a = scale * (before.requested_a + 1e-3 * ticks as f64);
        assert!(
            (record.requested_a - expected_a).abs() < 1e-12,
            "{record:?}"
        );
        assert_eq!(record.flags & flag::ACTIVE, 0, "{record:?}");
    }
}

/// The step of a ramp of ten ticks.
fn step(tick: u64) -> SettlingStep {
    let mut settling = Settling::new(10);
    for _ in 1..tick {
        let _ = settling.next(0.0);
    }
    settling.next(0.0)
}
