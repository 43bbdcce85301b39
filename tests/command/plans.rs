//! Planned filters against an independent simulation.

use bench_control::ClosedLoop;
use bench_experiment::closed_loop;
use nalgebra::Complex;

use crate::command::{config, plan};

/// Largest distance from the final value after a tick, over the height of the step.
fn rest_after(positions: &[f64], tick: usize) -> f64 {
    let rest = positions[tick..].iter().map(|y| (y - 1.0).abs());
    rest.fold(0.0, f64::max)
}

fn step_of(closed_loop: &ClosedLoop, ticks: usize) -> Vec<f64> {
    closed_loop.simulate(ticks, |_| 1.0)
}

/// The sum of the modes with the poles of the loop is its step response: their amplitudes are those that a least-squares fit of the
/// decaying oscillations to the simulated response finds.
#[test]
fn step_modes_have_the_amplitudes_of_the_simulated_response() {
    let config = config(&["control.controller=slow"]);
    let closed_loop = closed_loop(&config).expect("a loop");
    let modes = closed_loop.step_modes(0.0);
    let period_s = config.servo.period_s();
    let poles = closed_loop.poles();
    let (first, ticks) = (50, 4000);
    let response = step_of(&closed_loop, first + ticks);
    // Columns: real and imaginary part of exp(p t) of each pole with a time constant of more than a tick, and the final value.
    let slow: Vec<Complex<f64>> = poles
        .into_iter()
        .filter(|p| p.im >= 0.0 && p.re > -0.2 / period_s)
        .collect();
    let column = |tick: usize| -> Vec<f64> {
        let parts = slow.iter().flat_map(|p| {
            let z = (*p * (tick as f64 * period_s)).exp();
            [z.re, z.im]
        });
        parts.chain([1.0]).collect()
    };
    let rows: Vec<f64> = (first..first + ticks).flat_map(column).collect();
    let matrix = nalgebra::DMatrix::from_row_slice(ticks, 2 * slow.len() + 1, &rows);
    let values = nalgebra::DVector::from_column_slice(&response[first..]);
    let fit = matrix.svd(true, true).solve(&values, 1e-12).expect("a fit");
    let mut compared = 0;
    for mode in modes.iter().filter(|mode| mode.step_ratio > 1e-3) {
        let index = slow
            .iter()
            .position(|p| (p.norm() / mode.omega_rad_s - 1.0).abs() < 1e-6 && p.im > 0.0);
        let index = index.expect("a pole");
        let amplitude = fit[2 * index].hypot(fit[2 * index + 1]);
        // The poles left out have decayed to exp(-0.2 50) = 5e-5 of at most some unity.
        assert!(
            (amplitude - mode.step_ratio).abs() < 1e-3 * mode.step_ratio + 1e-4,
            "{mode:?}: {amplitude}"
        );
        compared += 1;
    }
    assert!(compared >= 1, "{modes:?}");
}

/// With the slow controller the first mode rings: a shaper for its mode leaves little of it.
#[test]
fn impulse_shapers_remove_the_vibration_of_the_closed_loop() {
    let slow = "control.controller=slow";
    let settings = config(&[slow]);
    let closed_loop = closed_loop(&settings).expect("a loop");
    let mode = closed_loop.step_modes(0.01)[0];
    let plain = step_of(&closed_loop, 6000);
    for (kind, most) in [("zv", 0.05), ("zvd", 0.05), ("ei", 0.15)] {
        let plan = plan(&[slow, &format!("control.shaper.kind={kind}")]);
        let filter = plan.command_filter().expect("a command").reference();
        let sum = filter.sum();
        assert!((sum - 1.0).abs() < 1e-12, "{kind}: {sum}");
        let shaped = closed_loop.simulate(6000, |tick| {
            let taps = filter.as_slice().iter();
            let begun = taps.take_while(|tap| tap.delay_ticks <= tick as i64);
            begun.map(|tap| tap.weight).sum()
        });
        let vibration = |positions: &[f64]| oscillation(positions, mode.omega_rad_s, 2e-4);
        let ratio = vibration(&shaped[1500..4000]) / vibration(&plain[1500..4000]);
        assert!(ratio < most, "{kind}: {ratio}");
        assert!(rest_after(&shaped, 5500) < rest_after(&plain, 0));
    }
}

/// Amplitude of the part of a signal at a frequency, by correlation with a Hann window.
fn oscillation(positions: &[f64], omega_rad_s: f64, period_s: f64) -> f64 {
    let count = positions.len();
    let mean = positions.iter().sum::<f64>() / count as f64;
    let terms = positions.iter().enumerate().map(|(k, y)| {
        let window = 1.0 - (std::f64::consts::TAU * k as f64 / count as f64).cos();
        Complex::from_polar(window * (y - mean), -omega_rad_s * k as f64 * period_s)
    });
    terms.sum::<Complex<f64>>().norm()
}
