//! Whether the sections have every zero and pole on the same side of the stability boundary as the transfer function.

use nalgebra::Complex;

use super::domain::Domain;
use super::error::{RootPlace, TransferError};
use super::roots::{Factors, Roots};
use crate::Section;
use crate::quadratic::quadratic_roots;

/// Relative distance from the boundary below which the side of a zero has no meaning: double zeros at z = -1, as Tustin's rule gives
/// them, are spread by the square root of the rounding of their coefficients.
const ON_BOUNDARY: f64 = 1e-7;

/// Largest distance of an integrator from its place in a section that it shares with another real pole.
const INTEGRATOR_ROUNDING: f64 = 1e-12;

/// # Errors
/// A pole of a section that is not stable, or a zero on the other side of the boundary.
pub(super) fn check_sides(
    factors: &Factors,
    sections: &[Section],
    domain: Domain,
) -> Result<(), TransferError> {
    let poles = sections.iter().flat_map(Section::poles);
    for pole in poles {
        let is_integrator = (pole - domain.integrator()).norm() <= INTEGRATOR_ROUNDING;
        if !is_integrator && !domain.is_stable(pole) {
            return Err(crossed("pole", &factors.poles, pole, domain));
        }
    }
    let zeros = sections.iter().flat_map(zeros);
    match zeros
        .into_iter()
        .find(|zero| has_crossed(&factors.zeros, *zero, domain))
    {
        Some(zero) => Err(crossed("zero", &factors.zeros, zero, domain)),
        None => Ok(()),
    }
}

fn zeros(section: &Section) -> Vec<Complex<f64>> {
    match section.numerator {
        [_, 0.0, 0.0] => Vec::new(),
        [c0, c1, 0.0] => vec![Complex::new(-c0 / c1, 0.0)],
        [c0, c1, c2] => quadratic_roots(c2, c1, c0).to_vec(),
    }
}

fn has_crossed(given: &Roots, zero: Complex<f64>, domain: Domain) -> bool {
    let (before, after) = (depth(nearest(given, zero), domain), depth(zero, domain));
    before.abs().min(after.abs()) > ON_BOUNDARY && before * after < 0.0
}

/// The distance from the boundary relative to the size of the root, negative where a pole is stable.
fn depth(root: Complex<f64>, domain: Domain) -> f64 {
    match domain {
        Domain::Continuous => root.re / root.norm().max(f64::MIN_POSITIVE),
        Domain::Discrete { .. } => root.norm() - 1.0,
    }
}

fn nearest(given: &Roots, root: Complex<f64>) -> Complex<f64> {
    let distance = |other: &Complex<f64>| (other - root).norm();
    let nearest = given
        .all()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.unwrap_or(root)
}

fn crossed(what: &'static str, given: &Roots, to: Complex<f64>, domain: Domain) -> TransferError {
    TransferError::Crossed {
        what,
        from: Box::new(RootPlace::of(nearest(given, to), domain)),
        to: Box::new(RootPlace::of(to, domain)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one_pole(pole: f64, zero: f64) -> (Factors, Section) {
        let real = |root| Roots {
            real: vec![root],
            pairs: Vec::new(),
        };
        let factors = Factors {
            zeros: real(zero),
            poles: real(pole),
            gain: 1.0,
        };
        let section = Section {
            numerator: [-zero, 1.0, 0.0],
            denominator: [-pole, 1.0, 0.0],
            prewarp_rad_s: None,
        };
        (factors, section)
    }

    #[test]
    fn rejects_a_zero_or_pole_on_the_other_side() {
        let domain = Domain::Discrete { rate_hz: 5000.0 };
        let (factors, same) = one_pole(0.9999, 0.999);
        assert_eq!(check_sides(&factors, &[same], domain), Ok(()));
        let (_, pole) = one_pole(1.0001, 0.999);
        let error = check_sides(&factors, &[pole], domain).expect_err("unstable");
        let text = error.to_string();
        assert!(text.contains("pole") && text.contains("1.000100"), "{text}");
        let (_, zero) = one_pole(0.9999, 1.001);
        let error = check_sides(&factors, &[zero], domain).expect_err("crossed");
        assert!(error.to_string().contains("its zero from"), "{error}");
    }
}
