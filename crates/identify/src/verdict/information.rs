//! The quantities whose signs decide a verdict, as linear functions of the parameters of the fit.
//!
//! ```text
//! q(theta) = q + c^T (theta - theta_fit)             q: Re z of a zero, or the residue of a mode
//! ```
//!
//! A quantity is decided when |q| is a certain multiple of its standard deviation sqrt(c^T C c). Only quantities that are not
//! decided yet count.

use nalgebra::DVector;

use super::decisive::decisive_uncertain_mode;
use super::input::{Certainty, VerdictInput};
use super::zeros::{derivatives, zeros};
use super::{UncertainZero, has_certain_side};
use crate::modal::{ModalFit, Parameter};
use bench_plant::PlantError;

/// A quantity whose sign is not certain, and on which the verdict depends.
#[derive(Clone, Debug)]
pub struct DecisiveQuantity {
    /// Its value by the fit: Re z in rad/s, or a residue in 1/kg.
    pub value: f64,
    /// Its derivative by each free parameter, in the order of the covariance.
    pub gradient: DVector<f64>,
    /// Its sign is certain from this multiple of its standard deviation.
    pub quantile: f64,
}

impl DecisiveQuantity {
    /// The real part of a zero.
    pub fn side_of(fit: &ModalFit, zero: &UncertainZero, certainty: Certainty) -> DecisiveQuantity {
        DecisiveQuantity {
            value: zero.s.re,
            gradient: derivatives(fit, zero.s).row(0).transpose(),
            quantile: certainty.quantile(),
        }
    }
}

/// The quantities that are not decided; none if the verdict is certain, or undecided for another reason than noise.
///
/// # Errors
/// When the zeros of the fit cannot be computed.
pub fn decisive_quantities(input: &VerdictInput<'_>) -> Result<Vec<DecisiveQuantity>, PlantError> {
    let mut quantities: Vec<DecisiveQuantity> = zeros(input.fit)?
        .iter()
        .filter(|zero| is_open(input, zero))
        .map(|zero| DecisiveQuantity::side_of(input.fit, zero, input.certainty))
        .collect();
    let mode = decisive_uncertain_mode(input)?;
    quantities.extend(mode.and_then(|k| sign_of(input, k)));
    Ok(quantities)
}

fn is_open(input: &VerdictInput<'_>, zero: &UncertainZero) -> bool {
    zero.s.im != 0.0 && input.covers(zero.s.norm()) && !has_certain_side(zero, input.certainty)
}

/// The residue of a mode.
fn sign_of(input: &VerdictInput<'_>, mode: usize) -> Option<DecisiveQuantity> {
    let parameters = &input.fit.parameters;
    let free = parameters.free();
    let index = free
        .iter()
        .position(|parameter| *parameter == Parameter::Residue(mode))?;
    let mut gradient = DVector::zeros(free.len());
    gradient[index] = 1.0;
    Some(DecisiveQuantity {
        value: parameters.modes[mode].residue_per_kg,
        gradient,
        quantile: input.certainty.quantile(),
    })
}
