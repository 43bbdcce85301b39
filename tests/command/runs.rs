//! Runs of the simulated stage with shaping and feedforward, and their replay.

use std::f64::consts::TAU;
use std::path::Path;

use bench_experiment::replay;
use bench_recording::Recording;
use bench_rt::record::flag;
use nalgebra::Complex;
use serde_json::Value;

use crate::command::program::{Bench, number};

fn run(bench: &Bench, arguments: &str) -> (Value, Recording) {
    let answer = bench.json(&format!("control {arguments} --out runs"));
    assert_eq!(answer["outcome"], "completed", "{arguments}");
    let path = answer["recording"].as_str().expect("a path");
    let recording = Recording::open(&bench.path(Path::new(path))).expect("a recording");
    (answer, recording)
}

/// Reference and position from the rest position while the loop is closed, in metres.
fn closed(recording: &Recording) -> Vec<(f64, f64)> {
    let (mut rest_m, mut signals) = (0.0, Vec::new());
    for record in recording.ticks().expect("readable") {
        let record = record.expect("readable");
        match record.flags & flag::ACTIVE {
            0 if signals.is_empty() => rest_m = record.reference_m,
            0 => {}
            _ => signals.push((record.reference_m - rest_m, record.position_m - rest_m)),
        }
    }
    signals
}

/// Amplitude at a frequency over whole periods at the end of a run, of the error from the planned sine.
fn sine_error_m(signals: &[(f64, f64)], amplitude_m: f64, hertz: f64) -> f64 {
    let period = (5000.0 / hertz).round() as usize;
    let used = signals.len() / 2 / period * period;
    let first = signals.len() - used;
    let terms = signals[first..].iter().zip(first..).map(|((_, y), k)| {
        let angle = TAU * hertz * k as f64 / 5000.0;
        Complex::from_polar(amplitude_m * angle.sin() - y, -angle)
    });
    2.0 * terms.sum::<Complex<f64>>().norm() / used as f64
}

#[test]
fn tracking_error_of_sines_is_a_tenth_with_feedforward() {
    let frequencies = [1, 5, 10, 20].into_iter();
    for (hertz, point) in frequencies.flat_map(|hertz| [(hertz, "0%"), (hertz, "8%")]) {
        let error_m = |options: &str| {
            let bench = Bench::new();
            let arguments = format!(
                "--fast --operating-point {point} --reference sine --amplitude 100um --frequency {hertz}Hz --duration 6 {options}"
            );
            let (_, recording) = run(&bench, &arguments);
            sine_error_m(&closed(&recording), 100e-6, f64::from(hertz))
        };
        let (without_m, with_m) = (error_m(""), error_m("--feedforward"));
        assert!(
            with_m < 0.1 * without_m,
            "{hertz} Hz at {point}: {with_m} of {without_m}"
        );
        // The loop without feedforward lags: its error is not the noise of some 1e-9 m.
        assert!(
            (5e-6..200e-6).contains(&without_m),
            "{hertz} Hz: {without_m}"
        );
    }
}

#[test]
fn tracking_error_of_a_ramp_is_a_tenth_with_feedforward() {
    for point in ["0%", "8%"] {
        let (without_m, with_m) = (
            ramp_error_m(point, "").abs(),
            ramp_error_m(point, "--feedforward").abs(),
        );
        // 1 mm/s over the velocity constant of the fast loop: some 10 um.
        assert!((2e-6..50e-6).contains(&without_m), "{point}: {without_m}");
        assert!(with_m < 0.1 * without_m, "{point}: {with_m} of {without_m}");
    }
}

/// Mean error along a ramp.
fn ramp_error_m(point: &str, options: &str) -> f64 {
    let bench = Bench::new();
    let arguments = format!(
        "--fast --operating-point {point} --reference ramp --amplitude 400um --speed 1mm/s --duration 1 {options}"
    );
    let (_, recording) = run(&bench, &arguments);
    // The ramp begins at 0.2 s: from 0.35 s on the transients are over.
    let steady = &closed(&recording)[1750..2750];
    let errors = steady
        .iter()
        .zip(1750..)
        .map(|((_, y), k)| 1e-3 * (f64::from(k) / 5000.0 - 0.2) - y);
    errors.sum::<f64>() / steady.len() as f64
}

#[test]
fn commands_of_every_kind_replay_bit_for_bit() {
    let bench = Bench::new();
    for options in [
        "--fast --shaper zv --set control.shaper.modes=[{frequency_hz=29.0,damping_ratio=0.01}]",
        "--slow --shaper ei",
        "--fast --shaper minimum-time",
        "--fast --feedforward --reference sine --frequency 10Hz",
        "--fast --prefilter 30Hz --feedforward",
    ] {
        let (_, recording) = run(&bench, &format!("{options} --duration 0.8"));
        let command = recording.attachment("command.toml");
        assert!(
            command.is_some_and(|command| !command.data.is_empty()),
            "{options}"
        );
        let replayed = replay(&recording).expect("it can be replayed");
        assert_eq!((replayed.different, replayed.first), (0, None), "{options}");
        assert_eq!(replayed.ticks, recording.tick_count(), "{options}");
    }
}

#[test]
fn prefilter_removes_the_overshoot_of_the_step() {
    let overshoot = |options: &str| {
        let answer = Bench::new().json(&format!("control --fast --duration 1.5 {options}"));
        number(&answer["predicted"]["overshoot_percent"])
    };
    let (without, with) = (overshoot(""), overshoot("--prefilter 10Hz"));
    assert!(without > 1.0 && with < 0.5 * without, "{with} of {without}");
}

#[test]
fn profile_stage_tracking_follows_a_sine_without_lag() {
    let bench = Bench::new();
    let (answer, _) = run(&bench, "--config stage-tracking --no-report");
    let sine = &answer["measured"]["sine"];
    let (gain, phase_deg) = (number(&sine["gain"]), number(&sine["phase_deg"]));
    // Three times the uncertainty that the run prints: 0.0003 and 0.02 deg. The fast loop alone has 0.66 and -23 deg.
    assert!((gain - 1.0).abs() < 1e-3, "{gain}");
    assert!(phase_deg.abs() < 0.06, "{phase_deg}");
    assert!(answer["predicted"]["sine"].is_null(), "{answer}");
}
