//! Response and poles of a fit with given parameters, against closed forms.

use bench_identify::modal::{MeasurementChain, ModalFit, ModalParameters};
use bench_plant::zeros::ModalTerm;
use nalgebra::{Complex, DMatrix};

const DELAY_S: f64 = 3e-4;
const REMAINDER_M_PER_N: f64 = 2e-6;

fn fit(modes: Vec<ModalTerm>, covariance: DMatrix<f64>) -> ModalFit {
    let parameters = ModalParameters {
        modes,
        remainder_m_per_n: REMAINDER_M_PER_N,
        delay_s: DELAY_S,
        ..ModalParameters::default()
    };
    ModalFit {
        parameters,
        covariance,
        orders: Vec::new(),
        one_more_mode: None,
        chi2_per_freedom: 1.0,
        freedom: 1000,
        band_hz: (1.0, 500.0),
        left_out_hz: Vec::new(),
    }
}

fn term(omega_rad_s: f64, damping_ratio: f64, residue_per_kg: f64) -> ModalTerm {
    ModalTerm {
        omega_rad_s,
        damping_ratio,
        residue_per_kg,
    }
}

#[test]
fn response_is_the_delayed_sum_of_modes_and_remainder() {
    let modes = vec![
        term(184.0, 0.009, 0.47),
        term(516.0, 0.004, -0.03),
        term(0.0, 0.0, 0.01),
    ];
    let frequency_hz = [1.0, 29.3, 82.0, 84.4, 300.0];
    let response =
        fit(modes.clone(), DMatrix::zeros(9, 9)).response(&MeasurementChain::Direct, &frequency_hz);
    for (f, h) in frequency_hz.iter().zip(response) {
        let s = Complex::new(0.0, 2.0 * std::f64::consts::PI * f);
        let of = |t: &ModalTerm| {
            (s * s + s * (2.0 * t.damping_ratio * t.omega_rad_s) + t.omega_rad_s.powi(2)).inv()
        };
        let sum: Complex<f64> = modes
            .iter()
            .map(|t| of(t) * t.residue_per_kg)
            .sum::<Complex<f64>>()
            + REMAINDER_M_PER_N;
        let truth = sum * (-s * DELAY_S).exp();
        // The library models the remainder, 2e-6 m/N, as modes at 1e6 rad/s, which change it by 2 |s|/1e6.
        assert!(
            (h - truth).norm() < 1e-14 * truth.norm() + 3.0 * s.norm() / 1e6 * REMAINDER_M_PER_N,
            "{f} Hz: {h} {truth}"
        );
    }
}

#[test]
fn pole_and_covariance_follow_from_frequency_and_damping() {
    let mut covariance = DMatrix::zeros(5, 5);
    (covariance[(0, 0)], covariance[(1, 1)]) = (4e-4, 9e-10);
    let fit = fit(vec![term(500.0, 0.6, 1.0)], covariance);
    let [pole] = fit.poles()[..] else {
        panic!("one pole above the real axis")
    };
    // s = w (-0.6 + 0.8 j). Derivatives of (re, im): by w (-0.6, 0.8), by zeta (-500, -500 x 0.6/0.8).
    assert!((pole.s - Complex::new(-300.0, 400.0)).norm() < 1e-12);
    let expected = [
        [
            0.36 * 4e-4 + 250_000.0 * 9e-10,
            -0.48 * 4e-4 + 187_500.0 * 9e-10,
        ],
        [
            -0.48 * 4e-4 + 187_500.0 * 9e-10,
            0.64 * 4e-4 + 140_625.0 * 9e-10,
        ],
    ];
    for (row, truth) in pole.covariance.iter().zip(expected) {
        for (value, truth) in row.iter().zip(truth) {
            // The terms are about 1e-4; rounding is below 1e-4 * 2^-52 = 2e-20 per term.
            assert!((value - truth).abs() < 1e-17, "{:?}", pole.covariance);
        }
    }
}

#[test]
fn overdamped_mode_has_two_real_poles_and_a_free_body_one_at_zero() {
    let fit = fit(
        vec![term(0.0, 0.0, 1.0), term(100.0, 1.25, 1.0)],
        DMatrix::identity(6, 6),
    );
    // s = -w (zeta -+ sqrt(zeta^2 - 1)); the square root is 0.75.
    let poles: Vec<Complex<f64>> = fit.poles().iter().map(|pole| pole.s).collect();
    assert_eq!(poles, [0.0, -50.0, -200.0].map(|re| Complex::new(re, 0.0)));
    assert_eq!(fit.poles()[0].covariance, [[0.0; 2]; 2]);
    // Derivatives of the pole at -50: by w -0.5, by zeta 100 (-1 + 1.25/0.75) = 200/3.
    let truth = 0.25 + (200.0f64 / 3.0).powi(2);
    assert!((fit.poles()[1].covariance[0][0] / truth - 1.0).abs() < 1e-14);
    assert_eq!(fit.poles()[1].covariance[1], [0.0; 2]);
}
