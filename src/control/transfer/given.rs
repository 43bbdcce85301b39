//! A transfer function as it was given: checked, with its factors and its response.

use nalgebra::{Complex, DMatrix};

use super::domain::Domain;
use super::error::{TransferError, UnstablePole};
use super::frequencies::frequencies;
use super::matrices::Matrices;
use super::polynomial::Polynomial;
use super::roots::{Factors, Roots};
use super::settings::{SsSettings, TfSettings, TransferSettings, ZpkSettings};
use crate::control::state_space::StateSpace;

/// Largest order. Matrices beyond it would take seconds to check.
const MAX_ORDER: usize = 32;

/// Largest distance of a discrete integrator from z = 1, a time constant of a million periods. A pole farther away is a slow one,
/// even if rounding could have moved it that far.
const INTEGRATOR_DISTANCE: f64 = 1e-6;

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

/// The factors of a transfer function.
#[derive(Clone, Debug)]
pub(super) struct Located {
    pub factors: Factors,
    /// Distance by which a pole was moved to the place of an integrator, because rounding had moved it away.
    pub integrator_shift: f64,
}

/// A response, and a bound of the relative error with which its factors can be known. It is 0 of `[tf]` and `[zpk]`, because their
/// roots are those of the numbers as given.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response {
    pub value: Complex<f64>,
    pub relative_error: f64,
}

impl Given {
    pub fn of(settings: &TransferSettings) -> Result<Given, TransferError> {
        match settings {
            TransferSettings::Tf(tf) => polynomials(tf),
            TransferSettings::Zpk(zpk) => Ok(Given::Factors(factors(zpk)?)),
            TransferSettings::Ss(ss) => Ok(Given::Matrices(matrices(ss)?)),
        }
    }

    /// Zeros, poles and gain of a proper and stable transfer function.
    pub fn located(&self, domain: Domain) -> Result<Located, TransferError> {
        let located = match self {
            Given::Polynomials(numerator, denominator) => {
                located_of_polynomials(numerator, denominator, domain)?
            }
            Given::Factors(factors) => Located {
                factors: factors.clone(),
                integrator_shift: 0.0,
            },
            Given::Matrices(matrices) => located_of_matrices(matrices, domain)?,
        };
        check_order(&located.factors)?;
        check_stability(&located.factors.poles, domain)?;
        Ok(located)
    }

    /// The response at a point of the s or z plane.
    pub fn response(&self, v: Complex<f64>) -> Response {
        let exact = |value| Response {
            value,
            relative_error: 0.0,
        };
        match self {
            Given::Polynomials(numerator, denominator) => {
                exact(numerator.value(v) / denominator.value(v))
            }
            Given::Factors(factors) => exact(factors.response(v)),
            Given::Matrices(matrices) => {
                let (value, relative_error) = matrices.response(v);
                Response {
                    value,
                    relative_error,
                }
            }
        }
    }
}

fn polynomials(tf: &TfSettings) -> Result<Given, TransferError> {
    check_finite("tf.numerator", &tf.numerator)?;
    check_finite("tf.denominator", &tf.denominator)?;
    let polynomial =
        |key, falling: &[f64]| Polynomial::new(falling).ok_or(TransferError::Zero { key });
    let numerator = polynomial("tf.numerator", &tf.numerator)?;
    let denominator = polynomial("tf.denominator", &tf.denominator)?;
    check_proper(numerator.order(), denominator.order())?;
    Ok(Given::Polynomials(numerator, denominator))
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

fn matrices(ss: &SsSettings) -> Result<Matrices, TransferError> {
    let states = ss.a.len();
    let rows = ss.a.iter().map(|row| ("ss.a", row.as_slice()));
    let vectors = [("ss.b", ss.b.as_slice()), ("ss.c", ss.c.as_slice())];
    for (key, numbers) in rows.chain(vectors) {
        check_finite(key, numbers)?;
        if numbers.len() != states {
            let given = numbers.len();
            return Err(TransferError::Size { key, given, states });
        }
    }
    check_finite("ss.d", &[ss.d])?;
    if states > MAX_ORDER {
        return Err(too_large(states));
    }
    Ok(Matrices::new(&StateSpace {
        a: DMatrix::from_row_iterator(states, states, ss.a.iter().flatten().copied()),
        b: DMatrix::from_column_slice(states, 1, &ss.b),
        c: DMatrix::from_row_slice(1, states, &ss.c),
        d: ss.d,
    }))
}

fn located_of_polynomials(
    numerator: &Polynomial,
    denominator: &Polynomial,
    domain: Domain,
) -> Result<Located, TransferError> {
    if denominator.order() > MAX_ORDER {
        return Err(too_large(denominator.order()));
    }
    let zeros = numerator.roots().ok_or(no_roots("zeros"))?;
    let mut poles = denominator.roots().ok_or(no_roots("poles"))?;
    let integrator = Complex::new(domain.integrator(), 0.0);
    let integrator_shift = poles.snap(integrator.re, |found| {
        (found - integrator.re).abs() < INTEGRATOR_DISTANCE
            && denominator.is_root_by_rounding(integrator)
    });
    let gain = numerator.leading() / denominator.leading();
    Ok(Located {
        factors: Factors { zeros, poles, gain },
        integrator_shift,
    })
}

fn located_of_matrices(matrices: &Matrices, domain: Domain) -> Result<Located, TransferError> {
    let mut poles = matrices.poles().ok_or(no_roots("poles"))?;
    let integrator = domain.integrator();
    let integrator_shift = poles.snap(integrator, |found| {
        matrices.is_eigenvalue(integrator, found)
    });
    let zeros = matrices.zeros().ok_or(TransferError::NoResponse)?;
    let unit = Factors {
        zeros,
        poles,
        gain: 1.0,
    };
    let gain = gain_of_matrices(matrices, &unit, domain);
    Ok(Located {
        factors: Factors { gain, ..unit },
        integrator_shift,
    })
}

/// The gain that makes the factors equal to the response, at the frequency at which the response is known best.
fn gain_of_matrices(matrices: &Matrices, unit: &Factors, domain: Domain) -> f64 {
    let best = frequencies(unit, domain)
        .into_iter()
        .map(|omega_rad_s| {
            let v = domain.point(omega_rad_s);
            let (value, error) = matrices.response(v);
            (error, (value / unit.response(v)).re)
        })
        .filter(|(error, gain)| error.is_finite() && gain.is_finite())
        .min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or(0.0, |(_, gain)| gain)
}

fn check_finite(key: &'static str, numbers: &[f64]) -> Result<(), TransferError> {
    match numbers.iter().find(|x| !x.is_finite()) {
        Some(value) => Err(TransferError::NotFinite { key, value: *value }),
        None => Ok(()),
    }
}

fn check_proper(zeros: usize, poles: usize) -> Result<(), TransferError> {
    match zeros > poles {
        true => Err(TransferError::Improper { zeros, poles }),
        false => Ok(()),
    }
}

fn check_order(factors: &Factors) -> Result<(), TransferError> {
    check_proper(factors.zeros.count(), factors.poles.count())?;
    match factors.poles.count() {
        order if order > MAX_ORDER => Err(too_large(order)),
        _ => Ok(()),
    }
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

/// Refuses a pole that is not stable. One integrator is allowed.
fn check_stability(poles: &Roots, domain: Domain) -> Result<(), TransferError> {
    let integrator = Complex::new(domain.integrator(), 0.0);
    let mut integrators = 0;
    let is_refused = |pole: &Complex<f64>| {
        if *pole == integrator {
            integrators += 1;
            return integrators > 1;
        }
        !domain.is_stable(*pole)
    };
    match poles.all().find(is_refused) {
        Some(pole) => Err(TransferError::Unstable {
            pole: UnstablePole {
                re: pole.re,
                im: pole.im,
                discrete: domain != Domain::Continuous,
            },
        }),
        None => Ok(()),
    }
}
