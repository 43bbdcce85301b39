//! The feedforward current: the interlocks judge the sum, the factor of the reference and the ramp at the end apply to it.
use bench_control::{ControlLaw, LawInput};
use bench_excitation::command::{CommandSource, LoopCommand};
use bench_rt::arming::{State, Trip};
use bench_rt::program::{Control, Program, ProgramInput};
use bench_rt::record::EventKind;
use bench_rt::servo::Request;
use bench_rt::tuning::{Factors, Tune};

use crate::safety::rig::{Bench, stage};

/// A law with a constant current in amperes.
struct ConstantLaw(f64);

impl ControlLaw for ConstantLaw {
    fn reset(&mut self, _rest_m: f64) {}
    fn update(&mut self, _input: &LawInput) -> f64 {
        self.0
    }
}

/// A command with a constant feedforward current in amperes.
struct ConstantCommand(f64);

impl CommandSource for ConstantCommand {
    fn at(&mut self, _tick: u64) -> LoopCommand {
        LoopCommand {
            reference_m: 0.0,
            feedforward_a: self.0,
        }
    }
}

fn control(law_a: f64, feedforward_a: f64) -> Box<dyn Program> {
    Box::new(Control::with_command(
        Box::new(ConstantLaw(law_a)),
        Box::new(ConstantCommand(feedforward_a)),
        2,
        10_000,
    ))
}

#[test]
fn interlocks_judge_the_sum_of_law_and_feedforward() {
    // The peak current of the motor is 111 N/(11.12 N/A) = 9.98 A: each part is below it, the sum of the first case is not.
    for (law_a, feedforward_a, trips) in [(5.0, 6.0, true), (-5.0, 6.0, false)] {
        let mut bench = Bench::running(&stage(), &[], control(law_a, feedforward_a));
        let records: Vec<_> = (0..20).map(|_| bench.tick()).collect();
        let last = records.last().expect("ticks");
        assert_eq!(
            last.state == State::Tripped,
            trips,
            "{law_a} {feedforward_a}"
        );
        let has_tripped = bench
            .trips()
            .iter()
            .any(|trip| matches!(trip.kind, EventKind::Trip(Trip::PeakCurrent { .. })));
        assert_eq!(has_tripped, trips);
        assert!(records.iter().all(|record| record.command_a.abs() < 9.99));
    }
}

#[test]
fn feedforward_that_is_not_finite_trips_and_gives_no_current() {
    for feedforward_a in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut bench = Bench::running(&stage(), &[], control(0.0, feedforward_a));
        let records: Vec<_> = (0..20).map(|_| bench.tick()).collect();
        assert_eq!(records.last().map(|r| r.state), Some(State::Tripped));
        assert!(records.iter().all(|record| record.command_a == 0.0));
    }
}

#[test]
fn factor_of_the_reference_scales_the_feedforward() {
    let mut bench = Bench::running(&stage(), &[], control(0.25, 0.5));
    let before = (0..50).map(|_| bench.tick()).last().expect("ticks");
    assert_eq!(before.requested_a, 0.75);
    let factors = Factors {
        reference: -0.5,
        gain: 1.0,
    };
    bench.request(Request::Tune(Tune::new(factors, 100).expect("valid")));
    let after: Vec<_> = (0..150).map(|_| bench.tick()).collect();
    assert_eq!(after.last().map(|record| record.requested_a), Some(0.0));
    // 1.5 times 0.5 A over a cycloid of 100 ticks, whose steepest slope is 2/100 per tick.
    let steps = after
        .windows(2)
        .map(|pair| (pair[1].requested_a - pair[0].requested_a).abs());
    assert!(steps.fold(0.0, f64::max) < 0.0151);
}

/// Only the program is under test: `settle` with a factor that falls from 1 to 0.
#[test]
fn end_of_the_run_scales_the_feedforward_to_zero() {
    let mut program = control(0.0, 0.5);
    let input = |tick| ProgramInput {
        tick,
        ..ProgramInput::default()
    };
    for tick in 0..10 {
        program.decide(&input(tick));
    }
    for scale in [1.0, 0.75, 0.5, 0.25, 0.0] {
        let decision = program.settle(&input(10), scale);
        assert_eq!(decision.requested_a, 0.5 * scale);
        assert_eq!(decision.feedforward_a, 0.5 * scale);
    }
}
