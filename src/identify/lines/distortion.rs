//! What is alike in every period and yet no response: distortion, by how much a response is rougher than a smooth curve.
//!
//! Friction and backlash answer every period in the same way, so that the scatter between periods does not show them. They
//! differ from line to line as the phases of the input do, while a response is smooth, or has a mode:
//!
//! ```text
//! H(x) = (a + b x + c x^2)/(1 + d x)            over the 8 lines to either side, x the distance
//! ```
//!
//! by least squares, the local rational method (McKelvey, Guerin, IFAC SYSID 2012), and what is left over its degrees of freedom is
//! the power of noise and distortion, averaged over as many lines again as a ratio of |H|^2.

use nalgebra::{Complex, DMatrix, DVector};

use crate::identify::FrfDatum;

/// Lines to either side.
const REACH: usize = 8;
/// Parameters of a curve.
const PARAMETERS: usize = 4;
/// Fits, each weighted with the denominator of the one before.
const FITS: usize = 3;
/// A denominator is no smaller: its mode is no sharper than this part of the distance of two lines.
const SHARPEST: f64 = 1e-3;
/// Singular values below this are those of parameters that say the same.
const ALIKE: f64 = 1e-10;

/// The frf_data with the power of distortion in their variances; as they are where there are too few lines to
/// tell. Where modes are closer than the lines of one curve, their difference from it is counted too.
pub fn with_distortion(frf_data: &[FrfDatum]) -> Vec<FrfDatum> {
    if frf_data.len() < 2 * REACH + 1 {
        return frf_data.to_vec();
    }
    let rough: Vec<f64> = (0..frf_data.len())
        .map(|k| roughness(frf_data, k) / frf_data[k].response.norm_sqr())
        .collect();
    let around = |k: usize| {
        let near = &rough[k.saturating_sub(REACH)..(k + REACH + 1).min(rough.len())];
        near.iter().sum::<f64>() / near.len() as f64
    };
    // A response of zero makes 0/0, and max() then keeps the noise.
    let with = |(k, block): (usize, &FrfDatum)| FrfDatum {
        variance: block.variance.max(around(k) * block.response.norm_sqr()),
        ..*block
    };
    frf_data.iter().enumerate().map(with).collect()
}

/// What the curve around a line leaves, per degree of freedom.
fn roughness(frf_data: &[FrfDatum], line: usize) -> f64 {
    let low = line
        .saturating_sub(REACH)
        .min(frf_data.len() - 2 * REACH - 1);
    let near = &frf_data[low..low + 2 * REACH + 1];
    let reach_hz = near[2 * REACH].frequency_hz - near[0].frequency_hz;
    let x: Vec<f64> = near
        .iter()
        .map(|b| 2.0 * REACH as f64 * (b.frequency_hz - frf_data[line].frequency_hz) / reach_hz)
        .collect();
    let mut below = vec![Complex::new(1.0, 0.0); x.len()];
    let mut left = f64::INFINITY;
    for _ in 0..FITS {
        let Some(curve) = curve(&x, near, &below) else {
            break;
        };
        below = x.iter().map(|x| not_zero(curve[3] * *x + 1.0)).collect();
        let at = |k: usize| (curve[0] + curve[1] * x[k] + curve[2] * (x[k] * x[k])) / below[k];
        left = near
            .iter()
            .enumerate()
            .map(|(k, block)| (block.response - at(k)).norm_sqr())
            .sum();
    }
    left / (x.len() - PARAMETERS) as f64
}

/// a, b, c, d of the curve, each line weighted with 1 over `below`.
fn curve(x: &[f64], near: &[FrfDatum], below: &[Complex<f64>]) -> Option<DVector<Complex<f64>>> {
    let h = |k: usize| near[k].response;
    let matrix = DMatrix::from_fn(x.len(), PARAMETERS, |k, column| {
        let entry = match column {
            3 => -h(k) * x[k],
            power => Complex::new(x[k].powi(power as i32), 0.0),
        };
        entry / below[k]
    });
    // Columns of the same size: the last is in other units.
    let size: Vec<f64> = matrix
        .column_iter()
        .map(|column| column.norm().max(f64::MIN_POSITIVE))
        .collect();
    let scaled = DMatrix::from_fn(x.len(), PARAMETERS, |k, column| {
        matrix[(k, column)] / size[column]
    });
    let right = DVector::from_fn(x.len(), |k, _| h(k) / below[k]);
    let finite = scaled
        .iter()
        .chain(right.iter())
        .all(|entry| entry.re.is_finite() && entry.im.is_finite());
    let solved = finite.then(|| scaled.svd(true, true).solve(&right, ALIKE).ok())??;
    Some(DVector::from_fn(PARAMETERS, |column, _| {
        solved[column] / size[column]
    }))
}

fn not_zero(below: Complex<f64>) -> Complex<f64> {
    if below.norm() < SHARPEST {
        Complex::new(SHARPEST, 0.0)
    } else {
        below
    }
}
