//! Proof that a cascade has the response of the transfer function from which it was made.

use nalgebra::Complex;

use super::domain::Domain;
use super::error::{Inexact, RootPlace, TransferError};
use super::frequencies::frequencies;
use super::given::Given;
use super::roots::Factors;
use crate::Section;
use bench_base::numeric::is_within;
use bench_base::units::hz;

/// Largest difference of the responses, relative to the largest magnitude of the original: a millionth is 0.00001 dB or 0.00006 degrees.
const MAX_DIFFERENCE: f64 = 1e-6;

/// The largest difference of the responses of a cascade and of its original.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// |cascade - original| over the largest |original| from a tenth of the slowest pole to half the rate.
    pub difference: f64,
    /// The frequency in rad/s.
    pub rad_s: f64,
}

/// Both responses in amperes per micrometre at a frequency.
struct Compared {
    rad_s: f64,
    given: Complex<f64>,
    sections: Complex<f64>,
}

/// Compares the cascade, whose gain is `unit` times that of the original, from a tenth of its slowest pole to half the rate.
///
/// # Errors
/// The difference exceeds a millionth of the largest magnitude of the original.
pub(super) fn agreement(
    given: &Given,
    factors: &Factors,
    sections: &[Section],
    unit: f64,
    domain: Domain,
) -> Result<Agreement, TransferError> {
    let frequencies = frequencies(factors, domain).into_iter();
    let compared = frequencies.map(|rad_s| Compared::at(rad_s, given, sections, unit, domain));
    let compared: Vec<Compared> = compared.collect();
    let magnitudes = compared.iter().map(|point| point.given.norm());
    let largest = magnitudes.fold(0.0, f64::max);
    let mut worst = Agreement::default();
    for point in &compared {
        let difference = (point.sections - point.given).norm() / largest;
        if !is_within(difference, MAX_DIFFERENCE) {
            return Err(point.refused(difference, factors, domain));
        }
        if difference >= worst.difference {
            let rad_s = point.rad_s;
            worst = Agreement { difference, rad_s };
        }
    }
    Ok(worst)
}

impl Compared {
    fn at(rad_s: f64, given: &Given, sections: &[Section], unit: f64, domain: Domain) -> Compared {
        let v = domain.point(rad_s);
        let responses = sections.iter().map(|section| section.response(v));
        Compared {
            rad_s,
            given: given.response(v) * unit,
            sections: responses.product(),
        }
    }

    fn refused(&self, difference: f64, factors: &Factors, domain: Domain) -> TransferError {
        let v = domain.point(self.rad_s);
        let distance = |pole: &Complex<f64>| (pole - v).norm();
        let poles = factors.poles.all();
        let nearest = poles.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        TransferError::Inexact(Box::new(Inexact {
            hz: hz(self.rad_s),
            rad_s: self.rad_s,
            given: self.given,
            sections: self.sections,
            difference,
            limit: MAX_DIFFERENCE,
            pole: nearest.map(|pole| RootPlace::of(pole, domain)),
        }))
    }
}
