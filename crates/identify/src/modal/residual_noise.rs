//! The residual of a fit as its noise.
//!
//! ```text
//! E|e_k|^2 = (1 - h_k) v_k (a + b |H_k|^2),   h_k = J_k C J_k^H/v_k
//! ```
//!
//! with the variance v by the estimator, the response H of the fit, J = dH/dtheta and the covariance C of the fit. The parameters
//! take a part h of the noise of each datum, most of it at the resonances, where the noise itself is high ([`NoiseParts`]). The estimator
//! averages the noise over frequency, but divides it by the power of the input at each datum. a and b are those of the data around.

use nalgebra::{Complex, DMatrix, DVector};

use super::modal_fit::ModalFit;
use super::solution::Problem;
use crate::{FrfDatum, NoiseParts, PowerDatum};

/// Number of data to either side from which a and b are estimated: 64 degrees of freedom a side.
const REACH: usize = 32;
/// Smallest part of the noise of a datum that counts as left by the parameters.
const MIN_FREEDOM: f64 = 0.2;

/// The data with the residual as their noise.
pub(super) fn with_residual_noise(
    problem: Problem<'_>,
    fit: &ModalFit,
    residual: &[Complex<f64>],
) -> Vec<FrfDatum> {
    let data = problem.data;
    let frequency_hz: Vec<f64> = data.iter().map(|datum| datum.frequency_hz).collect();
    let sensitivities = fit.sensitivities(problem.chain, &frequency_hz);
    let gain2: Vec<f64> = fit
        .response(problem.chain, &frequency_hz)
        .iter()
        .map(Complex::norm_sqr)
        .collect();
    let powers: Vec<PowerDatum> = (0..data.len())
        .map(|k| {
            let variance = data[k].variance;
            let freedom = 1.0 - explained(&sensitivities[k], &fit.covariance) / variance;
            let freedom = freedom.max(MIN_FREEDOM);
            PowerDatum {
                power: residual[k].norm_sqr(),
                of_probe: freedom * variance,
                of_plant: freedom * variance * gain2[k],
            }
        })
        .collect();
    let data = data.iter().enumerate();
    data.map(|(k, datum)| {
        let around = k.saturating_sub(REACH)..(k + REACH + 1).min(powers.len());
        let parts = NoiseParts::of(&powers[around]);
        FrfDatum {
            variance: datum.variance * parts.power(1.0, gain2[k]),
            ..*datum
        }
    })
    .collect()
}

/// J C J^H: the part of the variance of a datum that the parameters explain.
fn explained(derivatives: &DVector<Complex<f64>>, covariance: &DMatrix<f64>) -> f64 {
    let parts = [derivatives.map(|z| z.re), derivatives.map(|z| z.im)];
    let parts = parts.iter().map(|part| part.dot(&(covariance * part)));
    parts.sum()
}
