//! Local models with poles.
//!
//! ```text
//! H = B(x)/A(x),    A = 1 + a1 x + ... + ad x^d,    B = b0 + ... + bn x^n,    n = 2 d
//! ```
//!
//! d modes lie in the window, and the remaining response is a parabola at least. The coefficients are found by reweighted linear fits of
//! A Y = B U (C. K. Sanathanan, J. Koerner, IEEE Trans. Autom. Control 8 (1963) 56), which noise in Y biases; Gauss-Newton steps on
//! Y - B U/A remove that bias.

use nalgebra::Complex;

use super::least_squares::{self, LeastSquares};
use super::window::{FittedModel, LocalFit, Window};

/// Linear fits, each weighted with the denominator of the one before.
const REWEIGHTED_FITS: usize = 2;
/// Largest number of Gauss-Newton steps.
const MAX_STEPS: usize = 6;
/// The iteration ends after a change of the denominator's coefficients below this.
const CONVERGED: f64 = 1e-6;
/// A pole nearer to a bin than this ratio of the half-width fits the error of that bin, not a mode.
const MIN_POLE_DISTANCE: f64 = 1e-3;
/// F statistic of the first linear fit with poles below which no others are made.
const PROMISING_F: f64 = 5.0;

/// The form of a model.
#[derive(Clone, Copy)]
pub(super) struct Order {
    pub(super) poles: usize,
    /// Whether a transient is added, over the same denominator.
    pub(super) transient: bool,
}

impl Order {
    fn numerator_degree(self) -> usize {
        2 * self.poles
    }

    /// Number of complex coefficients.
    fn unknowns(self) -> usize {
        let polynomials = if self.transient { 2 } else { 1 };
        polynomials * (self.numerator_degree() + 1) + self.poles
    }
}

/// B with the transient behind it, and a1 to ad.
struct Coefficients {
    numerator: Vec<Complex<f64>>,
    denominator: Vec<Complex<f64>>,
}

/// The model with poles; `None` where the first linear fit does not promise one that is better than `simple`.
pub(super) fn fit(window: &Window, order: Order, simple: &LocalFit) -> Option<FittedModel> {
    if window.excited() <= 2 * order.unknowns() {
        return None;
    }
    let mut denominator = vec![Complex::default(); order.poles];
    let mut numerator = Vec::new();
    for fit in 0..REWEIGHTED_FITS {
        let mut linear = reweighted(window, order, &denominator)?;
        if fit == 0 && window.local_fit(&linear).f_statistic(simple) <= PROMISING_F {
            return None;
        }
        denominator = linear
            .solution
            .split_off(linear.solution.len() - order.poles);
        numerator = linear.solution;
    }
    let start = Coefficients {
        numerator,
        denominator,
    };
    gauss_newton(window, order, start)
}

/// The linear fit of A Y = B U, both sides over the denominator of the previous fit.
fn reweighted(window: &Window, order: Order, previous: &[Complex<f64>]) -> Option<LeastSquares> {
    let inverse = inverse_denominator(window, previous)?;
    let mut columns = numerators(window, order, &inverse);
    let right: Vec<Complex<f64>> = (0..window.len())
        .map(|j| window.output[j] * inverse[j] * window.root_weight[j])
        .collect();
    columns.extend(times_powers(window, order, right.iter().map(|y| -y)));
    least_squares::solve(columns, right)
}

/// Gauss-Newton steps on the error of the output; the derivative of B U/A by a_i is -x^i B U/A^2.
fn gauss_newton(
    window: &Window,
    order: Order,
    mut coefficients: Coefficients,
) -> Option<FittedModel> {
    for step in 0..MAX_STEPS {
        let mut linear = linearized(window, order, &coefficients)?;
        let change = coefficients.add(&linear.solution);
        if change < CONVERGED || step + 1 == MAX_STEPS {
            // After a small step, the residual of the linear model is that of the model to second order.
            if change >= CONVERGED {
                linear.residual = error(window, order, &coefficients)?;
            }
            let fit = LocalFit {
                response: coefficients.numerator[0],
                ..window.local_fit(&linear)
            };
            let transient = transient(window, order, &coefficients)?;
            return Some(FittedModel {
                fit,
                linear,
                transient,
            });
        }
    }
    None
}

impl Coefficients {
    /// Adds a step; returns the largest change of the denominator.
    fn add(&mut self, step: &[Complex<f64>]) -> f64 {
        let all = self.numerator.iter_mut().chain(&mut self.denominator);
        all.zip(step)
            .for_each(|(coefficient, by)| *coefficient += by);
        let of_denominator = &step[self.numerator.len()..];
        of_denominator
            .iter()
            .map(|by| by.norm())
            .fold(0.0, f64::max)
    }
}

/// The least-squares solution of the model linearized about its coefficients.
fn linearized(window: &Window, order: Order, coefficients: &Coefficients) -> Option<LeastSquares> {
    let inverse = inverse_denominator(window, &coefficients.denominator)?;
    let mut columns = numerators(window, order, &inverse);
    let model = combination(&columns, &coefficients.numerator);
    let over_denominator = (0..model.len()).map(|j| -model[j] * inverse[j]);
    columns.extend(times_powers(window, order, over_denominator));
    least_squares::solve(columns, weighted_error(window, &model))
}

/// The transient T/A, weighted; empty without one.
fn transient(
    window: &Window,
    order: Order,
    coefficients: &Coefficients,
) -> Option<Vec<Complex<f64>>> {
    if !order.transient {
        return Some(Vec::new());
    }
    let inverse = inverse_denominator(window, &coefficients.denominator)?;
    let columns = numerators(window, order, &inverse);
    let of_response = order.numerator_degree() + 1;
    Some(combination(
        &columns[of_response..],
        &coefficients.numerator[of_response..],
    ))
}

/// Y - B U/A, weighted.
fn error(window: &Window, order: Order, coefficients: &Coefficients) -> Option<Vec<Complex<f64>>> {
    let inverse = inverse_denominator(window, &coefficients.denominator)?;
    let columns = numerators(window, order, &inverse);
    let model = combination(&columns, &coefficients.numerator);
    Some(weighted_error(window, &model))
}

/// The output, weighted, minus a model of it.
fn weighted_error(window: &Window, model: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let outputs = window.output.iter().zip(&window.root_weight);
    let errors = outputs
        .zip(model)
        .map(|((output, root), model)| output * *root - model);
    errors.collect()
}

/// The columns of B, and of a transient.
fn numerators(window: &Window, order: Order, inverse: &[Complex<f64>]) -> Vec<Vec<Complex<f64>>> {
    window.numerators(order.numerator_degree(), order.transient, inverse)
}

/// A column times x, x^2, ..., one for each coefficient of the denominator.
fn times_powers(
    window: &Window,
    order: Order,
    column: impl Iterator<Item = Complex<f64>>,
) -> Vec<Vec<Complex<f64>>> {
    let mut power: Vec<Complex<f64>> = column.collect();
    let mut columns = Vec::new();
    for _ in 0..order.poles {
        power.iter_mut().zip(&window.x).for_each(|(y, x)| *y *= x);
        columns.push(power.clone());
    }
    columns
}

/// sum over i of `column_i` b_i.
pub(super) fn combination(columns: &[Vec<Complex<f64>>], b: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows)
        .map(|j| columns.iter().zip(b).map(|(column, b)| column[j] * b).sum())
        .collect()
}

/// 1/A at each bin; `None` if a pole is at one.
fn inverse_denominator(window: &Window, a: &[Complex<f64>]) -> Option<Vec<Complex<f64>>> {
    window.x.iter().map(|x| inverse_at(*x, a)).collect()
}

fn inverse_at(x: f64, a: &[Complex<f64>]) -> Option<Complex<f64>> {
    let (mut value, mut slope) = (Complex::<f64>::new(1.0, 0.0), Complex::<f64>::default());
    let mut power = 1.0;
    for (below, coefficient) in a.iter().enumerate() {
        slope += coefficient * ((below + 1) as f64 * power);
        power *= x;
        value += coefficient * power;
    }
    // The distance of the nearest pole is about |A/A'|, exactly so with one pole.
    (value.norm() > MIN_POLE_DISTANCE * slope.norm()).then(|| value.inv())
}
