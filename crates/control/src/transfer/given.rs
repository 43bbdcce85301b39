//! A transfer function as it was given: checked, with its factors and its response.

use nalgebra::{Complex, DMatrix};

use super::domain::Domain;
use super::error::{RootPlace, TransferError};
use super::frequencies::frequencies;
use super::matrices::Matrices;
use super::polynomial::Polynomial;
use super::roots::{Factors, Roots};
use super::settings::{SsSettings, TfSettings, TransferSettings, ZpkSettings};
use crate::state_space::StateSpace;
use crate::unstable::MAX_INTEGRATORS;

/// Largest order. Matrices beyond it would take seconds to check.
const MAX_ORDER: usize = 32;

/// Largest distance of an integrator from its place in the z plane: a time constant of a million periods. A pole farther away is a slow
/// one, even if rounding could have moved it that far. Of two equal poles rounding moves each by the square root.
const INTEGRATOR_DISTANCE: [f64; MAX_INTEGRATORS] = [1e-6, 1e-4];

/// An unstable pole nearer than this to z = 1 was most likely meant as an integrator: 5 rad/s at 5 kHz.
const BESIDE_INTEGRATOR: f64 = 1e-3;

/// A transfer function in one of its forms, with finite numbers and consistent sizes.
#[derive(Clone, Debug)]
pub(super) enum Given {
    /// Numerator and denominator.
    Polynomials(Polynomial, Polynomial),
    /// Zeros, poles and gain.
    Factors(Factors),
    /// A, B, C, D.
    Matrices(Matrices),
}

impl Given {
    pub fn of(settings: &TransferSettings) -> Result<Given, TransferError> {
        match settings {
            TransferSettings::Tf(tf) => polynomials(tf),
            TransferSettings::Zpk(zpk) => Ok(Given::Factors(factors(zpk)?)),
            TransferSettings::Ss(ss) => of_matrices(ss),
        }
    }

    /// Zeros, poles and gain. Where rounding may have moved integrators from their place, several possibilities: the one with most
    /// integrators first, the poles exactly as they are given last.
    pub fn located(&self, domain: Domain) -> Result<Vec<Factors>, TransferError> {
        match self {
            Given::Polynomials(numerator, denominator) => {
                located_of_polynomials(numerator, denominator, domain)
            }
            Given::Factors(factors) => Ok(vec![factors.clone()]),
            Given::Matrices(matrices) => located_of_matrices(matrices, domain),
        }
    }

    /// The response at a point of the s or z plane.
    pub fn response(&self, v: Complex<f64>) -> Complex<f64> {
        match self {
            Given::Polynomials(numerator, denominator) => numerator.value(v) / denominator.value(v),
            Given::Factors(factors) => factors.response(v),
            Given::Matrices(matrices) => matrices.exact_response(v),
        }
    }
}

fn polynomials(tf: &TfSettings) -> Result<Given, TransferError> {
    let (numerator, denominator) = polynomials_of(
        "tf.numerator",
        &tf.numerator,
        "tf.denominator",
        &tf.denominator,
    )?;
    check_proper(numerator.order(), denominator.order())?;
    Ok(Given::Polynomials(numerator, denominator))
}

fn polynomials_of(
    above: &'static str,
    numerator: &[f64],
    below: &'static str,
    denominator: &[f64],
) -> Result<(Polynomial, Polynomial), TransferError> {
    let polynomial = |key, falling: &[f64]| {
        check_finite(key, falling)?;
        Polynomial::new(falling).ok_or(TransferError::Zero { key })
    };
    Ok((
        polynomial(above, numerator)?,
        polynomial(below, denominator)?,
    ))
}

fn factors(zpk: &ZpkSettings) -> Result<Factors, TransferError> {
    check_finite("zpk.zeros", zpk.zeros.as_flattened())?;
    check_finite("zpk.poles", zpk.poles.as_flattened())?;
    check_finite("zpk.gain", &[zpk.gain])?;
    if zpk.gain == 0.0 {
        return Err(TransferError::NoResponse);
    }
    check_proper(zpk.zeros.len(), zpk.poles.len())?;
    Ok(Factors {
        zeros: roots("zpk.zeros", &zpk.zeros)?,
        poles: roots("zpk.poles", &zpk.poles)?,
        gain: zpk.gain,
    })
}

fn roots(key: &'static str, list: &[[f64; 2]]) -> Result<Roots, TransferError> {
    let list: Vec<Complex<f64>> = list.iter().map(|[re, im]| Complex::new(*re, *im)).collect();
    Roots::from_list(&list).map_err(|alone| TransferError::NoConjugate {
        key,
        re: alone.re,
        im: alone.im,
    })
}

fn of_matrices(ss: &SsSettings) -> Result<Given, TransferError> {
    check_sizes(ss)?;
    let states = ss.a.len();
    if states > MAX_ORDER {
        return Err(too_large(states));
    }
    if states == 0 {
        return static_gain(ss.d);
    }
    Ok(Given::Matrices(Matrices::new(&StateSpace {
        a: DMatrix::from_row_iterator(states, states, ss.a.iter().flatten().copied()),
        b: DMatrix::from_column_slice(states, 1, &ss.b),
        c: DMatrix::from_row_slice(1, states, &ss.c),
        d: ss.d,
    })))
}

fn check_sizes(ss: &SsSettings) -> Result<(), TransferError> {
    let states = ss.a.len();
    for (row, numbers) in (1..).zip(&ss.a) {
        check_finite("ss.a", numbers)?;
        if numbers.len() != states {
            let given = numbers.len();
            return Err(TransferError::NotSquare { row, given, states });
        }
    }
    for (key, numbers) in [("ss.b", &ss.b), ("ss.c", &ss.c)] {
        check_finite(key, numbers)?;
        if numbers.len() != states {
            let given = numbers.len();
            return Err(TransferError::Size { key, given, states });
        }
    }
    check_finite("ss.d", &[ss.d])
}

/// Matrices without states: u = D e.
fn static_gain(gain: f64) -> Result<Given, TransferError> {
    if gain == 0.0 {
        return Err(TransferError::NoResponse);
    }
    Ok(Given::Factors(Factors {
        zeros: Roots::default(),
        poles: Roots::default(),
        gain,
    }))
}

fn located_of_polynomials(
    numerator: &Polynomial,
    denominator: &Polynomial,
    domain: Domain,
) -> Result<Vec<Factors>, TransferError> {
    if denominator.order() > MAX_ORDER {
        return Err(too_large(denominator.order()));
    }
    let factors = Factors {
        zeros: numerator.roots().ok_or(no_roots("zeros"))?,
        poles: denominator.roots().ok_or(no_roots("poles"))?,
        gain: numerator.leading() / denominator.leading(),
    };
    let place = Complex::new(domain.integrator(), 0.0);
    let multiplicity = denominator.multiplicity_by_rounding(place, MAX_INTEGRATORS);
    let distances = factors.poles.distances(domain.integrator());
    let is_near = |count: &usize| {
        let limit = INTEGRATOR_DISTANCE.get(count - 1);
        let farthest = distances.get(count - 1);
        farthest.zip(limit).is_some_and(|(far, limit)| far < limit)
    };
    let counts: Vec<usize> = (1..=multiplicity).rev().filter(is_near).collect();
    Ok(with_integrators(factors, &counts, domain))
}

/// The factors with so many integrators, and at last as they are.
fn with_integrators(factors: Factors, counts: &[usize], domain: Domain) -> Vec<Factors> {
    let snapped = |count: &usize| {
        let mut snapped = factors.clone();
        snapped.poles.snap(domain.integrator(), *count);
        snapped
    };
    let mut possible: Vec<Factors> = counts.iter().map(snapped).collect();
    possible.push(factors);
    possible
}

fn located_of_matrices(matrices: &Matrices, domain: Domain) -> Result<Vec<Factors>, TransferError> {
    let unit = Factors {
        zeros: matrices.zeros().ok_or(TransferError::NoResponse)?,
        poles: matrices.poles().ok_or(no_roots("poles"))?,
        gain: 1.0,
    };
    let counts = matrices.integrators(domain.integrator(), &unit.poles);
    let possible = with_integrators(unit, &counts, domain).into_iter();
    let scaled = possible.map(|factors| Factors {
        gain: gain_of_matrices(matrices, &factors, domain),
        ..factors
    });
    Ok(scaled.collect())
}

/// The product of ratios of two polynomials (by falling powers of s or z) as zeros, poles and gain.
///
/// # Errors
/// Numbers that are not finite, a polynomial that is 0, roots that cannot be computed.
pub(crate) fn factors_of_rows(
    rows: &[(Vec<f64>, Vec<f64>)],
    domain: Domain,
) -> Result<Factors, TransferError> {
    let mut product = Factors {
        zeros: Roots::default(),
        poles: Roots::default(),
        gain: 1.0,
    };
    for (numerator, denominator) in rows {
        let row = factors_of_row(numerator, denominator, domain)?;
        product.zeros.append(row.zeros);
        product.poles.append(row.poles);
        product.gain *= row.gain;
    }
    Ok(product)
}

fn factors_of_row(
    numerator: &[f64],
    denominator: &[f64],
    domain: Domain,
) -> Result<Factors, TransferError> {
    let (numerator, denominator) = polynomials_of("sos", numerator, "sos", denominator)?;
    let possible = located_of_polynomials(&numerator, &denominator, domain)?;
    possible.into_iter().next().ok_or(no_roots("poles"))
}

/// The gain that makes the factors equal to the response, at the frequency at which the response is known best.
fn gain_of_matrices(matrices: &Matrices, unit: &Factors, domain: Domain) -> f64 {
    let points = frequencies(unit, domain).into_iter();
    let points = points.map(|omega_rad_s| domain.point(omega_rad_s));
    let errors = points.map(|v| (matrices.response(v).1, v));
    let finite = errors.filter(|(error, v)| error.is_finite() && unit.response(*v).norm() > 0.0);
    let best = finite.min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or(0.0, |(_, v)| {
        (matrices.exact_response(v) / unit.response(v)).re
    })
}

fn check_finite(key: &'static str, numbers: &[f64]) -> Result<(), TransferError> {
    match numbers.iter().find(|x| !x.is_finite()) {
        Some(value) => Err(TransferError::NotFinite { key, value: *value }),
        None => Ok(()),
    }
}

fn check_proper(zeros: usize, poles: usize) -> Result<(), TransferError> {
    if zeros > poles {
        Err(TransferError::Improper { zeros, poles })
    } else {
        Ok(())
    }
}

/// Refuses factors that are improper, of too high an order, or not stable.
pub(super) fn check(factors: &Factors, domain: Domain) -> Result<(), TransferError> {
    let order = factors.poles.count();
    check_proper(factors.zeros.count(), order)?;
    if order > MAX_ORDER {
        return Err(too_large(order));
    }
    check_stability(&factors.poles, domain)
}

fn too_large(order: usize) -> TransferError {
    TransferError::Order {
        order,
        limit: MAX_ORDER,
    }
}

fn no_roots(what: &'static str) -> TransferError {
    TransferError::NoRoots { what }
}

/// Refuses a pole that is not stable, except for integrators.
fn check_stability(poles: &Roots, domain: Domain) -> Result<(), TransferError> {
    let integrator = Complex::new(domain.integrator(), 0.0);
    let count = poles.all().filter(|pole| *pole == integrator).count();
    if count > MAX_INTEGRATORS {
        return Err(TransferError::Integrators {
            count,
            place: match domain {
                Domain::Continuous => "s = 0",
                Domain::Discrete { .. } => "z = 1",
            },
        });
    }
    let mut others = poles.all().filter(|pole| *pole != integrator);
    let Some(pole) = others.find(|pole| !domain.is_stable(*pole)) else {
        return Ok(());
    };
    let place = RootPlace::of(pole, domain);
    Err(if is_beside_integrator(pole, poles, domain) {
        TransferError::NotIntegrator { pole: place }
    } else {
        TransferError::Unstable { pole: place }
    })
}

/// Whether a pole is so near to the place of an integrator that rounding has probably moved it from there: in the s plane compared with
/// the fastest pole.
fn is_beside_integrator(pole: Complex<f64>, poles: &Roots, domain: Domain) -> bool {
    let scale = match domain {
        Domain::Continuous => poles.all().map(|other| other.norm()).fold(0.0, f64::max),
        Domain::Discrete { .. } => 1.0,
    };
    (pole - domain.integrator()).norm() < BESIDE_INTEGRATOR * scale
}
