//! An integrator with delay, measured: L = k exp(-j w d)/(j w). The standard deviation of the smoothed plant is taken as given.

use super::*;
use crate::measured::ResponsePoint;

/// Crossover k in rad/s and delay d in seconds.
const K: f64 = 100.0;
const D: f64 = 4e-3;
/// Ratio of neighbouring frequencies. The cubic between two points errs by 0.002^4/384 of the response.
const RATIO: f64 = 1.002;

fn integrator(w: f64) -> Complex<f64> {
    Complex::from_polar(1.0, -w * D) / Complex::new(0.0, w)
}

fn points(plant: impl Fn(f64) -> Complex<f64>, sigma: f64) -> Vec<ResponsePoint> {
    let omega = (0..3500).map(|k| RATIO.powi(k));
    omega
        .map(|omega_rad_s| ResponsePoint {
            omega_rad_s,
            response: plant(omega_rad_s),
            variance: (sigma * plant(omega_rad_s).norm()).powi(2),
            resolution_rad_s: 0.0,
        })
        .collect()
}

/// What `of` finds of the loop with the constant law `gain`.
fn with_loop<T>(
    plant: impl Fn(f64) -> Complex<f64>,
    gain: f64,
    of: impl Fn(&MeasuredLoop<'_>) -> T,
) -> T {
    let law = |_: f64| Complex::new(gain, 0.0);
    of(&MeasuredLoop::new(&points(plant, 1e-6), &law, &[]).expect("a loop"))
}

fn assert_near(found: f64, expected: f64, relative: f64) {
    let error = (found - expected).abs();
    assert!(error < relative * expected.abs(), "{found} {expected}");
}

fn assert_estimate(found: Option<Estimate>, value: f64, sigma: f64) {
    let found = found.expect("an estimate");
    assert_near(found.value, value, 1e-7);
    // The slope of a parabola over two points to either side errs by (2 x 0.002)^2 of that of 1/w: 1.6e-5.
    assert_near(found.sigma, sigma, 5e-5);
}

#[test]
fn crossing_and_its_delay_have_their_standard_deviations() {
    // d ln L/dw = -1/w - j d. At the crossover k: sigma(w) = k e, sigma(phase) = e sqrt(1 + (k d)^2).
    with_loop(integrator, K, |measured| {
        let found = MeasuredMargins::of(measured);
        let e = measured.relative_sigma(K);
        assert!(e > 0.0);
        let phase_rad = std::f64::consts::FRAC_PI_2 - K * D;
        let phase_sigma = e * libm::hypot(1.0, K * D);
        assert_estimate(found.crossover_rad_s, K, K * e);
        let (margin, sigma) = (phase_rad.to_degrees(), phase_sigma.to_degrees());
        assert_estimate(found.phase_margin_deg, margin, sigma);
        let crossing = found.crossover().expect("a crossing");
        assert_estimate(Some(crossing.phase_margin_deg), margin, sigma);
        assert_eq!(found.crossings.len(), 1);
        // The sum of both parts: sigma(phase)/w + delay sigma(w)/w.
        let delay_s = phase_rad / K;
        assert_estimate(found.delay_margin_s, delay_s, phase_sigma / K + delay_s * e);
        for at in [found.phase_margin_rad_s, found.delay_margin_rad_s] {
            assert_near(at.expect("a frequency"), K, 1e-7);
        }
    });
}

#[test]
fn gain_margin_has_its_standard_deviation() {
    // At arg L = -pi, w = pi/(2 d): |L| = 2 k d/pi, sigma(ln|L|) = e sqrt(1 + (1/(w d))^2).
    with_loop(integrator, K, |measured| {
        let found = MeasuredMargins::of(measured);
        let w = std::f64::consts::FRAC_PI_2 / D;
        let db_per_neper = 20.0 / std::f64::consts::LN_10;
        let margin_db = 20.0 * (w / K).log10();
        let sigma_db = db_per_neper * measured.relative_sigma(w) * libm::hypot(1.0, 1.0 / (w * D));
        assert_estimate(found.gain_margin_db, margin_db, sigma_db);
        assert_near(found.gain_margin_rad_s.expect("a frequency"), w, 1e-7);
        assert_eq!(found.upper_gain_margin_db, found.gain_margin_db);
        assert_eq!(found.upper_gain_margin_rad_s, found.gain_margin_rad_s);
        assert_eq!(found.lower_gain_margin_db, None);
    });
}

#[test]
fn modulus_margin_has_the_standard_deviation_of_the_loop_at_the_peak() {
    // sigma(|1 + L|) = |L| e, and in decibels 20/ln 10 of its ratio to |1 + L|.
    with_loop(integrator, K, |measured| {
        let found = MeasuredMargins::of(measured);
        let w = found.sensitivity_peak_rad_s;
        let least = (integrator(w) * K + 1.0).norm();
        let sigma = K / w * measured.relative_sigma(w);
        assert_estimate(Some(found.modulus_margin), least, sigma);
        let (db, sigma_db) = (-20.0 * least.log10(), 8.685_889_638 * sigma / least);
        assert_estimate(Some(found.sensitivity_peak_db), db, sigma_db);
        // It is a minimum.
        for beside in [0.99 * w, 1.01 * w] {
            assert!((integrator(beside) * K + 1.0).norm() > least);
        }
    });
}

#[test]
fn sensitivity_bandwidth_is_where_its_power_is_a_half() {
    // d ln S = -T d ln L: sigma(w) = e |T|/|Re(T (1/w + j d))|.
    with_loop(integrator, K, |measured| {
        let found = MeasuredMargins::of(measured).sensitivity_bandwidth_rad_s;
        let w = found.expect("a bandwidth").value;
        let loop_gain = integrator(w) * K;
        assert_near((loop_gain + 1.0).norm_sqr(), 2.0, 1e-7);
        let complementary = loop_gain / (loop_gain + 1.0);
        let slope = (complementary * Complex::new(1.0 / w, D)).re.abs();
        let sigma = measured.relative_sigma(w) * complementary.norm() / slope;
        assert_estimate(found, w, sigma);
    });
}

/// The largest |X| in steps of 1e-5 of the frequency, with its frequency.
fn largest(of: impl Fn(f64) -> f64) -> (f64, f64) {
    let omega = (0..400_000).map(|k| 10.0 * 1.000_01_f64.powi(k));
    omega.fold((0.0, 0.0), |best, w| {
        let value = of(w);
        if value > best.1 { (w, value) } else { best }
    })
}

#[test]
fn peaks_of_the_closed_loop_have_the_standard_deviation_of_the_other_factor() {
    // k d = 1.2: all peaks lie within the band. d ln T = S e, d ln(C S) = -T e, d ln(P S) = S e.
    let gain = 300.0;
    let s = |w: f64| (integrator(w) * gain + 1.0).inv().norm();
    let t = |w: f64| integrator(w).norm() * gain * s(w);
    with_loop(integrator, gain, |measured| {
        let found = LoopPeaks::of(measured);
        let (at_t, peak_t) = largest(t);
        let (at_s, peak_s) = largest(s);
        let e = |w: f64| measured.relative_sigma(w);
        let near = |found: Estimate, value: f64, sigma: f64| {
            assert_near(found.value, value, 1e-7);
            // The frequency of a peak of height 10 is searched to 1e-5.
            assert_near(found.sigma, sigma, 1e-3);
        };
        near(found.complementary_peak, peak_t, peak_t * s(at_t) * e(at_t));
        let control = gain * peak_s;
        near(
            found.control_peak_a_per_m,
            control,
            control * t(at_s) * e(at_s),
        );
        let disturbance = peak_t / gain;
        near(
            found.disturbance_peak_m_per_a,
            disturbance,
            disturbance * s(at_t) * e(at_t),
        );
    });
}

#[test]
fn upper_and_lower_gain_margin_are_those_of_a_conditionally_stable_loop() {
    // L = k (s + 1)^2/(s^3 (s/6 + 1)^2) is on the negative axis at w = 2 and w = 3, with |L| = 9/16 k and 8/27 k.
    let plant = |w: f64| {
        let s = Complex::new(0.0, w);
        let pole = s / 6.0 + 1.0;
        (s + 1.0) * (s + 1.0) / (s * s * s * pole * pole)
    };
    for (k, nearest_rad_s) in [(3.0, 3.0), (2.0, 2.0)] {
        let found = with_loop(plant, k, MeasuredMargins::of);
        let db = |gain: f64| -20.0 * gain.log10();
        let (upper, lower) = (db(8.0 / 27.0 * k), db(9.0 / 16.0 * k));
        assert!(lower < 0.0 && upper > 0.0);
        let value = |margin: Option<Estimate>| margin.expect("a gain margin").value;
        assert_near(value(found.upper_gain_margin_db), upper, 1e-6);
        assert_near(value(found.lower_gain_margin_db), lower, 1e-6);
        for (at, expected) in [
            (found.upper_gain_margin_rad_s, 3.0),
            (found.lower_gain_margin_rad_s, 2.0),
            (found.gain_margin_rad_s, nearest_rad_s),
        ] {
            assert_near(at.expect("a frequency"), expected, 1e-6);
        }
    }
}

#[test]
fn delay_margin_counts_the_phase_from_0_to_360_degrees() {
    // -90 deg at 100 rad/s is reached after 270 deg: 47.1 ms; 1 deg and 2 rad/s of standard deviation add 0.175 and 0.942 ms.
    let crossing = MeasuredCrossing {
        rad_s: Estimate {
            value: 100.0,
            sigma: 2.0,
        },
        phase_margin_deg: Estimate {
            value: -90.0,
            sigma: 1.0,
        },
    };
    let (at, delay) = delay_margin_s(&crossing);
    assert_eq!(at, 100.0);
    let delay_s = 0.015 * std::f64::consts::PI;
    assert_near(delay.value, delay_s, 1e-14);
    let sigma_s = std::f64::consts::PI / 180.0 / 100.0 + 0.02 * delay_s;
    assert_near(delay.sigma, sigma_s, 1e-14);
}
