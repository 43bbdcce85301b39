//! The residual of a fit as its noise.
//!
//! ```text
//! E|e_k|^2 = s_k v_k (1 - h_k),   h_k = J_k C J_k^H/v_k          v: variance by the estimator, C: covariance of the fit, J = dH/dtheta
//! s_k = mean of |e|^2 over mean of v (1 - h), around datum k
//! ```
//!
//! The parameters take a part h of the noise of each datum, most of it at the resonances. The noise itself is high there: what excites
//! the stage beside the input, such as the vibration of the floor, passes through the same modes. The mean is therefore taken over no
//! more than the distance to the nearest pole.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};

use super::merge::nearest_pole_rad_s;
use super::modal_fit::ModalFit;
use super::solution::Problem;
use crate::identify::FrfDatum;

/// Largest number of data to either side over which the noise is averaged: 64 degrees of freedom a side.
const MAX_REACH: usize = 32;
/// Smallest number: 34 degrees of freedom in all, a standard deviation of 12 % of each s in sigma.
const MIN_REACH: usize = 8;
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
    let expected = data.iter().zip(&sensitivities).map(|(datum, derivatives)| {
        let taken = explained(derivatives, &fit.covariance) / datum.variance;
        (1.0 - taken).max(MIN_FREEDOM)
    });
    let expected: Vec<f64> = expected.collect();
    let ratio: Vec<f64> = residual
        .iter()
        .zip(data)
        .map(|(e, datum)| e.norm_sqr() / datum.variance)
        .collect();
    let around = |b: usize| {
        let reach = reach(data, b, fit);
        let range = b.saturating_sub(reach)..(b + reach + 1).min(data.len());
        ratio[range.clone()].iter().sum::<f64>() / expected[range].iter().sum::<f64>()
    };
    let data = data.iter().enumerate();
    data.map(|(b, datum)| FrfDatum {
        variance: datum.variance * around(b),
        ..*datum
    })
    .collect()
}

/// J C J^H: the part of the variance of a datum that the parameters explain.
fn explained(derivatives: &DVector<Complex<f64>>, covariance: &DMatrix<f64>) -> f64 {
    let parts = [derivatives.map(|z| z.re), derivatives.map(|z| z.im)];
    let parts = parts.iter().map(|part| part.dot(&(covariance * part)));
    parts.sum()
}

/// Number of data to either side that are nearer than the nearest pole.
fn reach(data: &[FrfDatum], b: usize, fit: &ModalFit) -> usize {
    let hz = data[b].frequency_hz;
    let distance_hz = nearest_pole_rad_s(&data[b], &fit.parameters) / TAU;
    let low = data.partition_point(|datum| datum.frequency_hz < hz - distance_hz);
    let high = data.partition_point(|datum| datum.frequency_hz <= hz + distance_hz);
    (b - low).min(high - 1 - b).clamp(MIN_REACH, MAX_REACH)
}
