//! Distortion that repeats in every period, from the roughness of the response over frequency.
//!
//! Friction and backlash act in the same way in every period, so that the scatter between the periods does not show them. Their
//! effect changes from line to line with the phases of the input, while a response is smooth, or has a mode:
//!
//! ```text
//! H(x) = (a + b x + c x^2)/(1 + d x)            over the 8 lines to either side, x the distance
//! ```
//!
//! by least squares (local rational method: McKelvey, Guerin, IFAC SYSID 2012). The residual over its degrees of freedom is the
//! power of noise and distortion, averaged over as many lines again as a ratio of |H|^2.

use nalgebra::{Complex, DMatrix, DVector};

use crate::FrfDatum;
use crate::mean::mean_around;

/// Lines to either side.
const REACH: usize = 8;
/// Lines of a local model.
const LINES: usize = 2 * REACH + 1;
/// Parameters of a local model.
const PARAMETERS: usize = 4;
/// Fits, each weighted with the denominator of the one before.
const FITS: usize = 3;
/// Smallest magnitude of a denominator.
const MIN_DENOMINATOR: f64 = 1e-3;
/// Singular values below this belong to linearly dependent parameters.
const DEPENDENT: f64 = 1e-10;

/// The data with the power of distortion in their variances. With too few lines the data are returned unchanged. Where modes are
/// closer than the lines of one local model, their deviation from it counts as distortion.
pub fn with_distortion(data: &[FrfDatum]) -> Vec<FrfDatum> {
    if data.len() < LINES {
        return data.to_vec();
    }
    let relative_power: Vec<f64> = (0..data.len())
        .map(|k| roughness(data, k) / data[k].response.norm_sqr())
        .collect();
    let data = data.iter().enumerate();
    data.map(|(k, datum)| {
        let distortion = mean_around(&relative_power, k, REACH) * datum.response.norm_sqr();
        // A response of zero makes 0/0, for which max() returns the noise.
        let variance = datum.variance.max(distortion);
        FrfDatum { variance, ..*datum }
    })
    .collect()
}

/// Power of the distortion over that of the response, the mean over the lines; `None` with too few lines.
pub fn distortion_ratio(data: &[FrfDatum]) -> Option<f64> {
    let increased = with_distortion(data);
    let ratios = data.iter().zip(&increased).map(|(datum, increased)| {
        (increased.variance - datum.variance) / datum.response.norm_sqr()
    });
    // A response of zero makes 0/0 or infinity.
    let finite: Vec<f64> = ratios.filter(|ratio| ratio.is_finite()).collect();
    let is_enough = data.len() >= LINES && !finite.is_empty();
    is_enough.then(|| finite.iter().sum::<f64>() / finite.len() as f64)
}

/// The response at a frequency between the lines, by the local model of the lines around it; `None` with too few lines.
pub(super) fn interpolated(data: &[FrfDatum], frequency_hz: f64) -> Option<Complex<f64>> {
    if data.len() < LINES {
        return None;
    }
    let line = data.partition_point(|datum| datum.frequency_hz < frequency_hz);
    let local = Local::around(data, line, frequency_hz)?;
    Some(local.at_frequency)
}

/// The residual power of the local model around a line, per degree of freedom.
fn roughness(data: &[FrfDatum], line: usize) -> f64 {
    let local = Local::around(data, line, data[line].frequency_hz);
    let residual_power = local.map_or(f64::INFINITY, |local| local.residual_power);
    residual_power / (LINES - PARAMETERS) as f64
}

/// A local model of the lines around a frequency.
struct Local {
    /// Its response at the frequency.
    at_frequency: Complex<f64>,
    /// Sum of the squared residuals.
    residual_power: f64,
}

impl Local {
    /// The model of the lines around a line, of data that are enough for one.
    fn around(data: &[FrfDatum], line: usize, frequency_hz: f64) -> Option<Local> {
        let low = line.saturating_sub(REACH).min(data.len() - LINES);
        let near = &data[low..low + LINES];
        let x = distances(near, frequency_hz);
        let mut denominator = vec![Complex::new(1.0, 0.0); LINES];
        let mut local = None;
        for _ in 0..FITS {
            let Some(model) = local_model(&x, near, &denominator) else {
                break;
            };
            denominator = x.iter().map(|x| limited(model[3] * *x + 1.0)).collect();
            let residuals =
                (0..LINES).map(|k| near[k].response - numerator(&model, x[k]) / denominator[k]);
            local = Some(Local {
                at_frequency: model[0],
                residual_power: residuals.map(|residual| residual.norm_sqr()).sum(),
            });
        }
        local
    }
}

/// x of each line: its distance from a frequency in mean distances of the lines.
fn distances(near: &[FrfDatum], frequency_hz: f64) -> Vec<f64> {
    let span_hz = near[LINES - 1].frequency_hz - near[0].frequency_hz;
    near.iter()
        .map(|datum| 2.0 * REACH as f64 * (datum.frequency_hz - frequency_hz) / span_hz)
        .collect()
}

/// a + b x + c x^2.
fn numerator(model: &DVector<Complex<f64>>, x: f64) -> Complex<f64> {
    model[0] + model[1] * x + model[2] * (x * x)
}

/// a, b, c, d of the local model, with 1/`denominator` as the weight of each line.
fn local_model(
    x: &[f64],
    near: &[FrfDatum],
    denominator: &[Complex<f64>],
) -> Option<DVector<Complex<f64>>> {
    let matrix = DMatrix::from_fn(x.len(), PARAMETERS, |k, column| {
        let entry = match column {
            3 => -near[k].response * x[k],
            power => Complex::new(x[k].powi(power as i32), 0.0),
        };
        entry / denominator[k]
    });
    let right = DVector::from_fn(x.len(), |k, _| near[k].response / denominator[k]);
    solve_scaled(&matrix, &right)
}

/// Least squares with columns scaled to the same size, as the last one has other units.
fn solve_scaled(
    matrix: &DMatrix<Complex<f64>>,
    right: &DVector<Complex<f64>>,
) -> Option<DVector<Complex<f64>>> {
    let columns = matrix.column_iter();
    let size: Vec<f64> = columns
        .map(|column| column.norm().max(f64::MIN_POSITIVE))
        .collect();
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |k, column| {
        matrix[(k, column)] / size[column]
    });
    let mut entries = scaled.iter().chain(right.iter());
    if !entries.all(|entry| entry.is_finite()) {
        return None;
    }
    let solved = scaled.svd(true, true).solve(right, DEPENDENT).ok()?;
    Some(DVector::from_fn(size.len(), |column, _| {
        solved[column] / size[column]
    }))
}

fn limited(denominator: Complex<f64>) -> Complex<f64> {
    if denominator.norm() < MIN_DENOMINATOR {
        Complex::new(MIN_DENOMINATOR, 0.0)
    } else {
        denominator
    }
}
