//! Responses in closed form with noise of a known standard deviation give their modes, signs and verdict.

use nalgebra::Complex;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::FrfPoint;

/// Hertz, damping ratio, residue.
type Mode = (f64, f64, f64);

/// G(s) = r1/(s^2 + w1^2) + r2/(s^2 + w2^2) without damping has a zero at s^2 = -(r1 w2^2 + r2 w1^2)/(r1 + r2): on the imaginary axis
/// between the modes for equal signs.
const PLUS_PLUS: [Mode; 2] = [(30.0, 0.008, 0.5), (80.0, 0.006, 0.3)];
/// For opposite signs with r1 > |r2|: s^2 = -(0.5 80^2 - 0.2 30^2)/0.3 (2 pi)^2, at 100 Hz above both.
const PLUS_MINUS: [Mode; 2] = [(30.0, 0.008, 0.5), (80.0, 0.006, -0.2)];
/// Between a close pair of opposite signs on the response of a lower mode, the zeros are CNMP: by numpy (roots of the numerator) they are
/// 15.13 +- 615.52j rad/s.
const CNMP: [Mode; 3] = [(20.0, 0.01, 1.0), (97.0, 0.005, -0.1), (99.0, 0.005, 0.1)];

fn response(modes: &[Mode], hz: f64) -> Complex<f64> {
    let s = Complex::new(0.0, rad_s(hz));
    let mode = |(at_hz, zeta, residue): &Mode| {
        let w = rad_s(*at_hz);
        (s * s + s * (2.0 * zeta * w) + w * w).inv() * *residue
    };
    let delay = Complex::from_polar(1.0, -rad_s(hz) * 3e-4);
    modes.iter().map(mode).sum::<Complex<f64>>() * delay
}

/// A complex Gaussian number with E|z|^2 = 1.
fn normal(random: &mut Pcg64Mcg) -> Complex<f64> {
    let mut uniform = || (random.next_u64() as f64 + 0.5) / u64::MAX as f64;
    let (radius, angle) = ((-uniform().ln()).sqrt(), std::f64::consts::TAU * uniform());
    Complex::from_polar(radius, angle)
}

/// Lines of 0.1 Hz up to 150 Hz with errors of 1e-4 of the static response, coupled between neighbours by `taps`; the standard deviations
/// of the file are `stated` times the true ones.
fn measured(modes: &[Mode], scale: f64, taps: &[f64], stated: f64, seed: u64) -> Frf {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let count = 1500;
    let white: Vec<_> = (0..count + taps.len())
        .map(|_| normal(&mut random))
        .collect();
    let power = taps.iter().map(|tap| tap * tap).sum::<f64>().sqrt();
    let sigma = 1e-4 * scale.abs() * response(modes, 0.0).norm();
    let mut frf = Frf::default();
    for (k, near) in white.windows(taps.len()).take(count).enumerate() {
        let frequency_hz = 0.1 * (k + 1) as f64;
        let products = near.iter().zip(taps).map(|(e, tap)| e * *tap);
        let error = products.sum::<Complex<f64>>() / power * sigma;
        frf.push(FrfPoint {
            frequency_hz,
            response: response(modes, frequency_hz) * scale + error,
            coherence: 1.0,
            variance: (stated * sigma).powi(2),
            resolution_hz: 0.1,
        });
    }
    frf
}

/// Each parameter within 4.5 standard deviations: with normal errors, one of 150,000 is not.
#[track_caller]
fn is(found: &ResponseAnalysis, modes: &[Mode], scale: f64) {
    let fit = found.fit.as_ref().expect("modes");
    let fitted = fit.modes();
    assert_eq!(fitted.len(), modes.len(), "{fitted:?}");
    for (mode, (hz, zeta, residue)) in fitted.iter().zip(modes) {
        let pairs = [
            (mode.frequency_hz(), *hz),
            (mode.damping_ratio, *zeta),
            (mode.residue_per_kg, *residue * scale),
        ];
        for (estimate, truth) in pairs {
            let deviation = (estimate.value - truth).abs() / estimate.sigma;
            assert!(deviation < 4.5, "{estimate:?} {truth}");
            // 1e-4 of the static response at 1500 lines.
            assert!(estimate.sigma < 5e-3 * truth.abs(), "{estimate:?}");
        }
    }
    assert!((fit.delay_s().value / 3e-4 - 1.0).abs() < 0.05);
}

#[test]
fn modes_signs_and_verdict_are_those_of_the_stage_in_any_unit_and_sign() {
    for (modes, cnmp) in [
        (&PLUS_PLUS[..], Cnmp::Excluded),
        (&PLUS_MINUS[..], Cnmp::Excluded),
        (&CNMP[..], Cnmp::Detected),
    ] {
        for (seed, scale) in [1.0, 1e6, -1.0, -3e-9].into_iter().enumerate() {
            let frf = measured(modes, scale, &[1.0], 1.0, seed as u64);
            let found = ResponseIdentification::new().run(&frf).expect("a response");
            is(&found, modes, scale);
            assert_eq!(found.verdict.cnmp, cnmp, "{scale}: {}", found.verdict.why);
            let chi2 = found.fit.expect("modes").chi2_per_freedom;
            assert!((0.7..1.3).contains(&chi2), "{chi2}");
        }
    }
}

#[test]
fn points_with_coupled_errors_do_not_count_as_independent() {
    // Under a Hann window the sum of all correlations is 2: half of the points count.
    let hann = [0.25, 1.0, 0.25];
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..12 {
        let frf = measured(&PLUS_MINUS, 1.0, &hann, 1.0, 100 + seed);
        let found = ResponseIdentification::new().run(&frf).expect("a response");
        is(&found, &PLUS_MINUS, 1.0);
        let ratio = found.frf.len() as f64 / found.frf.data.len() as f64;
        assert!((1.5..=4.0).contains(&ratio), "{ratio}");
        for (mode, (hz, zeta, residue)) in found.fit.expect("modes").modes().iter().zip(PLUS_MINUS)
        {
            for (estimate, truth) in [
                (mode.frequency_hz(), hz),
                (mode.damping_ratio, zeta),
                (mode.residue_per_kg, residue),
            ] {
                squares += ((estimate.value - truth) / estimate.sigma).powi(2);
                count += 1.0;
            }
        }
    }
    // 72 squared deviations over their variances have a mean of 1 with a standard deviation of 0.17; all points would give 2.
    let mean: f64 = squares / count;
    assert!((0.5..1.5).contains(&mean), "{mean}");
}

#[test]
fn standard_deviations_that_are_too_small_are_named() {
    let frf = measured(&PLUS_PLUS, 1.0, &[1.0], 0.1, 7);
    let found = ResponseIdentification::new().run(&frf).expect("a response");
    assert_eq!(found.verdict.cnmp, Cnmp::Undecided);
    let why = &found.verdict.why;
    assert!(why.contains("only 0.10 times the scatter"), "{why}");
}

#[test]
fn band_selects_the_points_and_limits_the_verdict() {
    let frf = measured(&PLUS_PLUS, 1.0, &[1.0], 1.0, 8);
    let found = ResponseIdentification::new().band_hz(5.0, 60.0).run(&frf);
    let found = found.expect("a response");
    assert_eq!(found.band_hz, (5.0, 60.0));
    assert_eq!(found.judged_up_to_rad_s, rad_s(60.0));
    assert!(
        found
            .frf
            .data
            .iter()
            .all(|datum| (5.0..=60.0).contains(&datum.frequency_hz))
    );
    let none = ResponseIdentification::new()
        .band_hz(200.0, 300.0)
        .run(&frf);
    assert!(
        matches!(none, Err(ResponseError::NoPoint { points: 1500, .. })),
        "{none:?}"
    );
    for (low, high) in [(60.0, 5.0), (-1.0, 5.0), (f64::NAN, 5.0), (5.0, 5.0)] {
        let found = ResponseIdentification::new().band_hz(low, high).run(&frf);
        assert!(
            matches!(found, Err(ResponseError::Limits { .. })),
            "{low} {high}"
        );
    }
}

#[test]
fn hold_of_a_command_is_part_of_the_model() {
    // (1 - exp(-s T))/(s T) of a hold of 2 ms, the aliases of both modes included: exact zero-order-hold discretisation of
    // r/(w^2 + ..) by its pole p, G(z) = sum of Im[r/(w_d p) (1 - e^(pT))/(z - e^(pT))].
    let period_s = 2e-3;
    let sampled = |hz: f64| {
        let z = Complex::from_polar(1.0, rad_s(hz) * period_s);
        let term = |(at_hz, zeta, residue): &Mode| {
            let (w, damped) = (rad_s(*at_hz), (1.0 - zeta * zeta).sqrt());
            let pole = Complex::new(-zeta, damped) * w;
            let part = |pole: Complex<f64>, sign: f64| {
                let step = (pole * period_s).exp();
                (step - 1.0) / (pole * (z - step)) * Complex::new(0.0, -0.5 * sign)
            };
            (part(pole, 1.0) + part(pole.conj(), -1.0)) * (*residue / (w * damped))
        };
        PLUS_MINUS.iter().map(term).sum::<Complex<f64>>()
    };
    let mut random = Pcg64Mcg::seed_from_u64(9);
    let sigma = 1e-4 * sampled(0.1).norm();
    let mut frf = Frf::default();
    for k in 1..2000 {
        let frequency_hz = 0.1 * f64::from(k);
        frf.push(FrfPoint {
            frequency_hz,
            response: sampled(frequency_hz) + normal(&mut random) * sigma,
            coherence: 1.0,
            variance: sigma * sigma,
            resolution_hz: 0.1,
        });
    }
    let found = ResponseIdentification::new().held_at_hz(500.0).run(&frf);
    let found = found.expect("a response");
    let modes = found.fit.expect("modes").modes();
    assert_eq!(modes.len(), 2);
    for (mode, (hz, _, residue)) in modes.iter().zip(PLUS_MINUS) {
        let deviation = (mode.frequency_hz().value - hz).abs() / mode.frequency_hz().sigma;
        assert!(deviation < 4.5, "{mode:?}");
        let deviation = (mode.residue_per_kg.value - residue).abs() / mode.residue_per_kg.sigma;
        assert!(deviation < 4.5, "{mode:?}");
    }
    let beyond = ResponseIdentification::new().held_at_hz(390.0).run(&frf);
    assert!(
        matches!(beyond, Err(ResponseError::BeyondHalfRate { .. })),
        "{beyond:?}"
    );
}

#[test]
fn response_from_output_to_input_is_named_with_its_remedy() {
    let frf = measured(&PLUS_PLUS, 1.0, &[1.0], 1.0, 10);
    let mut inverse = Frf::default();
    for k in (0..frf.len()).step_by(5) {
        let h = frf.response[k];
        inverse.push(FrfPoint {
            frequency_hz: frf.frequency_hz[k],
            response: h.inv(),
            coherence: 1.0,
            variance: 2.0 * frf.magnitude_sigma[k].powi(2) / h.norm_sqr().powi(2),
            resolution_hz: 0.1,
        });
    }
    let found = ResponseIdentification::new()
        .run(&inverse)
        .expect("a response");
    assert_eq!(found.verdict.cnmp, Cnmp::Undecided);
    let why = &found.verdict.why;
    assert!(why.contains("inverse") && !why.contains("--input"), "{why}");
}
