//! Digital low-pass filters of second order between the stage and the record: they turn the residues and have poles, but no zero in the band.

use std::f64::consts::{PI, SQRT_2, TAU};

use nalgebra::Complex;

use super::stage::{CMP, CNMP, Stage};
use super::{RATE_HZ, assert_near, output, sweep};
use crate::verdict::Cnmp;
use crate::{ExternalAnalysis, Identification};

/// A Butterworth filter of second order by the bilinear transform, warped to its corner: with K = tan(pi fc/rate)
///
/// ```text
/// K^2 (1 + z^-1)^2 / ((1 + sqrt(2) K + K^2) + 2 (K^2 - 1) z^-1 + (1 - sqrt(2) K + K^2) z^-2)
/// ```
fn low_pass(signal: &[f64], corner_hz: f64, rate_hz: f64) -> Vec<f64> {
    let k = (PI * corner_hz / rate_hz).tan();
    let scale = 1.0 / (1.0 + SQRT_2 * k + k * k);
    let [a1, a2] = [2.0 * (k * k - 1.0), 1.0 - SQRT_2 * k + k * k].map(|a| a * scale);
    let gain = k * k * scale;
    let ([mut x1, mut x2], [mut y1, mut y2]) = ([0.0; 2], [0.0; 2]);
    let filtered = signal.iter().map(|x| {
        let y = gain * (x + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
        (x2, x1, y2, y1) = (x1, *x, y1, y);
        y
    });
    filtered.collect()
}

fn with_noise(mut signal: Vec<f64>, sigma: f64, seed: u64) -> Vec<f64> {
    let noise = Stage::white_noise(signal.len(), sigma, seed);
    for (value, noise) in signal.iter_mut().zip(noise) {
        *value += noise;
    }
    signal
}

fn identified(rate_hz: f64, input: &[f64], output: &[f64]) -> ExternalAnalysis {
    let identification = Identification::new(rate_hz).held_s(1.0 / rate_hz);
    identification.run(input, output).expect("a response")
}

/// Corners from just above the band, which ends at 130 Hz, to near half of the rate. The delay of the filter, which is not known, may leave
/// the side of a zero open, but never turns it.
#[test]
fn a_filter_in_the_channel_leaves_poles_and_verdict_as_they_are() {
    let input = sweep();
    let mut decided = 0;
    for (stage, cnmp) in [(CNMP, Cnmp::Detected), (CMP, Cnmp::Excluded)] {
        let stage = stage.without_damper();
        for (corner_hz, seed) in [(140.0, 41), (180.0, 42), (220.0, 43)] {
            let motion = output(&stage, &input, 0.0, 0);
            let filtered = with_noise(low_pass(&motion, corner_hz, RATE_HZ), 1e-8, seed);
            let found = identified(RATE_HZ, &input, &filtered);
            let why = &found.verdict.why;
            let is_open = found.verdict.cnmp == Cnmp::Undecided;
            assert!(is_open || found.verdict.cnmp == cnmp, "{corner_hz}: {why}");
            decided += usize::from(!is_open);
            assert_eq!(found.clock_skew, None);
            let fit = found.fit.expect("modes");
            assert!(!fit.parameters.has_real_residues(), "{corner_hz} Hz: {why}");
            // The poles of the nearest filter, of damping ratio 0.71, are in reach of the band.
            let filter = fit.filter_modes();
            let is_near = corner_hz < 150.0;
            assert_eq!(filter.len(), usize::from(is_near), "{corner_hz} Hz: {why}");
            assert_eq!(why.contains("a pole of a filter"), is_near, "{why}");
            for pole in filter {
                let ratio = pole.frequency_hz().value / corner_hz;
                assert!((0.75..1.25).contains(&ratio), "{corner_hz} Hz: {pole:?}");
            }
            let mut light = fit.modes();
            light.retain(|mode| mode.damping_ratio.value < 0.1);
            let truth = stage.partial_fractions();
            assert_eq!(light.len(), truth.len(), "{corner_hz} Hz: {light:?}");
            for zero in stage.zeros() {
                let zeros = found.verdict.zeros.iter();
                let distance = zeros.map(|found| (found.s - zero).norm());
                let distance = distance.reduce(f64::min).expect("zeros");
                // The samples show the zeros; those of the modes and R alone are some rad/s away.
                assert!(distance < 0.5, "{corner_hz} Hz: {zero}, {distance}");
            }
            for (mode, (pole, _)) in light.iter().zip(truth) {
                assert_near(mode.omega_rad_s, pole.norm());
                assert_near(mode.damping_ratio, -pole.re / pole.norm());
            }
        }
    }
    assert!(decided >= 4, "{decided} of 6");
}

/// A stage whose zeros all lie left of the axis, and a filter above the band. The fit describes the samples, with a pair of zeros right of
/// the axis at 240 Hz that has no effect in them.
#[test]
fn zeros_that_the_samples_do_not_show_are_none_of_the_stage() {
    let (rate_hz, seconds) = (1000.0, 30.0);
    let (low_hz, high_hz) = (4.48, 283.0);
    let modes = [
        (162.0, 0.0074, -3.23),
        (321.7, 0.0098, -2.59),
        (632.9, 0.015, 3.77),
        (945.5, 0.0038, 1.39),
    ];
    let force = |k: usize| {
        let time_s = k as f64 / rate_hz - 1.0;
        let inside = (0.0..seconds).contains(&time_s);
        let fade = time_s.min(seconds - time_s).clamp(0.0, 1.0);
        let window = 0.5 - 0.5 * (PI * fade).cos();
        let slope = (high_hz - low_hz) / (2.0 * seconds);
        let phase = TAU * (low_hz * time_s + slope * time_s * time_s);
        if inside {
            0.09 * window * phase.sin()
        } else {
            0.0
        }
    };
    let input: Vec<f64> = (0..42_500).map(force).collect();
    let mut motion = vec![0.0; input.len()];
    for (omega, zeta, residue) in modes {
        let pole = Complex::new(-zeta, f64::sqrt(1.0 - zeta * zeta)) * omega;
        let rho = Complex::new(0.0, -residue / (2.0 * pole.im));
        let e = (pole / rate_hz).exp();
        let mut x = Complex::new(0.0, 0.0);
        for (output, force) in motion.iter_mut().zip(&input) {
            *output += 2.0 * (rho * x).re;
            x = e * x + (e - 1.0) / pole * *force;
        }
    }
    let filtered = low_pass(&motion, 350.0, rate_hz);
    for seed in 0..4 {
        let found = identified(rate_hz, &input, &with_noise(filtered.clone(), 4e-8, seed));
        let (verdict, fit) = (found.verdict, found.fit.expect("modes"));
        assert!(!fit.parameters.has_real_residues(), "{seed}");
        assert_ne!(verdict.cnmp, Cnmp::Detected, "{seed}: {}", verdict.why);
    }
}
