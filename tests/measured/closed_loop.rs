//! The margins of a closed-loop record use the same interpolation and intervals.

use bench_base::units::rad_s;
use bench_control::measured::{MeasuredLoop, MeasuredMargins};
use bench_identify::EstimatorSettings;
use bench_identify::joint;
use bench_test_support::feedback_loop;
use nalgebra::Complex;

use bench_control::measured::ResponsePoint;

/// A simulated loop of a resonance and a PI controller with known L.
#[test]
fn margins_of_a_measured_loop_gain_are_within_4_sigma_of_the_truth() {
    let record = feedback_loop::run(1e-3, 3);
    let settings = EstimatorSettings::default();
    let estimate = joint::estimate(&record, feedback_loop::BAND_HZ, &settings).expect("one");
    let frf = &estimate.loop_gain;
    let point = |k: usize| ResponsePoint {
        omega_rad_s: rad_s(frf.frequency_hz[k]),
        response: frf.response[k],
        variance: 2.0 * frf.magnitude_sigma[k].powi(2),
        resolution_rad_s: rad_s(frf.resolution_hz[k]),
    };
    let points: Vec<ResponsePoint> = (0..frf.len()).map(point).collect();
    let law = |_: f64| Complex::new(1.0, 0.0);
    let found = MeasuredMargins::of(&MeasuredLoop::new(&points, &law, &[]).expect("a loop"));
    // The truth by a search in steps of 1e-4 Hz.
    let (low_hz, high_hz) = feedback_loop::BAND_HZ;
    let steps = ((high_hz - low_hz) / 1e-3) as usize;
    let frequencies = (0..steps).map(|k| low_hz + 1e-3 * k as f64);
    let closest = frequencies
        .map(|f| (feedback_loop::loop_gain(f) + 1.0).norm())
        .fold(f64::INFINITY, f64::min);
    let margin = found.modulus_margin;
    assert!(
        (margin.value - closest).abs() < 4.0 * margin.sigma && margin.sigma < 0.05 * closest,
        "{margin:?} for {closest}"
    );
    let crossing = found.crossover().expect("a crossover");
    let size = feedback_loop::loop_gain(crossing.rad_s.value / std::f64::consts::TAU).norm();
    // |L| changes by g dw: 4 sigma of the frequency.
    let slope = |w: f64| {
        feedback_loop::loop_gain(w / std::f64::consts::TAU)
            .norm()
            .ln()
    };
    let w = crossing.rad_s.value;
    let g = (slope(1.001 * w) - slope(0.999 * w)) / (0.002 * w);
    assert!(
        size.ln().abs() < 4.0 * crossing.rad_s.sigma * g.abs(),
        "{crossing:?}: |L| = {size}"
    );
}
