//! Derivatives of the response by the parameters of a fit.
//!
//! ```text
//! dH/dtheta = P dG/dtheta,  dH/dtau = -s H             s = j w; P: the response of the measurement chain with its delay
//! ```

use std::f64::consts::TAU;

use nalgebra::{Complex, DVector};

use super::measurement_chain::MeasurementChain;
use super::modal_fit::ModalFit;
use super::parameters::{ModalParameters, Parameter};

/// dG/dtheta of the mechanics at any s; zero for the delay, which the mechanics do not have.
pub(crate) fn mechanics_derivative(
    parameters: &ModalParameters,
    parameter: Parameter,
    s: Complex<f64>,
) -> Complex<f64> {
    let modes = &parameters.modes;
    match parameter {
        Parameter::Frequency(k) => {
            let by_frequency = s * (2.0 * modes[k].damping_ratio) + 2.0 * modes[k].omega_rad_s;
            by_denominator(parameters, k, s) * by_frequency
        }
        Parameter::Damping(k) => {
            by_denominator(parameters, k, s) * s * (2.0 * modes[k].omega_rad_s)
        }
        Parameter::Residue(k) => modes[k].resonance(s),
        Parameter::Rate(k) => modes[k].resonance(s) * s,
        Parameter::Remainder => Complex::new(1.0, 0.0),
        Parameter::Delay => Complex::new(0.0, 0.0),
    }
}

/// dG/ds of the mechanics at any s.
pub(crate) fn mechanics_slope(parameters: &ModalParameters, s: Complex<f64>) -> Complex<f64> {
    let modes = parameters.modes.iter().enumerate();
    modes
        .map(|(k, mode)| {
            let by_s = s * 2.0 + 2.0 * mode.damping_ratio * mode.omega_rad_s;
            let of_denominator = by_denominator(parameters, k, s) * by_s;
            of_denominator + mode.resonance(s) * parameters.rate_s_per_kg(k)
        })
        .sum()
}

/// Derivative of a mode's response (r + q s)/(s^2 + 2 zeta w s + w^2) by its denominator.
fn by_denominator(parameters: &ModalParameters, k: usize, s: Complex<f64>) -> Complex<f64> {
    let resonance = parameters.modes[k].resonance(s);
    -resonance * resonance * parameters.numerator(k, s)
}

impl ModalFit {
    /// dH/dtheta at each frequency in hertz, of the free parameters in the order of the covariance. Aliases are neglected: near the mode
    /// of a parameter they change its derivatives by about a thousandth. R, which has no mode, is observed with its aliases.
    pub fn sensitivities(
        &self,
        chain: &MeasurementChain,
        frequency_hz: &[f64],
    ) -> Vec<DVector<Complex<f64>>> {
        let delay_s = self.parameters.delay_s;
        let nodes = chain.nodes_at(frequency_hz, delay_s);
        let stiff = nodes.constant(&nodes.delays(delay_s));
        let response = self.response(chain, frequency_hz);
        let free = self.parameters.free();
        let at = |((f, stiff), response): ((&f64, Complex<f64>), Complex<f64>)| {
            let s = Complex::new(0.0, TAU * f);
            let path = chain.continuous_response(s, delay_s);
            let derivative = |parameter: &Parameter| match parameter {
                Parameter::Delay => -s * response,
                Parameter::Remainder => stiff,
                other => path * mechanics_derivative(&self.parameters, *other, s),
            };
            DVector::from_iterator(free.len(), free.iter().map(derivative))
        };
        let rows = frequency_hz.iter().zip(stiff).zip(response);
        rows.map(at).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::modal::Residues;
    use bench_plant::OutputKind;
    use bench_plant::zeros::ModalTerm;

    /// Two modes through a path with a hold of 1 ms and a delay of 2 ms.
    fn fit() -> (ModalFit, MeasurementChain) {
        let mode = |hz: f64, damping_ratio, residue_per_kg| ModalTerm {
            omega_rad_s: TAU * hz,
            damping_ratio,
            residue_per_kg,
        };
        let parameters = ModalParameters {
            modes: vec![mode(30.0, 0.01, 0.5), mode(80.0, 0.004, -0.03)],
            residues: Residues::Real,
            remainder_m_per_n: 1e-8,
            delay_s: 2e-3,
            has_fixed_delay: false,
        };
        let fit = ModalFit {
            covariance: DMatrix::zeros(8, 8),
            parameters,
            orders: Vec::new(),
            one_more_mode: None,
            chi2_per_freedom: 1.0,
            freedom: 1000,
            band_hz: (1.0, 200.0),
            left_out_hz: Vec::new(),
        };
        let path = crate::modal::InputPath {
            hold_s: 1e-3,
            lag_s: 0.0,
        };
        (fit, MeasurementChain::Input(path, OutputKind::Position))
    }

    /// About the cube root of the rounding, relative to each parameter: w1, zeta1, r1, w2, zeta2, r2, R, tau.
    const STEPS: [f64; 8] = [1e-3, 1e-7, 5e-6, 2e-3, 4e-8, 3e-7, 1e-13, 2e-8];
    /// The same with q1 and q2.
    const COMPLEX_STEPS: [f64; 10] = [1e-3, 1e-7, 5e-6, 1e-8, 2e-3, 4e-8, 3e-7, 6e-10, 1e-13, 2e-8];

    #[test]
    fn equals_the_difference_quotient_of_the_response() {
        let (fit, chain) = fit();
        // The path of R is that of a mode at 1e6 rad/s with damping 1, whose phase at 150 Hz is 2 x 942/1e6 = 1.9e-3; the quotient adds
        // (step/half-width)^2 < 1e-4 at 0.1 Hz from a resonance.
        let frequency_hz = [5.0, 29.9, 31.0, 60.0, 79.9, 150.0];
        assert_difference_quotients(&fit, &chain, &frequency_hz, &STEPS, (0..8, 2e-3));
    }

    #[test]
    fn equals_the_difference_quotient_with_complex_residues() {
        let (mut fit, chain) = fit();
        // r + j q w: 0.5 + 0.19 j and -0.03 - 0.03 j.
        fit.parameters.residues = Residues::Complex(vec![1e-3, -6e-5]);
        let frequency_hz = [5.0, 29.9, 31.0, 60.0, 79.9, 150.0];
        assert_difference_quotients(&fit, &chain, &frequency_hz, &COMPLEX_STEPS, (0..10, 2e-3));
    }

    #[test]
    fn slope_is_the_difference_quotient_over_s() {
        let (mut fit, _) = fit();
        for residues in [Residues::Real, Residues::Complex(vec![1e-3, -6e-5])] {
            fit.parameters.residues = residues;
            let sum = fit.parameters.sum().expect("a sum of modes");
            let s = Complex::new(-3.0, 400.0);
            let step = Complex::new(0.01, 0.0);
            let quotient = (sum.response(s + step) - sum.response(s - step)) / (step * 2.0);
            // (step/distance of the nearest pole of 102 rad/s)^2 = 1e-8, and rounding over the step.
            let error = (mechanics_slope(&fit.parameters, s) - quotient).norm() / quotient.norm();
            assert!(error < 1e-7, "{error}");
        }
    }

    #[test]
    fn equals_the_difference_quotient_near_a_mode_at_042_of_the_rate() {
        let (fit, _) = fit();
        let path = crate::modal::InputPath {
            hold_s: 1.0 / 190.0,
            lag_s: 0.0,
        };
        // The neglected alias of the mode is at 110 Hz, 30 Hz away; the pole at most 0.3 Hz + 0.32 Hz: a ratio of at most 2 %.
        let frequency_hz = [79.7, 79.9, 80.1, 80.3];
        assert_difference_quotients(
            &fit,
            &path.chain(190.0),
            &frequency_hz,
            &STEPS,
            (3..6, 2e-2),
        );
    }

    fn assert_difference_quotients(
        fit: &ModalFit,
        chain: &MeasurementChain,
        frequency_hz: &[f64],
        steps: &[f64],
        (parameters, tolerance): (std::ops::Range<usize>, f64),
    ) {
        let sensitivities = fit.sensitivities(chain, frequency_hz);
        for i in parameters {
            let step = steps[i];
            let moved = |sign: f64| {
                let mut difference = vec![0.0; steps.len()];
                difference[i] = sign * step;
                let parameters = fit.parameters.shifted(&difference);
                let fit = ModalFit {
                    parameters,
                    ..fit.clone()
                };
                fit.response(chain, frequency_hz)
            };
            let quotients = moved(1.0).into_iter().zip(moved(-1.0));
            let quotients = quotients.map(|(up, down)| (up - down) / (2.0 * step));
            for (row, quotient) in sensitivities.iter().zip(quotients) {
                let error = (row[i] - quotient).norm() / quotient.norm();
                assert!(error < tolerance, "parameter {i}: {error}");
            }
        }
    }
}
