//! Proof that a cascade has the response of the transfer function from which it was made.

use nalgebra::Complex;

use super::domain::Domain;
use super::error::TransferError;
use super::frequencies::frequencies;
use super::given::{Given, Located};
use crate::control::Section;
use crate::util::numeric::is_within;

/// Relative difference that is refused in any case: a millionth is 0.00001 dB or 0.00006 degrees.
const MAX_DIFFERENCE: f64 = 1e-6;

/// Roundings of a coefficient of a section, each of half a unit in the last place: of the root, of the product or sum of two, of
/// the gain; those of the evaluation, two for each power; and as many of the original. 16 is above their number.
const ROUNDINGS: f64 = 16.0;

/// The bounds of rounding are of first order and leave out the gain, which is taken from one frequency.
const MARGIN: f64 = 4.0;

/// The largest relative difference of the responses of a cascade and of its original.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// |cascade/original - 1|.
    pub difference: f64,
    /// The frequency in rad/s.
    pub rad_s: f64,
}

/// Compares the cascade, whose gain is `unit` times that of the original, over all frequencies.
///
/// # Errors
/// At a frequency the difference exceeds what rounding explains (of the coefficients of the sections, of the matrices, and of a
/// pole that was moved to the place of an integrator), or a millionth.
pub(super) fn agreement(
    given: &Given,
    located: &Located,
    sections: &[Section],
    unit: f64,
    domain: Domain,
) -> Result<Agreement, TransferError> {
    let mut worst = Agreement::default();
    for rad_s in frequencies(&located.factors, domain) {
        let v = domain.point(rad_s);
        let original = given.response(v);
        let cascade: Complex<f64> = sections.iter().map(|section| section.response(v)).product();
        let difference = (cascade / (original.value * unit) - 1.0).norm();
        let moved = located.integrator_shift / (v - domain.integrator()).norm();
        let bound = original.relative_error + moved + rounding(sections, v);
        let limit = (MARGIN * bound).min(MAX_DIFFERENCE);
        if !is_within(difference, limit) {
            return Err(TransferError::Inexact {
                rad_s,
                difference,
                limit,
            });
        }
        if difference >= worst.difference {
            worst = Agreement { difference, rad_s };
        }
    }
    Ok(worst)
}

/// Relative error of the response of the cascade because its coefficients are rounded: the sum over all polynomials of
/// sum |c_i| |v|^i/|p(v)| (Higham, *Accuracy and Stability of Numerical Algorithms*, section 5.1), in roundings.
fn rounding(sections: &[Section], v: Complex<f64>) -> f64 {
    let condition =
        |section: &Section| condition(&section.numerator, v) + condition(&section.denominator, v);
    let sum: f64 = sections.iter().map(condition).sum();
    ROUNDINGS * f64::EPSILON * sum
}

fn condition([c0, c1, c2]: &[f64; 3], v: Complex<f64>) -> f64 {
    let radius = v.norm();
    let magnitude = (c2.abs() * radius + c1.abs()) * radius + c0.abs();
    magnitude / ((v * *c2 + *c1) * v + *c0).norm()
}
