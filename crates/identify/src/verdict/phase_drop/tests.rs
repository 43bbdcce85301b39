//! Bode's relation, turns of roots, and phase drops in closed form.

use super::*;

const POLES: [(f64, f64); 3] = [(180.0, 0.009), (516.0, 0.004), (540.0, 0.004)];

fn poles() -> Vec<Complex<f64>> {
    let pole = |(w, z): (f64, f64)| Complex::new(-z * w, w * (1.0 - z * z).sqrt());
    POLES.map(pole).to_vec()
}

/// The response of the poles above and some zeros, real ones with im = 0, at each frequency.
fn response(omega: &[f64], zeros: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let at = |w: &f64| {
        let s = Complex::new(0.0, *w);
        let mode = |(w, z): (f64, f64)| (s * s / (w * w) + s * (2.0 * z / w) + 1.0).inv();
        let poles: Complex<f64> = POLES.map(mode).iter().product();
        let zero = |z: &Complex<f64>| {
            if z.im == 0.0 {
                (s - z) / z.norm()
            } else {
                (s - z) * (s - z.conj()) / z.norm_sqr()
            }
        };
        poles * zeros.iter().map(zero).product::<Complex<f64>>()
    };
    omega.iter().map(at).collect()
}

/// The phase drop from 300 to 900 rad/s of a stage with some zeros, beside a fit with others.
fn drop_over(zeros: &[Complex<f64>], fitted: &[Complex<f64>]) -> PhaseDrop {
    let omega: Vec<f64> = (0..12_000)
        .map(|k| 1.0 * (0.0007 * f64::from(k)).exp())
        .collect();
    let at = |w: f64| omega.iter().position(|x| *x >= w).unwrap();
    let (from, to) = (at(300.0), at(900.0));
    let curve = PhaseCurve {
        measured: response(&omega, zeros),
        fitted: response(&omega, fitted),
        omega_rad_s: omega,
        below: Vec::new(),
        above: Vec::new(),
    };
    let roots = Roots {
        poles: poles(),
        zeros: fitted.to_vec(),
    };
    phase_drop(&curve, &roots, from, to)
}

#[test]
fn each_right_half_plane_pair_adds_one_turn_of_lag_and_a_left_one_none() {
    let zero = Complex::new;
    for (zeros, turns) in [
        (vec![zero(-2.0, 528.0)], 0.0),
        (vec![zero(-2.0, 525.0), zero(-2.0, 530.0)], 0.0),
        (vec![zero(-14.9, 530.2), zero(10.7, 530.3)], 1.0),
        (vec![zero(-4.0, 530.0), zero(1.0, 530.0)], 1.0),
        (vec![zero(5.0, 524.0), zero(5.0, 534.0)], 2.0),
    ] {
        let drop = drop_over(&zeros, &zeros);
        // Outside the band the magnitude is extrapolated by its slope at the band limits; this causes an error of
        // some degrees. A zero of 10.7 rad/s turns by all but 2 x 0.7 x 10.7/230 of 360 degrees: 6 %.
        assert!(
            drop.deviation_deg() < 20.0 && (drop.drop_deg - 360.0 * turns).abs() < 30.0,
            "{zeros:?}: {drop:?}"
        );
    }
}

#[test]
fn fit_without_zeros_in_the_right_half_plane_predicts_a_positive_zero() {
    let roots = Roots {
        poles: poles(),
        zeros: vec![Complex::new(-2.0, 528.0)],
    };
    let lag = roots.all_pass_lag(300.0, 900.0);
    assert!(lag == 0.0 && lag.is_sign_positive(), "{lag}");
}

#[test]
fn real_zero_adds_the_lag_of_its_all_pass_filter_over_the_band() {
    for x in [250.0, 520.0, 1500.0] {
        let zeros = [Complex::new(x, 0.0), Complex::new(-x, 0.0)];
        let drop = drop_over(&zeros, &zeros);
        let closed_form = 2.0 * ((900.0 / x).atan() - (300.0 / x).atan()).to_degrees();
        assert!(
            (drop.predicted_deg - closed_form).abs() < 0.2 && drop.deviation_deg() < 20.0,
            "{x}: {drop:?}, expected {closed_form}"
        );
    }
}

#[test]
fn zero_pair_on_the_wrong_side_of_the_fit_deviates_by_one_turn() {
    let pair = |re: f64| [Complex::new(re, 528.0)];
    for (measured, fitted) in [(4.0, -4.0), (-4.0, 4.0)] {
        let drop = drop_over(&pair(measured), &pair(fitted));
        assert!(
            (drop.deviation_deg() - 360.0).abs() < 25.0,
            "{measured} {fitted}: {drop:?}"
        );
    }
}

#[test]
fn weight_is_the_integral_of_ln_coth() {
    assert!((weight(f64::INFINITY) - 2.467_401_100_272_34).abs() < 1e-14);
    for x in [0.001, 0.05, 0.0999, 0.1001, 1.0, 7.0] {
        // The midpoint rule; at 0 the logarithm adds an error of half a step times ln 2.
        let step = 1e-5;
        let midpoint = |k: usize| (k as f64 + 0.5) * step;
        let sum: f64 = (0..(x / step) as usize)
            .map(|k| -(midpoint(k) / 2.0).tanh().ln() * step)
            .sum();
        assert!((weight(x) - sum).abs() < 1e-4, "{x}: {} {sum}", weight(x));
        assert_eq!(weight(-x), -weight(x));
    }
}

#[test]
fn both_formulas_of_the_weight_agree_where_they_meet() {
    // ln coth(t/2) = ln(2/t) + t^2/12 - 7 t^4/1440 + ...: the formula for small t leaves out 7 t^5/7200, 9.7e-9 at 0.1, and then
    // 31 t^7/635040, 5e-12. The series ends at exp(-24)/240^2.
    let t: f64 = 0.1;
    let difference = weight_near_zero(t) - weight_by_series(t);
    let left_out = 7.0 * t.powi(5) / 7200.0;
    assert!((difference - left_out).abs() < 1e-11, "{difference}");
    assert_eq!(weight(0.0), 0.0);
}

#[test]
fn root_turns_the_phase_by_the_angle_seen_from_it() {
    let root = Complex::new;
    let quarter = std::f64::consts::FRAC_PI_4;
    // j + 1 has the phase pi/4. (j w + 1 - j)(j w + 1 + j) is 2 at w = 0 and 1 + 2 j at w = 1.
    for (left, turned) in [(root(-1.0, 0.0), quarter), (root(-1.0, 1.0), 2_f64.atan())] {
        let right = -left.conj();
        for (root, expected) in [(left, turned), (right, -turned)] {
            let found = turn(root, 0.0, 1.0);
            assert!((found - expected).abs() < 1e-14, "{root}: {found}");
        }
    }
    assert_eq!(turn(root(0.0, 0.0), 1.0, 2.0), 0.0);
}

#[test]
fn root_on_the_axis_is_not_in_the_right_half_plane() {
    // 1 - w^2 changes its sign at 1: half a turn, and no lag of an all-pass filter.
    let on_axis = Complex::new(0.0, 1.0);
    let found = turn(on_axis, 0.0, 2.0);
    assert!((found - std::f64::consts::PI).abs() < 1e-15, "{found}");
    let roots = Roots {
        poles: Vec::new(),
        zeros: vec![on_axis],
    };
    assert_eq!(roots.all_pass_lag(0.0, 2.0), 0.0);
}

#[test]
fn phase_of_the_roots_is_that_of_the_zeros_minus_that_of_the_poles() {
    // (s + 1)/((s + 1 - j)(s + 1 + j)) from w = 0 to 1: pi/4 - atan 2; (s - 1) instead of (s + 1): -pi/4 - atan 2, and the lag of
    // (s - 1)/(s + 1) is pi/2.
    let quarter = std::f64::consts::FRAC_PI_4;
    for (zero, by_zero, lag) in [(-1.0, quarter, 0.0), (1.0, -quarter, 2.0 * quarter)] {
        let roots = Roots {
            poles: vec![Complex::new(-1.0, 1.0)],
            zeros: vec![Complex::new(zero, 0.0)],
        };
        let change = roots.phase_change(0.0, 1.0);
        assert!((change - (by_zero - 2_f64.atan())).abs() < 1e-14);
        assert!((roots.all_pass_lag(0.0, 1.0) - lag).abs() < 1e-15);
    }
}

/// A curve of one magnitude, whose data begin at the first and end at the second third of the frequencies.
fn curve_of(magnitude: impl Fn(f64) -> f64, omega_rad_s: &[f64]) -> PhaseCurve {
    let third = omega_rad_s.len() / 3;
    let logarithms = |omega: &[f64]| {
        let points = omega.iter().map(|w| (*w, magnitude(*w).ln()));
        points.collect::<Vec<(f64, f64)>>()
    };
    let data = &omega_rad_s[third..2 * third];
    let measured: Vec<Complex<f64>> = data.iter().map(|w| magnitude(*w).into()).collect();
    PhaseCurve {
        fitted: measured.clone(),
        measured,
        omega_rad_s: data.to_vec(),
        below: logarithms(&omega_rad_s[..third]),
        above: logarithms(&omega_rad_s[2 * third..]),
    }
}

#[test]
fn minimum_phase_of_a_zero_is_that_of_bode() {
    // |1 + j w| belongs to the phase atan w. A step of h = 0.01 in ln w errs by h^2/8 of the curvature, which is at most 1/2: 6e-6,
    // and the slopes of the ends, 0 and 1, are reached to (1e-4)^2.
    let omega: Vec<f64> = (0..1843)
        .map(|k| 1e-4 * (0.01 * f64::from(k)).exp())
        .collect();
    let curve = curve_of(|w| w.hypot(1.0), &omega);
    for w in [0.1, 0.5, 1.0, 2.0, 10.0] {
        let phase = curve.minimum_phase(w);
        assert!((phase - w.atan()).abs() < 2e-5, "{w}: {phase}");
    }
}

#[test]
fn minimum_phase_of_a_power_of_the_frequency_is_that_many_quarter_turns() {
    // Also where most of it is extrapolated: 18 points 0.2 apart in ln w.
    let omega: Vec<f64> = (0..18).map(|k| (0.2 * f64::from(k)).exp()).collect();
    for power in [-2, 1] {
        let curve = curve_of(|w| w.powi(power), &omega);
        for w in [2.0, 5.0, 13.0] {
            let phase = curve.minimum_phase(w);
            let expected = f64::from(power) * std::f64::consts::FRAC_PI_2;
            assert!((phase - expected).abs() < 1e-12, "{w}: {phase}");
        }
    }
}

/// ln|G| with the slopes `slopes` between neighbouring `x`.
fn with_slopes(x: &[f64], slopes: &[f64]) -> LogMagnitude {
    let mut height = vec![1.0];
    for (pair, slope) in x.windows(2).zip(slopes) {
        height.push(height[height.len() - 1] + slope * (pair[1] - pair[0]));
    }
    LogMagnitude {
        x: x.to_vec(),
        height,
    }
}

#[test]
fn slope_at_an_end_is_the_median_over_its_interval() {
    // Intervals of 0.15 in ln w: the median of 9, 1, 5, 2 and 8 is 5; of two slopes it is the larger one.
    let mut x = vec![0.0];
    for k in 0..5 {
        x.push(x[k] + SLOPE_INTERVAL);
    }
    let magnitude = with_slopes(&x, &[9.0, 1.0, 5.0, 2.0, 8.0]);
    for (low, high, median) in [
        (x[0], x[5], 5.0),
        (x[0], x[3], 5.0),
        (x[0], x[2], 9.0),
        (x[1], x[4], 2.0),
        (x[0], x[1], 9.0),
        // No interval fits.
        (x[0], x[1] - 1e-9, 0.0),
        (x[5], x[5] + 1.0, 0.0),
    ] {
        let slope = magnitude.end_slope(low, high);
        assert!((slope - median).abs() < 1e-12, "{low} {high}: {slope}");
    }
}

#[test]
fn slope_ends_at_the_first_point_at_least_an_interval_above() {
    // The first x at least 0.15 above 0 is 0.25: a rise of 1.
    let magnitude = LogMagnitude {
        x: vec![0.0, 0.125, 0.25, 0.375],
        height: vec![3.0, 8.0, 4.0, 7.0],
    };
    assert_eq!(magnitude.slope_over_interval(0, 0.25), Some(4.0));
    assert_eq!(magnitude.slope_over_interval(0, 0.249), None);
    assert_eq!(magnitude.slope_over_interval(1, 1.0), Some(-4.0));
    assert_eq!(magnitude.slope_over_interval(2, 1.0), None);
}

#[test]
fn each_part_of_the_integral_is_a_slope_times_a_difference_of_weights() {
    // Slopes 3 from -2 to -1, -1 from there to 1, and 2 from there to 2; 0.6 from an end the slope is that of the end.
    let x: Vec<f64> = (0..=40).map(|k| 0.1 * f64::from(k) - 2.0).collect();
    let slope = |x: f64| match x {
        x if x < -1.0 => 3.0,
        x if x < 1.0 => -1.0,
        _ => 2.0,
    };
    let slopes: Vec<f64> = x.windows(2).map(|x| slope(0.5 * (x[0] + x[1]))).collect();
    let magnitude = with_slopes(&x, &slopes);
    let (all, far, near) = (weight(f64::INFINITY), weight(2.0), weight(1.0));
    let within = 3.0 * (far - near) - 2.0 * near + 2.0 * (far - near);
    let parts = [
        (magnitude.integral_below(), 3.0 * (all - far)),
        (magnitude.integral_within(), within),
        (magnitude.integral_above(), 2.0 * (all - far)),
    ];
    for (found, expected) in parts {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
    let sum: f64 = parts.iter().map(|(_, expected)| expected).sum();
    assert!((magnitude.phase() - sum / std::f64::consts::PI).abs() < 1e-12);
}

#[test]
fn turn_from_the_fit_is_the_sum_of_the_turns_between_neighbours() {
    // More than half a turn in all, and less between neighbours; the magnitudes have no effect.
    let phases: [f64; 5] = [0.3, 1.3, 3.3, 5.8, 8.3];
    let fitted: Vec<Complex<f64>> = (0..5).map(|k| Complex::new(1.0, f64::from(k))).collect();
    let rotated = fitted.iter().zip(phases);
    let curve = PhaseCurve {
        measured: rotated
            .map(|(fitted, phase)| fitted * Complex::from_polar(1.0 + phase, phase))
            .collect(),
        fitted,
        omega_rad_s: vec![1.0, 2.0, 3.0, 4.0, 5.0],
        below: Vec::new(),
        above: Vec::new(),
    };
    for (from, to) in [(0, 4), (1, 3), (2, 2)] {
        let turn = curve.turn_from_fit(from, to);
        assert!((turn - (phases[to] - phases[from])).abs() < 1e-14, "{turn}");
    }
}

#[test]
fn deviation_is_the_distance_of_measured_and_predicted_phase_drop() {
    for (drop_deg, predicted_deg, deviation_deg) in [(350.0, 360.0, 10.0), (-5.0, -30.0, 25.0)] {
        let drop = PhaseDrop {
            drop_deg,
            predicted_deg,
            followed_rad_s: (0.0, 0.0),
        };
        assert_eq!(drop.deviation_deg(), deviation_deg);
    }
}
