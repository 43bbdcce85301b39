//! An integrator with delay, sampled as an FRF: L = k exp(-j w d)/(j w).

use bench_base::estimate::Estimate;
use bench_control::measured::{LoopPeaks, MeasuredLoop, MeasuredMargins};
use nalgebra::Complex;

use crate::measured::sampled::points;

/// Crossover k in rad/s and delay d in seconds.
const K: f64 = 100.0;
const D: f64 = 4e-3;
/// Spacing of the points in rad/s.
const SPACING: f64 = 0.05;

/// P = exp(-j w d)/(j w), in metres per ampere.
fn plant(w: f64) -> Complex<f64> {
    Complex::from_polar(1.0, -w * D) / Complex::new(0.0, w)
}

fn with_loop<T>(sigma: f64, of: impl Fn(&MeasuredLoop<'_>) -> T) -> T {
    let omega_rad_s: Vec<f64> = (20..=14_000).map(|k| SPACING * f64::from(k)).collect();
    let points = points(&omega_rad_s, sigma, plant);
    let law = |_: f64| Complex::new(K, 0.0);
    of(&MeasuredLoop::new(&points, &law, &[]).expect("a loop"))
}

#[track_caller]
fn near(found: Option<Estimate>, expected: f64, relative: f64) {
    let found = found.expect("a value").value;
    assert!(
        (found - expected).abs() < relative * expected.abs(),
        "{found} for {expected}"
    );
}

#[test]
fn margins_are_those_of_the_closed_form() {
    // Crossover k, phase margin 90 deg - k d, phase crossing at pi/(2 d), gain margin pi/(2 k d). The cubic between two points errs
    // by (spacing/w)^4/384.
    let found = with_loop(1e-9, MeasuredMargins::of);
    near(found.crossover_rad_s, K, 1e-8);
    near(found.phase_margin_deg, 90.0 - (K * D).to_degrees(), 1e-8);
    let gain_margin = std::f64::consts::PI / (2.0 * K * D);
    near(found.gain_margin_db, 20.0 * gain_margin.log10(), 1e-8);
    assert_eq!(found.crossings.len(), 1);
}

#[test]
fn peaks_are_those_of_a_brute_force_search() {
    // Steps of 7 mrad/s: the curvature of |S| at its peak is below 1/(100 rad/s)^2, so the search errs by 1e-9.
    let search = |of: &dyn Fn(f64) -> Complex<f64>| {
        let sizes = (200..90_000).map(|i| of(f64::from(i) * 7e-3).norm());
        sizes.fold(0.0, f64::max)
    };
    let s = |w: f64| (plant(w) * K + 1.0).inv();
    let (margins, peaks) = with_loop(1e-9, |l| (MeasuredMargins::of(l), LoopPeaks::of(l)));
    near(Some(margins.modulus_margin), 1.0 / search(&s), 1e-7);
    near(
        Some(peaks.complementary_peak),
        search(&|w| plant(w) * K * s(w)).max(1.0),
        1e-4,
    );
    near(Some(peaks.control_peak_a_per_m), K * search(&s), 1e-7);
}

#[test]
fn sigma_is_that_of_a_parabola_over_the_neighbours_and_of_the_delta_method() {
    // Local regression with a parabola over 2 m + 1 points of equal weight has the variance of the Savitzky-Golay filter:
    // 3 (3 m^2 + 3 m - 1)/((2 m - 1)(2 m + 1)(2 m + 3)) of that of a point. Here m = 48: half of the largest half-width. Over 97
    // points, +-2.4 rad/s, the weights change by +-5 % and the result by less than their square.
    let m = 48.0;
    let gain =
        3.0 * (3.0 * m * m + 3.0 * m - 1.0) / ((2.0 * m - 1.0) * (2.0 * m + 1.0) * (2.0 * m + 3.0));
    let sigma = 1e-2;
    // Of the relative error dP/P, either part has half of the power.
    let part = sigma * f64::sqrt(0.5 * gain);
    let found = with_loop(sigma, MeasuredMargins::of);
    let crossing = found.crossover().expect("a crossover");
    // |L| = k/w: d ln|L|/dw = -1/k at the crossover, d(arg L)/dw = -d. So sigma(w) = k part, sigma(phase) = part sqrt(1 + (k d)^2).
    let (rad_s, phase) = (crossing.rad_s.sigma, crossing.phase_margin_deg.sigma);
    assert!((rad_s / (K * part) - 1.0).abs() < 0.01, "{rad_s}");
    let expected = (part * libm::hypot(1.0, K * D)).to_degrees();
    assert!(
        (phase / expected - 1.0).abs() < 0.01,
        "{phase} for {expected}"
    );
    // At arg L = -pi: d ln|L|/dw = -1/w with w = pi/(2 d), so d(ln|L|) = Re(e) - Im(e)/(w d).
    let ratio = 1.0 / (D * std::f64::consts::PI / (2.0 * D));
    let expected = part * libm::hypot(1.0, ratio) * 20.0 / std::f64::consts::LN_10;
    let gain_margin = found.gain_margin_db.expect("a gain margin").sigma;
    assert!(
        (gain_margin / expected - 1.0).abs() < 0.01,
        "{gain_margin} for {expected}"
    );
    // |1 + L|: |L| part, with |L| = k/w at the peak of |S|.
    let expected = K / found.sensitivity_peak_rad_s * part;
    let modulus = found.modulus_margin.sigma;
    assert!(
        (modulus / expected - 1.0).abs() < 0.01,
        "{modulus} for {expected}"
    );
}
