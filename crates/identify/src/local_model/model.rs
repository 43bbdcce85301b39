//! A smooth model of the response around a frequency: the response in the middle and its sensitivity to noise.
//!
//! With x the distance from the middle over the half-width h, Y_k = H(x_k) U_k + N_k with
//!
//! ```text
//! constant      H = b0
//! polynomial    H = b0 + b1 x + b2 x^2
//! rational      H = (b0 + b1 x + b2 x^2)/(1 + a x)
//! ```
//!
//! by least squares over |x| < 1 with the weights cos^2(pi x/2): the local polynomial method (LPM) and the local rational
//! method (LRM; T. McKelvey, G. Guerin, IFAC SYSID 2012; E. Geerardyn, T. Oomen, J. Schoukens, IFAC World Congress 2014; R.
//! Pintelon, J. Schoukens, System Identification, 2nd ed., chapter 7). Near a lightly damped mode 1/(1 + a x) is its pole,
//! and the remaining response is smooth. With a transient, T = t0 + t1 x + t2 x^2 (over the same denominator) is added to H U:
//! the effect of the states at the beginning and at the end of the record.
//!
//! The rational model is found by reweighted linear fits of (1 + a x) Y = B U (C. K. Sanathanan, J. Koerner, IEEE Trans.
//! Autom. Control 8 (1963) 56), which noise in Y biases; Gauss-Newton steps on Y - B U/(1 + a x) remove that bias. The
//! rational model has more variance than the polynomial, and is used only where its residual is significantly smaller.

use nalgebra::Complex;

use super::least_squares::{self, LeastSquares};
use super::window::{LocalFit, Window};
use crate::{EstimatorSettings, LocalModel};

/// Linear fits, each weighted with the denominator of the one before.
const REWEIGHTED_FITS: usize = 2;
/// Largest number of Gauss-Newton steps.
const MAX_STEPS: usize = 6;
/// The iteration ends after a change of the denominator's coefficient below this.
const CONVERGED: f64 = 1e-6;
/// A pole nearer to a bin than this ratio of the half-width fits the error of that bin, not a mode.
const MIN_POLE_DISTANCE: f64 = 1e-3;
/// F statistic above which the rational model is used: Fisher's F of 2 and some 20 degrees of freedom exceeds it with a
/// probability of 0.1 %.
const SIGNIFICANT_F: f64 = 10.0;
/// F statistic of the first linear fit with a pole below which no others are made.
const PROMISING_F: f64 = 5.0;

/// A local model with the linear solution that it was found by.
pub(super) struct FittedModel {
    pub(super) fit: LocalFit,
    /// The last linear step; the residual is that of the model.
    pub(super) linear: LeastSquares,
}

/// The model of a window; `None` where there is no input.
pub(super) fn fit(window: &Window, settings: &EstimatorSettings) -> Option<FittedModel> {
    let transient = settings.transient;
    let degree = window.degree(settings.curve, transient);
    let polynomial = polynomial(window, degree, transient)?;
    if settings.curve != LocalModel::Rational || degree < 2 {
        return Some(polynomial);
    }
    let rational = rational(window, transient, &polynomial.fit)
        .filter(|rational| f_statistic(&polynomial.fit, &rational.fit) > SIGNIFICANT_F);
    Some(rational.unwrap_or(polynomial))
}

/// Fisher's F: the power explained by the pole over that of the remaining noise.
fn f_statistic(polynomial: &LocalFit, rational: &LocalFit) -> f64 {
    let explained = (polynomial.residual_power - rational.residual_power)
        / (polynomial.freedom - rational.freedom);
    // 0/0 where the polynomial explains everything: f64::max returns the 0.
    (explained * rational.freedom / rational.residual_power).max(0.0)
}

fn polynomial(window: &Window, degree: usize, transient: bool) -> Option<FittedModel> {
    let columns = if transient {
        window.numerators(degree, true, &vec![Complex::from(1.0); window.len()])
    } else {
        window.powers(degree, |j| window.input[j])
    };
    let right = window
        .output
        .iter()
        .zip(&window.root_weight)
        .map(|(y, root)| y * root)
        .collect();
    let linear = least_squares::solve(columns, right)?;
    Some(FittedModel {
        fit: window.local_fit(&linear),
        linear,
    })
}

/// The rational model; `None` where the first linear fit does not promise one.
fn rational(window: &Window, transient: bool, polynomial: &LocalFit) -> Option<FittedModel> {
    let mut pole = Complex::default();
    let mut numerator = Vec::new();
    for fit in 0..REWEIGHTED_FITS {
        let mut linear = reweighted(window, transient, pole)?;
        if fit == 0 && f_statistic(polynomial, &window.local_fit(&linear)) <= PROMISING_F {
            return None;
        }
        pole = linear.solution.pop()?;
        numerator = linear.solution;
    }
    gauss_newton(window, transient, pole, numerator)
}

/// The linear fit of (1 + a x) Y = B U, both sides over the denominator of the previous fit.
fn reweighted(window: &Window, transient: bool, previous: Complex<f64>) -> Option<LeastSquares> {
    let inverse = inverse_denominator(window, previous)?;
    let mut columns = window.numerators(2, transient, &inverse);
    let right: Vec<Complex<f64>> = (0..window.len())
        .map(|j| window.output[j] * inverse[j] * window.root_weight[j])
        .collect();
    columns.push(right.iter().zip(&window.x).map(|(y, x)| -y * *x).collect());
    least_squares::solve(columns, right)
}

/// Gauss-Newton steps on the error of the output; the derivative of B U/A by a is -x B U/A^2.
fn gauss_newton(
    window: &Window,
    transient: bool,
    mut pole: Complex<f64>,
    mut numerator: Vec<Complex<f64>>,
) -> Option<FittedModel> {
    for step in 0..MAX_STEPS {
        let linear = linearized(window, transient, pole, &numerator)?;
        let change = *linear.solution.last()?;
        numerator
            .iter_mut()
            .zip(&linear.solution)
            .for_each(|(b, by)| *b += by);
        pole += change;
        if change.norm() < CONVERGED || step + 1 == MAX_STEPS {
            // After a small step, the residual of the linear model is that of the model to second order.
            let fit = LocalFit {
                response: numerator[0],
                ..window.local_fit(&linear)
            };
            return Some(FittedModel { fit, linear });
        }
    }
    None
}

/// The least-squares solution of the model linearized about its parameters.
fn linearized(
    window: &Window,
    transient: bool,
    pole: Complex<f64>,
    numerator: &[Complex<f64>],
) -> Option<LeastSquares> {
    let inverse = inverse_denominator(window, pole)?;
    let mut columns = window.numerators(2, transient, &inverse);
    let model = combination(&columns, numerator);
    let by_pole = (0..model.len()).map(|j| -model[j] * inverse[j] * window.x[j]);
    columns.push(by_pole.collect());
    let error = (0..model.len())
        .map(|j| window.output[j] * window.root_weight[j] - model[j])
        .collect();
    least_squares::solve(columns, error)
}

/// sum over i of `column_i` b_i.
fn combination(columns: &[Vec<Complex<f64>>], b: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows)
        .map(|j| columns.iter().zip(b).map(|(column, b)| column[j] * b).sum())
        .collect()
}

/// 1/(1 + a x) at each bin; `None` if the pole is at one.
fn inverse_denominator(window: &Window, a: Complex<f64>) -> Option<Vec<Complex<f64>>> {
    let denominators = window.x.iter().map(|x| a * *x + 1.0);
    denominators
        .map(|denominator| {
            (denominator.norm() > MIN_POLE_DISTANCE * a.norm()).then(|| denominator.inv())
        })
        .collect()
}
