//! A smooth curve through the bins around a frequency: what the response is in its middle, and what noise makes of that.
//!
//! With x the distance from the middle over the half-width h, Y_k = H(x_k) U_k + N_k with
//!
//! ```text
//! constant      H = b0
//! polynomial    H = b0 + b1 x + b2 x^2
//! rational      H = (b0 + b1 x + b2 x^2)/(1 + a x)
//! ```
//!
//! by least squares over |x| < 1 with the weights cos^2(pi x/2): the local polynomial and the local rational method (T.
//! McKelvey, G. Guerin, IFAC SYSID 2012; E. Geerardyn, T. Oomen, J. Schoukens, IFAC World Congress 2014; R. Pintelon, J.
//! Schoukens, System Identification, 2nd ed., chapter 7). Near a lightly damped mode 1/(1 + a x) is its pole, and the rest is
//! smooth. With a transient, T = t0 + t1 x + t2 x^2 (over the same denominator) is added to H U: what the state at the begin of
//! the record, and at its end, leaves in the transform.
//!
//! The rational curve is found by reweighted linear fits of (1 + a x) Y = B U (C. K. Sanathanan, J. Koerner, IEEE Trans.
//! Autom. Control 8 (1963) 56), which noise in Y biases; steps of Gauss and Newton on Y - B U/(1 + a x) itself end that bias.
//! It costs variance, and is taken only where its residual is less than the polynomial's beyond what chance does.

use nalgebra::Complex;

use super::squares::{self, Squares};
use crate::identify::{EstimatorSettings, LocalModel};

/// Fits with the denominator of the one before.
const REWEIGHTED: usize = 2;
/// Steps of Gauss and Newton, at most.
const STEPS: usize = 6;
/// A step that changes the denominator by less is the last.
const SMALL: f64 = 1e-6;
/// A pole nearer to a bin than this part of the half-width would be an error of that bin, not a mode.
const SHARPEST: f64 = 1e-3;
/// A pole is called for where the power that it explains is above so many times the noise: Fisher's F of 2 and some 20
/// degrees of freedom is beyond it once in a thousand.
const CALLED_FOR: f64 = 10.0;
/// Where the first linear fit with a pole explains less, no more are tried.
const WORTH_A_LOOK: f64 = 5.0;

/// The bins around a place.
pub(super) struct Window {
    /// (k - place)/half-width
    pub(super) x: Vec<f64>,
    /// Square roots of the weights.
    pub(super) root: Vec<f64>,
    pub(super) input: Vec<Complex<f64>>,
    pub(super) output: Vec<Complex<f64>>,
}

/// A curve in the middle of its window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fitted {
    pub(super) response: Complex<f64>,
    /// E|error of H|^2 for noise of power 1 in a bin.
    pub(super) gain: f64,
    /// sum w |Y - H U|^2
    pub(super) residual: f64,
    /// The same, expected for noise of power 1.
    pub(super) freedom: f64,
    /// Equivalent noise bandwidth, in bins, of the weights that make H out of the Y/U.
    pub(super) width: f64,
    /// The share of the output's power that the curve explains.
    pub(super) coherence: f64,
    /// Whether there is input in the middle, or to both sides of it.
    pub(super) enclosed: bool,
}

/// A curve, and how it came to be.
pub(super) struct Drawn {
    pub(super) fitted: Fitted,
    /// Its last linear step; the residual is that of the curve.
    pub(super) squares: Squares,
}

/// The curve through a window; none where the input is dead.
pub(super) fn fit(window: &Window, settings: &EstimatorSettings) -> Option<Drawn> {
    let EstimatorSettings {
        curve, transient, ..
    } = *settings;
    let degree = window.degree(curve, transient);
    let polynomial = polynomial(window, degree, transient)?;
    if curve != LocalModel::Rational || degree < 2 {
        return Some(polynomial);
    }
    let rational = rational(window, transient, |linear| {
        explains(&polynomial.fitted, linear) > WORTH_A_LOOK
    });
    Some(
        rational
            .filter(|found| explains(&polynomial.fitted, &found.fitted) > CALLED_FOR)
            .unwrap_or(polynomial),
    )
}

/// The power that a pole explains over that of the noise that is left: Fisher's F.
fn explains(polynomial: &Fitted, rational: &Fitted) -> f64 {
    let explained =
        (polynomial.residual - rational.residual) / (polynomial.freedom - rational.freedom);
    // 0/0 where the polynomial explains all: f64::max keeps the 0.
    (explained * rational.freedom / rational.residual).max(0.0)
}

impl Window {
    /// Whether there is input in the middle, or to both sides of it: beyond the outermost bin with input is no answer.
    fn encloses_input(&self) -> bool {
        let alive = || {
            self.x
                .iter()
                .zip(&self.input)
                .filter(|(_, u)| u.norm_sqr() > 0.0)
                .map(|(x, _)| *x)
        };
        alive().any(|x| x <= 0.0) && alive().any(|x| x >= 0.0)
    }

    /// The share of the output's power without this residual; an output that is not there is not coherent with anything.
    pub(super) fn coherence(&self, residual: f64) -> f64 {
        let power: f64 = self
            .output
            .iter()
            .zip(&self.root)
            .map(|(y, root)| y.norm_sqr() * root * root)
            .sum();
        if power > 0.0 {
            1.0 - residual / power
        } else {
            0.0
        }
    }

    /// The degree that so few bins allow: twice as many as there are unknowns, and one.
    fn degree(&self, curve: LocalModel, transient: bool) -> usize {
        let most = if curve == LocalModel::Constant { 0 } else { 2 };
        let alive = self.input.iter().filter(|u| u.norm_sqr() > 0.0).count();
        let unknowns = |degree: usize| (degree + 1) * if transient { 2 } else { 1 };
        (1..=most)
            .rev()
            .find(|degree| alive > 2 * unknowns(*degree))
            .unwrap_or(0)
    }

    /// root x^i `factor`, i = 0 ..= degree.
    fn powers(
        &self,
        degree: usize,
        factor: impl Fn(usize) -> Complex<f64>,
    ) -> Vec<Vec<Complex<f64>>> {
        let mut column: Vec<Complex<f64>> = self
            .root
            .iter()
            .enumerate()
            .map(|(j, r)| factor(j) * r)
            .collect();
        let mut columns = vec![column.clone()];
        for _ in 0..degree {
            column
                .iter_mut()
                .zip(&self.x)
                .for_each(|(entry, x)| *entry *= x);
            columns.push(column.clone());
        }
        columns
    }

    /// The columns of B U/A, and of T/A, with `below` = 1/A.
    fn numerators(
        &self,
        degree: usize,
        transient: bool,
        below: &[Complex<f64>],
    ) -> Vec<Vec<Complex<f64>>> {
        let mut columns = self.powers(degree, |j| self.input[j] * below[j]);
        if transient {
            columns.extend(self.powers(degree, |j| below[j]));
        }
        columns
    }

    fn fitted(&self, squares: &Squares) -> Fitted {
        let weighted = |of: &dyn Fn(usize) -> f64| {
            self.root
                .iter()
                .enumerate()
                .map(|(j, root)| root * root * of(j))
                .sum::<f64>()
        };
        let residual = squares.residual.iter().map(|e| e.norm_sqr()).sum();
        Fitted {
            response: squares.solution[0],
            gain: weighted(&|j| squares.first[j].norm_sqr()),
            residual,
            coherence: self.coherence(residual),
            enclosed: self.encloses_input(),
            freedom: weighted(&|j| 1.0 - squares.leverage[j]),
            width: 1.0 / weighted(&|j| (squares.first[j] * self.input[j]).norm_sqr()),
        }
    }
}

fn polynomial(window: &Window, degree: usize, transient: bool) -> Option<Drawn> {
    let columns = match transient {
        false => window.powers(degree, |j| window.input[j]),
        true => window.numerators(degree, true, &vec![Complex::from(1.0); window.x.len()]),
    };
    let right = window
        .output
        .iter()
        .zip(&window.root)
        .map(|(y, root)| y * root)
        .collect();
    let squares = squares::solve(columns, right)?;
    Some(Drawn {
        fitted: window.fitted(&squares),
        squares,
    })
}

fn rational(
    window: &Window,
    transient: bool,
    worth_a_look: impl Fn(&Fitted) -> bool,
) -> Option<Drawn> {
    let mut a = Complex::default();
    let mut over = Vec::new();
    for fit in 0..REWEIGHTED {
        let mut squares = reweighted(window, transient, a)?;
        if fit == 0 && !worth_a_look(&window.fitted(&squares)) {
            return None;
        }
        a = squares.solution.pop()?;
        over = squares.solution;
    }
    refined(window, transient, a, over)
}

/// The linear fit of (1 + a x) Y = B U, both sides over the denominator of the fit before.
fn reweighted(window: &Window, transient: bool, before: Complex<f64>) -> Option<Squares> {
    let below = below(window, before)?;
    let mut columns = window.numerators(2, transient, &below);
    let scaled = |j: usize| window.output[j] * below[j] * window.root[j];
    columns.push((0..below.len()).map(|j| -scaled(j) * window.x[j]).collect());
    squares::solve(columns, (0..below.len()).map(scaled).collect())
}

/// Steps of Gauss and Newton on the error of the output: d/da of B U/A is -x B U/A^2.
fn refined(
    window: &Window,
    transient: bool,
    mut a: Complex<f64>,
    mut over: Vec<Complex<f64>>,
) -> Option<Drawn> {
    for step in 0..STEPS {
        let below = below(window, a)?;
        let mut columns = window.numerators(2, transient, &below);
        let model = sum(&columns, &over);
        columns.push(
            (0..model.len())
                .map(|j| -model[j] * below[j] * window.x[j])
                .collect(),
        );
        let left = (0..model.len())
            .map(|j| window.output[j] * window.root[j] - model[j])
            .collect();
        let squares = squares::solve(columns, left)?;
        let change = *squares.solution.last()?;
        over.iter_mut()
            .zip(&squares.solution)
            .for_each(|(b, by)| *b += by);
        a += change;
        if change.norm() < SMALL || step + 1 == STEPS {
            // What the linear model leaves is what is left, up to the square of a small step.
            let fitted = Fitted {
                response: over[0],
                ..window.fitted(&squares)
            };
            return Some(Drawn { fitted, squares });
        }
    }
    None
}

/// 1/(1 + a x) at each bin, unless the pole is at one.
fn below(window: &Window, a: Complex<f64>) -> Option<Vec<Complex<f64>>> {
    let inverse = |x: &f64| {
        let denominator = a * *x + 1.0;
        (denominator.norm() > SHARPEST * a.norm()).then(|| denominator.inv())
    };
    window.x.iter().map(inverse).collect()
}

fn sum(columns: &[Vec<Complex<f64>>], factors: &[Complex<f64>]) -> Vec<Complex<f64>> {
    (0..columns[0].len())
        .map(|j| {
            columns
                .iter()
                .zip(factors)
                .map(|(column, b)| column[j] * b)
                .sum()
        })
        .collect()
}
