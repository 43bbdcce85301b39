//! Stages with one damper: responses by the inverse of their matrices, poles and zeros by the roots of determinants.

mod filters;
mod stage;

use std::f64::consts::TAU;

use nalgebra::Complex;

use super::*;
use crate::modal::fit;
use crate::verdict::{self, Cnmp};
use crate::{Estimate, Frf, Identification, OutputKind, ResponseAnalysis, ResponseIdentification};
use stage::{CMP, CNMP, Stage};

/// Data from 5 to 125 Hz.
const LOW_HZ: f64 = 5.0;
const STEP_HZ: f64 = 0.3;
const COUNT: usize = 400;

fn data(stage: &Stage, seed: u64) -> Vec<FrfDatum> {
    stage.data(LOW_HZ, STEP_HZ, COUNT, seed)
}

fn with_complex(data: &[FrfDatum]) -> ModalFit {
    with_complex_through(data, &MeasurementChain::Direct)
}

fn with_complex_through(data: &[FrfDatum], chain: &MeasurementChain) -> ModalFit {
    fit_few(data, chain, &Residues::complex(), MAX_MODES).expect("modes")
}

/// The response as an external program gives it.
fn identified(data: &[FrfDatum]) -> ResponseAnalysis {
    let mut frf = Frf::default();
    for datum in data {
        frf.push(crate::FrfPoint {
            frequency_hz: datum.frequency_hz,
            response: datum.response,
            coherence: 1.0,
            variance: datum.variance,
            resolution_hz: STEP_HZ,
        });
    }
    ResponseIdentification::new().run(&frf).expect("a response")
}

/// Each estimate within 4.5 standard deviations: with normal errors, one of 150,000 is not.
#[track_caller]
fn assert_near(estimate: Estimate, truth: f64) {
    let deviation = (estimate.value - truth).abs() / estimate.sigma;
    assert!(deviation < 4.5, "{estimate:?}, not {truth}");
}

#[test]
fn poles_residues_and_zeros_are_those_of_the_matrices() {
    for stage in [CNMP, CMP] {
        for seed in 0..4 {
            let found = identified(&data(&stage, seed));
            let fit = found.fit.as_ref().expect("modes");
            assert!(!fit.parameters.has_real_residues(), "{}", found.verdict.why);
            assert_modes(fit, &stage);
            for truth in stage.zeros() {
                let zeros = found.verdict.zeros.iter();
                let distance = |zero: &&verdict::UncertainZero| (zero.s - truth).norm();
                let near = zeros.min_by(|a, b| distance(a).total_cmp(&distance(b)));
                let near = near.expect("zeros");
                assert_near(near.real_part(), truth.re);
                let sigma = near.covariance[1][1].sqrt();
                assert_near(
                    Estimate {
                        value: near.s.im,
                        sigma,
                    },
                    truth.im,
                );
            }
        }
    }
}

/// Poles and residues of the stage, each within its errors.
#[track_caller]
fn assert_modes(fit: &ModalFit, stage: &Stage) {
    let (modes, truth) = (fit.modes(), stage.partial_fractions());
    assert_eq!(modes.len(), truth.len(), "{modes:?}");
    for (mode, (pole, rho)) in modes.iter().zip(truth) {
        let rho = rho * (pole * fit.parameters.delay_s).exp();
        assert_near(mode.omega_rad_s, pole.norm());
        assert_near(mode.damping_ratio, -pole.re / pole.norm());
        // G exp(s tau) has the residues rho exp(p tau); rho/(s - p) + conj has the numerator 2 Re rho s - 2 Re(rho p*).
        assert_near(mode.residue_per_kg, -2.0 * (rho * pole.conj()).re);
        if let Some(imaginary) = mode.residue_imaginary_per_kg {
            assert_near(imaginary, 2.0 * rho.re * pole.norm());
        }
    }
}

/// A held command and samples of the output: x[k + 1] = e x[k] + (e - 1)/p u[k] with e = exp(p T) and y = sum of rho x + conj.
#[test]
fn samples_of_a_held_command_have_the_same_modes_up_to_045_of_the_rate() {
    let rate_hz = 280.0;
    for stage in [CNMP, CMP] {
        let mut data = data(&stage, 21);
        for datum in &mut data {
            let s = Complex::new(0.0, TAU * datum.frequency_hz);
            let z = (s / rate_hz).exp();
            let sampled = |(p, rho): &(Complex<f64>, Complex<f64>)| {
                let e = (p / rate_hz).exp();
                rho * (e - 1.0) / p / (z - e)
            };
            let poles = stage.partial_fractions();
            let conjugates = poles.iter().map(|(p, rho)| (p.conj(), rho.conj()));
            let all: Vec<_> = poles.iter().copied().chain(conjugates).collect();
            let noise = datum.response - stage.response(s);
            datum.response = all.iter().map(sampled).sum::<Complex<f64>>() + noise;
        }
        let path = crate::modal::InputPath {
            hold_s: 1.0 / rate_hz,
            lag_s: 0.0,
        };
        let fit = with_complex_through(&data, &path.chain(rate_hz));
        // 800 numbers with a standard deviation of 1/sqrt(400) = 5 %.
        assert!(
            (0.8..1.2).contains(&fit.chi2_per_freedom),
            "{}",
            fit.chi2_per_freedom
        );
        assert_modes(&fit, &stage);
    }
}

/// Real residues need many modes, which the data do not determine. Two of them had a reduced chi-square of 1e8.
#[test]
fn undetermined_modes_are_not_replaced_by_fewer_that_describe_nothing() {
    for seed in 0..4 {
        let real = fit(&data(&CNMP, seed), &MeasurementChain::Direct);
        match real {
            Ok(fit) => assert!(fit.chi2_per_freedom < 10.0, "{}", fit.chi2_per_freedom),
            Err(FitError::Undetermined { modes }) => assert!(modes > 3, "{modes}"),
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn verdict_follows_from_the_zeros() {
    for (stage, cnmp) in [(CNMP, Cnmp::Detected), (CMP, Cnmp::Excluded)] {
        let right = stage.zeros().iter().filter(|zero| zero.re > 0.0).count();
        assert_eq!(right, usize::from(cnmp == Cnmp::Detected));
        let found = identified(&data(&stage, 11));
        assert_eq!(found.verdict.cnmp, cnmp, "{}", found.verdict.why);
        let why = &found.verdict.why;
        assert!(why.contains("the residues are complex"), "{why}");
        assert!(!why.contains("residues of opposite signs"), "{why}");
        let modes = found.fit.expect("modes").modes();
        assert!(modes.iter().all(|mode| mode.certain_sign() == 'c'));
    }
}

/// Of 120 zeros with independent errors 95 % lie inside, with a standard deviation of 2 %; the RMS value of the errors over their standard
/// deviations is 1, with a standard deviation of 1/sqrt(240) = 6.5 %. Both within 3.5 standard deviations.
#[test]
fn intervals_of_the_zeros_hold_the_truth() {
    let truth = CNMP.zeros();
    let zero = truth
        .iter()
        .find(|zero| zero.re > 0.0)
        .expect("a CNMP zero");
    let (count, mut inside, mut square) = (120, 0, 0.0);
    for seed in 0..count {
        let fit = with_complex(&data(&CNMP, 1000 + seed));
        let zeros = verdict::zeros(&fit).expect("zeros");
        let distance = |found: &&verdict::UncertainZero| (found.s - zero).norm();
        let near = zeros
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let part = near.expect("zeros").real_part();
        let error = part.value - zero.re;
        inside += u32::from(error.abs() < part.half_width_95());
        square += (error / part.sigma).powi(2);
    }
    let (ratio, rms) = (
        f64::from(inside) / count as f64,
        (square / count as f64).sqrt(),
    );
    assert!((0.88..=1.0).contains(&ratio), "{ratio}");
    assert!((0.77..1.23).contains(&rms), "{rms}");
}

/// With real residues chi^2 decreases by a chi-square number of 2 or 3 degrees of freedom; the probability of more than 3 ln 800 + 25 is
/// 1e-9.
#[test]
fn proportional_damping_is_never_taken_for_another() {
    for (seed, stage) in (0..60).zip([CNMP, CMP].into_iter().cycle()) {
        let stage = stage.without_damper();
        let data = data(&stage, seed);
        let real = fit(&data, &MeasurementChain::Direct);
        assert!(fit_complex(&data, &MeasurementChain::Direct, &real).is_none());
        // Even if nothing were known of real residues.
        let complex = with_complex(&data);
        let is_accepted = is_accepted(&complex, &data, &MeasurementChain::Direct);
        assert!(!is_accepted, "{seed}: {:?}", complex.modes());
    }
}

#[test]
fn a_velocity_is_no_position_with_complex_residues() {
    let mut data = data(&CNMP.without_damper(), 5);
    for datum in &mut data {
        let s = Complex::new(0.0, TAU * datum.frequency_hz);
        datum.response *= s;
        datum.variance *= s.norm_sqr();
    }
    let complex = with_complex(&data);
    assert!(complex.leaves_noise());
    assert!(complex.modes().iter().all(is_mostly_imaginary));
    let is_accepted = is_accepted(&complex, &data, &MeasurementChain::Direct);
    assert!(!is_accepted, "{:?}", complex.modes());
}

/// As a signal that is continuous in time, s^2 G with s^4 times the variance.
#[test]
fn acceleration_has_the_modes_of_the_position() {
    let chain = MeasurementChain::Direct.observing(OutputKind::Acceleration);
    for stage in [CNMP, CMP] {
        let mut data = data(&stage, 6);
        for datum in &mut data {
            let s = Complex::new(0.0, TAU * datum.frequency_hz);
            datum.response *= s * s;
            datum.variance *= (s * s).norm_sqr();
        }
        let real = fit(&data, &chain);
        let fit = fit_complex(&data, &chain, &real).expect("complex residues");
        assert_modes(&fit, &stage);
    }
}

#[test]
fn samples_of_an_acceleration_by_a_held_force_are_not_tested() {
    let path = crate::modal::InputPath {
        hold_s: 1.0 / RATE_HZ,
        lag_s: 0.0,
    };
    let real = Err(FitError::Undetermined { modes: 5 });
    for (output, is_tested) in [
        (OutputKind::Velocity, true),
        (OutputKind::Acceleration, false),
    ] {
        let chain = path.chain(RATE_HZ).observing(output);
        let mut data = data(&CNMP, 6);
        for datum in &mut data {
            let s = Complex::new(0.0, TAU * datum.frequency_hz);
            datum.response *= chain.continuous_response(s, 0.0);
            datum.variance *= chain.continuous_response(s, 0.0).norm_sqr();
        }
        let found = fit_complex(&data, &chain, &real);
        assert_eq!(found.is_some(), is_tested, "{output:?}");
    }
}

/// n modes have 3 n + 2 parameters with real residues, and 4 n + 1 with complex ones, whose delay is fixed. 2 N chi^2 + k ln 2N, and 25 with more
/// parameters.
#[test]
fn a_fit_is_clearly_better_by_chi_square_and_number_of_parameters() {
    let complex = with_complex(&data(&CNMP, 7));
    assert_eq!(complex.parameters.modes.len(), 3);
    let real = |modes: usize, chi2_per_freedom| {
        let mut fit = complex.clone();
        let mode = fit.parameters.modes[0];
        fit.parameters = ModalParameters {
            modes: vec![mode; modes],
            ..ModalParameters::default()
        };
        fit.chi2_per_freedom = chi2_per_freedom;
        fit
    };
    let is_better = |other: &ModalFit| is_clearly_better(&complex, other, 500);
    // 13 parameters against 11 of three modes, and 14 to 17 of four and five, with ln 1000 = 6.908 each.
    let chi2 = complex.chi2_per_freedom;
    for (modes, chi2_more) in [
        (3, 0.025 + 2.0 * 0.006908),
        (4, -0.006908),
        (5, -4.0 * 0.006908),
    ] {
        assert!(!is_better(&real(modes, chi2 + chi2_more - 1e-5)), "{modes}");
        assert!(is_better(&real(modes, chi2 + chi2_more + 1e-5)), "{modes}");
    }
}

/// Real modes in the place of complex residues describe the data if one of them is heavily damped.
#[test]
fn heavily_damped_real_modes_are_compared_with_complex_residues() {
    let data = data(&CNMP, 8);
    let of_others = fit(&data_of_real_modes(), &MeasurementChain::Direct).expect("modes");
    assert_eq!(of_others.parameters.modes.len(), 4);
    for (damping_ratio, is_compared) in
        [(0.5 * MAX_DAMPING_RATIO, false), (MAX_DAMPING_RATIO, true)]
    {
        let mut real = of_others.clone();
        real.parameters.modes[0].damping_ratio = damping_ratio;
        let found = fit_complex(&data, &MeasurementChain::Direct, &Ok(real));
        assert_eq!(found.is_some(), is_compared, "{damping_ratio}");
    }
}

/// Four modes far apart.
fn data_of_real_modes() -> Vec<FrfDatum> {
    let mut data = data(&CMP.without_damper(), 9);
    for datum in &mut data {
        let s = Complex::new(0.0, TAU * datum.frequency_hz);
        let w = TAU * 100.0;
        datum.response += (s * s + s * (0.02 * w) + w * w).inv();
    }
    data
}

const RATE_HZ: f64 = 500.0;

/// Rest of 0.5 s, a logarithmic sweep from 4 to 130 Hz in 20 s, and rest until the stage has settled.
fn sweep() -> Vec<f64> {
    let rate = 32.5_f64.ln() / 20.0;
    let at = |k: usize| {
        let time_s = k as f64 / RATE_HZ - 0.5;
        let inside = (0.0..20.0).contains(&time_s);
        let fade = (time_s.min(20.0 - time_s) / 0.3).clamp(0.0, 1.0);
        let phase = TAU * 4.0 / rate * ((rate * time_s).exp() - 1.0);
        if inside { fade * phase.sin() } else { 0.0 }
    };
    (0..14_000).map(at).collect()
}

/// The samples of the output by a held input, with white noise.
fn output(stage: &Stage, input: &[f64], noise: f64, seed: u64) -> Vec<f64> {
    let mut outputs = Stage::white_noise(input.len(), noise, seed);
    for (pole, rho) in stage.partial_fractions() {
        let e = (pole / RATE_HZ).exp();
        let mut x = Complex::new(0.0, 0.0);
        for (output, force) in outputs.iter_mut().zip(input) {
            *output += 2.0 * (rho * x).re;
            x = e * x + (e - 1.0) / pole * *force;
        }
    }
    outputs
}

#[test]
fn a_record_of_a_stage_with_one_damper_has_its_modes_and_its_verdict() {
    let input = sweep();
    for (stage, cnmp) in [(CNMP, Cnmp::Detected), (CMP, Cnmp::Excluded)] {
        for (seed, is_complex) in [(31, true), (32, false)] {
            let stage = if is_complex {
                stage
            } else {
                stage.without_damper()
            };
            let output = output(&stage, &input, 1e-8, seed);
            let identification = Identification::new(RATE_HZ).held_s(1.0 / RATE_HZ);
            let found = identification.run(&input, &output).expect("a response");
            assert_eq!(found.verdict.cnmp, cnmp, "{}", found.verdict.why);
            assert_eq!(found.clock_skew, None);
            let fit = found.fit.expect("modes");
            assert_eq!(fit.parameters.has_real_residues(), !is_complex);
            assert_modes(&fit, &stage);
        }
    }
}
