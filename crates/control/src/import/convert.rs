//! From the parts of a controller in a file to a table of a controller file.

use nalgebra::DMatrix;

use super::super::transfer::{
    Cascade, Domain, Factors, GainUnit, Roots, SsSettings, TfSettings, TransferSettings,
    ZpkSettings, factors_of_rows,
};
use super::form::{Form, get};
use super::names;
use super::parts::{
    MAX_ORDER, coefficients, optional_scalar, pairs, per_state, rows, scalar, square,
};
use super::properties::{Delay, Variable};
use super::select::Selected;
use super::value::Variables;

/// Largest condition number of E: its solution then has an error of 1e-10 at most.
const MAX_CONDITION: f64 = 1e6;

/// A delay counts as whole samples if it differs from them by less than this.
const SAMPLE_ROUNDING: f64 = 1e-9;

/// The table of a controller, with the numbers as they were saved where no property of the file changes them.
///
/// # Errors
/// What is wrong, and the remedy.
pub(super) fn settings(
    selected: &Selected<'_>,
    gain_unit: GainUnit,
) -> Result<TransferSettings, String> {
    check_variable(selected)?;
    let samples = delay_samples(selected)?;
    let target = Target {
        gain_unit,
        domain: selected.domain,
    };
    let fields = selected.fields;
    let settings = match selected.form {
        Form::Polynomials => polynomials(fields, selected.properties.variable, target)?,
        Form::ScipyPolynomials => scipy_polynomials(fields, target)?,
        Form::Sections => sections(fields, target)?,
        Form::Roots => roots(fields, target)?,
        Form::Matrices => matrices(fields, target)?,
    };
    let settings = match selected.domain {
        Domain::Continuous => in_seconds(settings, selected.properties.time_unit_s),
        Domain::Discrete { .. } => settings,
    };
    delayed(settings, samples, &selected.properties.delays)
}

/// What all tables have.
#[derive(Clone, Copy)]
struct Target {
    gain_unit: GainUnit,
    domain: Domain,
}

impl Target {
    fn rate_hz(self) -> Option<f64> {
        match self.domain {
            Domain::Continuous => None,
            Domain::Discrete { rate_hz } => Some(rate_hz),
        }
    }

    fn tf(self, numerator: Vec<f64>, denominator: Vec<f64>) -> TransferSettings {
        TransferSettings::Tf(TfSettings {
            gain_unit: self.gain_unit,
            rate_hz: self.rate_hz(),
            numerator,
            denominator,
        })
    }

    fn zpk(self, zeros: Vec<[f64; 2]>, poles: Vec<[f64; 2]>, gain: f64) -> TransferSettings {
        TransferSettings::Zpk(ZpkSettings {
            gain_unit: self.gain_unit,
            rate_hz: self.rate_hz(),
            zeros,
            poles,
            gain,
        })
    }

    fn factors(self, factors: &Factors) -> TransferSettings {
        self.zpk(listed(&factors.zeros), listed(&factors.poles), factors.gain)
    }
}

fn listed(roots: &Roots) -> Vec<[f64; 2]> {
    roots.all().map(|root| [root.re, root.im]).collect()
}

/// The variable must be one of the time domain.
fn check_variable(selected: &Selected<'_>) -> Result<(), String> {
    let Some(variable) = selected.properties.variable else {
        return Ok(());
    };
    let is_derivative = variable == Variable::Derivative;
    match (is_derivative, selected.domain) {
        (true, Domain::Continuous) | (false, Domain::Discrete { .. }) => Ok(()),
        (true, _) => Err("`Variable` is that of a continuous controller (s or p), but the sampling period is not 0; save both as they belong together".into()),
        (false, _) => Err("`Variable` is that of a discrete controller (z, q, z^-1 or q^-1), but the sampling period is 0; save both as they belong together".into()),
    }
}

fn polynomials(
    fields: &Variables,
    variable: Option<Variable>,
    target: Target,
) -> Result<TransferSettings, String> {
    let mut numerator = coefficients(fields, names::NUMERATOR)?;
    let mut denominator = coefficients(fields, names::DENOMINATOR)?;
    if variable == Some(Variable::Delay) {
        // Rising powers of z^-1 are falling powers of z if both have the same length.
        let length = numerator.len().max(denominator.len());
        numerator.resize(length, 0.0);
        denominator.resize(length, 0.0);
    }
    Ok(target.tf(numerator, denominator))
}

/// `b` and `a` of scipy.signal: falling powers of s. A discrete filter has as many of both, which are then falling powers of z as well
/// as rising powers of z^-1.
fn scipy_polynomials(fields: &Variables, target: Target) -> Result<TransferSettings, String> {
    let numerator = coefficients(fields, names::SCIPY_NUMERATOR)?;
    let denominator = coefficients(fields, names::SCIPY_DENOMINATOR)?;
    let (b, a) = (numerator.len(), denominator.len());
    match target.domain {
        Domain::Discrete { .. } if b != a => Err(format!(
            "`b` has {b} coefficients and `a` has {a}; scipy.signal.lfilter reads them as powers of z^-1, scipy.signal.dlti as powers of z; append zeros to the shorter one for lfilter, or put them in front for dlti"
        )),
        _ => Ok(target.tf(numerator, denominator)),
    }
}

/// `sos` of scipy.signal: rows b0, b1, b2, a0, a1, a2.
fn sections(fields: &Variables, target: Target) -> Result<TransferSettings, String> {
    let rows = rows(fields, names::SECTIONS)?;
    let halves = rows.iter().map(|row| match row.as_slice() {
        [b0, b1, b2, a0, a1, a2] => Ok(section([*b0, *b1, *b2], [*a0, *a1, *a2])),
        _ => Err(format!(
            "`sos` has rows of {} numbers; save rows of six numbers b0, b1, b2, a0, a1, a2 (scipy.signal)",
            row.len()
        )),
    });
    let halves: Vec<(Vec<f64>, Vec<f64>)> = halves.collect::<Result<_, _>>()?;
    let factors = factors_of_rows(&halves, target.domain);
    let factors = factors.map_err(|why| format!("a row of `sos`: {why}"))?;
    Ok(target.factors(&factors))
}

/// A section without the powers of v that numerator and denominator have in common: a section of first order has them.
fn section(numerator: [f64; 3], denominator: [f64; 3]) -> (Vec<f64>, Vec<f64>) {
    let (mut above, mut below) = (numerator.to_vec(), denominator.to_vec());
    while below.len() > 1 && above.last() == Some(&0.0) && below.last() == Some(&0.0) {
        above.pop();
        below.pop();
    }
    (above, below)
}

fn roots(fields: &Variables, target: Target) -> Result<TransferSettings, String> {
    let (zeros, poles) = (pairs(fields, names::ZEROS)?, pairs(fields, names::POLES)?);
    Ok(target.zpk(zeros, poles, scalar(fields, names::GAIN)?))
}

fn matrices(fields: &Variables, target: Target) -> Result<TransferSettings, String> {
    let a = square(fields, names::A, None)?;
    let states = a.len();
    let (a, b) = without_descriptor(fields, a, per_state(fields, names::B, states)?)?;
    Ok(TransferSettings::Ss(SsSettings {
        gain_unit: target.gain_unit,
        rate_hz: target.rate_hz(),
        a,
        b,
        c: per_state(fields, names::C, states)?,
        d: optional_scalar(fields, names::D)?,
    }))
}

/// A and B of E x' = A x + B e, solved for x'.
fn without_descriptor(
    fields: &Variables,
    a: Vec<Vec<f64>>,
    b: Vec<f64>,
) -> Result<(Vec<Vec<f64>>, Vec<f64>), String> {
    let states = a.len();
    match get(fields, names::E) {
        Some((_, value)) if !value.is_empty() => {}
        _ => return Ok((a, b)),
    }
    let e = matrix(&square(fields, names::E, Some(states))?);
    if e == DMatrix::identity(states, states) {
        return Ok((a, b));
    }
    let refused = |condition: f64| {
        format!(
            "`E` has the condition number {condition:.1e}, above the limit of {MAX_CONDITION:.0e}, so the system is not one of ordinary differential equations or loses digits; convert it to A, B, C, D without E (MATLAB: ss(C, 'explicit'), or minreal) and save it again"
        )
    };
    let singular = e.clone().singular_values();
    let condition = singular.max() / singular.min();
    let elimination = e.lu();
    let solved = elimination
        .solve(&matrix(&a))
        .zip(elimination.solve(&DMatrix::from_column_slice(states, 1, &b)));
    match solved {
        Some((a, b)) if condition <= MAX_CONDITION => {
            let rows = a.row_iter().map(|row| row.iter().copied().collect());
            Ok((rows.collect(), b.iter().copied().collect()))
        }
        _ => Err(refused(condition)),
    }
}

fn matrix(rows: &[Vec<f64>]) -> DMatrix<f64> {
    let entries = rows.iter().flatten().copied();
    DMatrix::from_row_iterator(rows.len(), rows.len(), entries)
}

/// A continuous controller whose unit of time is `unit_s` seconds: v = s unit_s.
fn in_seconds(settings: TransferSettings, unit_s: f64) -> TransferSettings {
    if unit_s == 1.0 {
        return settings;
    }
    match settings {
        TransferSettings::Tf(tf) => TransferSettings::Tf(TfSettings {
            numerator: scaled_polynomial(&tf.numerator, unit_s),
            denominator: scaled_polynomial(&tf.denominator, unit_s),
            ..tf
        }),
        TransferSettings::Zpk(zpk) => {
            let excess = zpk.zeros.len() as f64 - zpk.poles.len() as f64;
            TransferSettings::Zpk(ZpkSettings {
                gain: zpk.gain * libm::pow(unit_s, excess),
                zeros: scaled_roots(&zpk.zeros, unit_s),
                poles: scaled_roots(&zpk.poles, unit_s),
                ..zpk
            })
        }
        TransferSettings::Ss(ss) => TransferSettings::Ss(SsSettings {
            a: ss.a.iter().map(|row| divided(row, unit_s)).collect(),
            b: divided(&ss.b, unit_s),
            ..ss
        }),
    }
}

/// Coefficients by falling powers: that of s^k is multiplied by unit^k.
fn scaled_polynomial(falling: &[f64], unit_s: f64) -> Vec<f64> {
    let powers = (0..falling.len()).rev();
    let scaled = falling.iter().zip(powers);
    scaled
        .map(|(c, power)| c * libm::pow(unit_s, power as f64))
        .collect()
}

fn scaled_roots(roots: &[[f64; 2]], unit_s: f64) -> Vec<[f64; 2]> {
    roots
        .iter()
        .map(|root| root.map(|part| part / unit_s))
        .collect()
}

fn divided(numbers: &[f64], unit_s: f64) -> Vec<f64> {
    numbers.iter().map(|x| x / unit_s).collect()
}

/// The sum of all delays in samples.
fn delay_samples(selected: &Selected<'_>) -> Result<usize, String> {
    let mut samples = 0;
    for delay in &selected.properties.delays {
        samples += match selected.domain {
            Domain::Continuous => return Err(continuous_delay(delay)),
            Domain::Discrete { .. } => whole_samples(delay)?,
        };
    }
    Ok(samples)
}

fn continuous_delay(Delay { name, value }: &Delay) -> String {
    format!(
        "`{name}` is {value}: a continuous controller cannot contain a delay; discretise it at the rate of the loop with a delay of whole samples, or approximate the delay by poles and zeros (pade), and save it again. A delay of the plant or of the devices is a setting of the bench, not of the controller"
    )
}

fn whole_samples(Delay { name, value }: &Delay) -> Result<usize, String> {
    let whole = libm::round(*value);
    let is_whole = (value - whole).abs() < SAMPLE_ROUNDING && whole > 0.0;
    if is_whole && whole <= MAX_ORDER as f64 {
        Ok(whole as usize)
    } else {
        Err(format!(
            "`{name}` is {value} samples: a delay of a discrete controller must be a whole number of samples from 0 to {MAX_ORDER}; approximate it by poles and zeros and save the controller again"
        ))
    }
}

/// The controller with poles at z = 0.
fn delayed(
    settings: TransferSettings,
    samples: usize,
    delays: &[Delay],
) -> Result<TransferSettings, String> {
    if samples == 0 {
        return Ok(settings);
    }
    let order = order(&settings) + samples;
    if order > MAX_ORDER {
        let names: Vec<&str> = delays.iter().map(|delay| delay.name.as_str()).collect();
        return Err(format!(
            "with the delay of {samples} samples (`{}`) its order is {order}, above the limit of {MAX_ORDER}; shorten the delay or reduce the order",
            names.join("`, `")
        ));
    }
    match settings {
        TransferSettings::Tf(mut tf) => {
            tf.denominator.extend(std::iter::repeat_n(0.0, samples));
            Ok(TransferSettings::Tf(tf))
        }
        TransferSettings::Zpk(mut zpk) => {
            zpk.poles.extend(std::iter::repeat_n([0.0, 0.0], samples));
            Ok(TransferSettings::Zpk(zpk))
        }
        // The poles at z = 0 of a chain of states are not exact eigenvalues; as roots they are.
        TransferSettings::Ss(_) => delayed(as_roots(&settings)?, samples, delays),
    }
}

fn order(settings: &TransferSettings) -> usize {
    match settings {
        TransferSettings::Tf(tf) => tf.denominator.len().saturating_sub(1),
        TransferSettings::Zpk(zpk) => zpk.poles.len(),
        TransferSettings::Ss(ss) => ss.a.len(),
    }
}

fn as_roots(settings: &TransferSettings) -> Result<TransferSettings, String> {
    let cascade = Cascade::of(settings).map_err(|why| why.to_string())?;
    let target = Target {
        gain_unit: settings.gain_unit(),
        domain: cascade.domain,
    };
    Ok(target.factors(&cascade.factors))
}
