//! Derivatives, covariance and intervals of zeros.

use nalgebra::{Complex, DMatrix, DVector};

use super::stage::{Case, DAMPING_RAD_S, Stage, index, pair};
use crate::modal::{ModalFit, ModalParameters, Parameter};
use crate::verdict::zeros::{UncertainZero, derivatives, zeros};
use bench_plant::zeros::{ModalTerm, ZeroKind};

/// Steps of w1, zeta1, r1, w2, zeta2, r2, R and tau: about 1e-5 of the distance of the modes, so that the error of a central
/// difference, its square, is 1e-9. The zeros move by 1e-3 rad/s and are computed to some 1e-11 rad/s.
const STEPS: [f64; 8] = [1e-3, 1e-5, 1e-6, 1e-3, 1e-5, 1e-6, 1e-9, 1e-3];
/// Relative error of a central difference, with reserve for parameters that move the zeros less.
const DIFFERENCE_ERROR: f64 = 1e-5;

/// The zero of a fit nearest to `near`.
fn zero_near(fit: &ModalFit, near: Complex<f64>) -> UncertainZero {
    let distance = |zero: &UncertainZero| (zero.s - near).norm();
    let zeros = zeros(fit).expect("zeros").into_iter();
    let nearest = zeros.min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.expect("a zero")
}

/// Half the difference of the zero between the parameters with `step` added and with it subtracted.
fn central_difference(fit: &ModalFit, zero: Complex<f64>, step: &[f64]) -> Complex<f64> {
    let moved = |sign: f64| {
        let step: Vec<f64> = step.iter().map(|step| sign * step).collect();
        let fit = ModalFit {
            parameters: fit.parameters.shifted(&step),
            ..fit.clone()
        };
        zero_near(&fit, zero).s
    };
    (moved(1.0) - moved(-1.0)) * 0.5
}

/// A mode of 100 rad/s with r/R = `ratio` w^2.
fn one_mode(ratio: f64) -> ModalFit {
    let (w, remainder_m_per_n) = (100.0, 1e-4);
    let mode = ModalTerm {
        omega_rad_s: w,
        damping_ratio: 0.5 * DAMPING_RAD_S / w,
        residue_per_kg: ratio * w * w * remainder_m_per_n,
    };
    let parameters = ModalParameters {
        modes: vec![mode],
        remainder_m_per_n,
        ..ModalParameters::default()
    };
    ModalFit {
        parameters,
        covariance: DMatrix::zeros(5, 5),
        ..Stage::with_pair(3.0).fit()
    }
}

/// The zeros of [`one_mode`] solve s^2 + 2 zeta w s + w^2 + r/R = 0. By each of w, zeta, r, R, tau:
/// dz = -(derivative of the left side)/(2 z + 2 zeta w).
fn one_mode_derivatives(fit: &ModalFit, z: Complex<f64>) -> [Complex<f64>; 5] {
    let ModalTerm {
        omega_rad_s: w,
        damping_ratio: zeta,
        residue_per_kg: r,
    } = fit.parameters.modes[0];
    let remainder = fit.parameters.remainder_m_per_n;
    let real = |x: f64| Complex::new(x, 0.0);
    let left_side = [
        z * (2.0 * zeta) + 2.0 * w,
        z * (2.0 * w),
        real(1.0 / remainder),
        real(-r / (remainder * remainder)),
        real(0.0),
    ];
    left_side.map(|derivative| -derivative / (z * 2.0 + 2.0 * zeta * w))
}

/// Complex zeros for r/R = w^2, real ones for r/R = -1.25 w^2: s = -c/2 +- sqrt(c^2/4 - w^2 - r/R).
fn one_mode_zeros() -> [(ModalFit, Complex<f64>); 2] {
    let half = 0.5 * DAMPING_RAD_S;
    let imaginary = (2e4 - half * half).sqrt();
    let real = (2.5e3 + half * half).sqrt() - half;
    [
        (one_mode(1.0), Complex::new(-half, imaginary)),
        (one_mode(-1.25), Complex::new(real, 0.0)),
    ]
}

#[test]
fn derivatives_of_a_zero_of_one_mode_have_their_closed_form() {
    for (fit, zero) in one_mode_zeros() {
        let rows = derivatives(&fit, zero);
        let closed_form = one_mode_derivatives(&fit, zero);
        for (k, expected) in closed_form.into_iter().enumerate() {
            let found = Complex::new(rows[(0, k)], rows[(1, k)]);
            // The zero is rounded: 1e-16 of its square, over r/R.
            let tolerance = 1e-12 * expected.norm();
            assert!(
                (found - expected).norm() <= tolerance,
                "{k}: {found} {expected}"
            );
        }
    }
}

#[test]
fn derivatives_are_the_difference_quotients_of_the_zeros() {
    let fit = Stage::with_pair(3.0).fit();
    for zero in [pair(3.0), pair(-DAMPING_RAD_S - 3.0)] {
        let rows = derivatives(&fit, zero);
        for (k, size) in STEPS.into_iter().enumerate() {
            let mut step = [0.0; 8];
            step[k] = size;
            let quotient = central_difference(&fit, zero, &step) / size;
            let found = Complex::new(rows[(0, k)], rows[(1, k)]);
            assert!(
                (found - quotient).norm() <= DIFFERENCE_ERROR * quotient.norm(),
                "{k}: {found} {quotient}"
            );
        }
    }
}

#[test]
fn zero_by_the_remainder_has_its_closed_form() {
    for re in [3.0, -0.3, 0.02] {
        let (stage, zero) = (Stage::with_pair(re), pair(re));
        let fit = stage.fit();
        let rows = derivatives(&fit, zero);
        let at = index(&fit, Parameter::Remainder);
        let found = Complex::new(rows[(0, at)], rows[(1, at)]);
        let expected = stage.zero_by_remainder(zero);
        // The residues are rounded: 1e-16 of u^2 = 1e8 over the distance |u - u*| = 200 of the roots.
        assert!(
            (found - expected).norm() < 1e-8 * expected.norm(),
            "{re}: {found} {expected}"
        );
    }
}

#[test]
fn covariance_is_that_of_the_moves_of_the_zero() {
    // Two independent errors, each of all parameters together: C = v v^T + w w^T. With the moves a and b of the zero along v and w,
    // its covariance is a a^T + b b^T.
    let mut fit = Stage::with_pair(3.0).fit();
    let signs = [
        [1.0, -1.0, 1.0, 1.0, 1.0, -1.0, 1.0, 1.0],
        [-1.0, -1.0, 2.0, 1.0, 3.0, 1.0, 1.0, -1.0],
    ];
    let steps = signs.map(|signs| {
        let steps = STEPS.iter().zip(signs).map(|(step, sign)| step * sign);
        steps.collect::<Vec<f64>>()
    });
    let [v, w] = steps.clone().map(DVector::from_vec);
    fit.covariance = &v * v.transpose() + &w * w.transpose();
    for zero in [pair(3.0), pair(-DAMPING_RAD_S - 3.0)] {
        let moves = steps
            .each_ref()
            .map(|step| central_difference(&fit, zero, step));
        let found = zero_near(&fit, zero).covariance;
        let sum = |of: fn(&Complex<f64>) -> f64| moves.iter().map(of).sum::<f64>();
        let cross = sum(|a| a.re * a.im);
        let expected = [[sum(|a| a.re * a.re), cross], [cross, sum(|a| a.im * a.im)]];
        let size = expected[0][0] + expected[1][1];
        for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
            assert!(
                (found - expected).abs() < 2.0 * DIFFERENCE_ERROR * size,
                "{found} {expected}"
            );
        }
    }
}

#[test]
fn interval_of_the_real_part_is_that_of_the_zeros_at_the_ends_of_the_interval_of_the_remainder() {
    // The remainder alone is uncertain, by 1e-4 of itself: the zero moves by 5e-4 rad/s and deviates from a line by 1e-7 rad/s.
    let stage = Stage::with_pair(3.0);
    let case = Case::of(&stage).with_sigma(Parameter::Remainder, 1e-8);
    let (low, high) = zero_near(&case.fit, pair(3.0)).real_part().interval_95();
    let mut ends = [-1.96, 1.96].map(|sigmas| {
        let mut fit = case.fit.clone();
        fit.parameters.remainder_m_per_n += sigmas * 1e-8;
        zero_near(&fit, pair(3.0)).s.re
    });
    ends.sort_by(f64::total_cmp);
    assert!(ends[1] - ends[0] > 1e-3, "{ends:?}");
    assert!((low - ends[0]).abs() < 1e-6, "{low} {ends:?}");
    assert!((high - ends[1]).abs() < 1e-6, "{high} {ends:?}");
}

#[test]
fn probability_of_the_right_half_plane_is_that_of_a_normal_distribution() {
    // The normal distribution function at 1 and 2.
    for (sigmas, above) in [(1.0, 0.841_344_746), (2.0, 0.977_249_868)] {
        for (re, expected) in [(0.3, above), (-0.3, 1.0 - above)] {
            let stage = Stage::with_pair(re);
            let case = Case::of(&stage).with_zero_at_sigmas(&stage, pair(re), sigmas);
            let probability = zero_near(&case.fit, pair(re)).rhp_probability;
            // The table has nine digits; sigma is exact to 1e-8.
            assert!((probability - expected).abs() < 1e-7, "{re}: {probability}");
        }
    }
}

#[test]
fn real_zero_has_no_imaginary_part() {
    let [_, (mut fit, zero)] = one_mode_zeros();
    let [.., by_remainder, _] = one_mode_derivatives(&fit, zero);
    let sigma = 1e-2 * fit.parameters.remainder_m_per_n;
    let at = index(&fit, Parameter::Remainder);
    fit.covariance[(at, at)] = sigma * sigma;
    let found = zero_near(&fit, zero);
    let [[re, cross], [other, im]] = found.covariance;
    let expected = (by_remainder.re * sigma).powi(2);
    // Rounding of the zero.
    assert!((re / expected - 1.0).abs() < 1e-9, "{re} {expected}");
    assert_eq!([cross, other, im], [0.0; 3]);
    assert_eq!((found.s.im, found.kind), (0.0, ZeroKind::Rnmp));
}

#[test]
fn delay_does_not_move_a_zero() {
    let case = Case::of(&Stage::with_pair(3.0)).with_sigma(Parameter::Delay, 1.0);
    assert_eq!(zero_near(&case.fit, pair(3.0)).covariance, [[0.0; 2]; 2]);
}

#[test]
fn zeros_that_coincide_have_an_unbounded_covariance() {
    // With re = -c/2 the pair is its own companion. The damping is uncertain by 1e-3 of itself; apart, zeros move by about that part
    // of c, coinciding ones as far as the root of the rounding allows.
    let case = Case::of(&Stage::with_pair(-0.5 * DAMPING_RAD_S));
    let case = case.with_sigma(Parameter::Damping(0), 1e-5);
    let found = zero_near(&case.fit, pair(-0.5 * DAMPING_RAD_S));
    // Also right for a variance that is not a number.
    let is_bounded = found.covariance[0][0].sqrt() < 1.0;
    assert!(!is_bounded, "{found:?}");
}
