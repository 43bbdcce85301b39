//! Complex least squares by the modified Gram-Schmidt process.
//!
//! The right side is orthogonalised like another column, which makes the solution as accurate as Householder's method
//! (A. Bjorck, BIT 7 (1967) 1): the error grows with the condition number of the columns, not with its square as with normal
//! equations. Columns need no scaling, as no step compares one with another.

use nalgebra::Complex;

/// A column is linearly dependent if less than this ratio of it is orthogonal to the others.
const DEPENDENT_RATIO: f64 = 1e-10;

/// The solution of min |right - sum of solution_i column_i|^2.
pub(crate) struct LeastSquares {
    pub(crate) solution: Vec<Complex<f64>>,
    /// right - sum of solution_i column_i
    pub(crate) residual: Vec<Complex<f64>>,
    /// g in solution_0 = sum over rows of g_j right_j.
    pub(crate) gradient: Vec<Complex<f64>>,
    /// Influence of each row on its own fit: the diagonal of the projection.
    pub(crate) leverage: Vec<f64>,
}

/// Solves for `columns`, of the same length as `right`; `None` where they are linearly dependent or not finite.
pub(crate) fn solve(
    mut columns: Vec<Vec<Complex<f64>>>,
    mut right: Vec<Complex<f64>>,
) -> Option<LeastSquares> {
    let upper = orthogonalize(&mut columns, &mut right)?;
    Some(LeastSquares {
        solution: back_substitution(&upper),
        residual: right,
        gradient: gradient(&columns, &upper),
        leverage: leverage(&columns),
    })
}

/// Replaces the columns by Q and the right side by the residual. Returns R of columns = Q R, row by row, with Q* right as its
/// last column.
fn orthogonalize(
    columns: &mut [Vec<Complex<f64>>],
    right: &mut [Complex<f64>],
) -> Option<Vec<Vec<Complex<f64>>>> {
    let count = columns.len();
    let mut upper = vec![vec![Complex::default(); count + 1]; count];
    for d in 0..count {
        let (done, rest) = columns.split_at_mut(d + 1);
        let q = &mut done[d];
        let removed = upper[..d].iter().map(|row| row[d].norm_sqr()).sum::<f64>();
        upper[d][d] = Complex::from(normalize(q, removed)?);
        for (e, column) in rest.iter_mut().enumerate() {
            upper[d][d + 1 + e] = subtract_projection(q, column);
        }
        upper[d][count] = subtract_projection(q, right);
    }
    Some(upper)
}

/// Scales a column to length 1 and returns its length; `None` if it is too small compared with the part that was removed.
fn normalize(column: &mut [Complex<f64>], removed: f64) -> Option<f64> {
    let remaining: f64 = column.iter().map(|x| x.norm_sqr()).sum();
    let independent = remaining > DEPENDENT_RATIO * DEPENDENT_RATIO * (remaining + removed);
    // A comparison with NaN is false.
    if !(independent && remaining.is_finite()) {
        return None;
    }
    let length = remaining.sqrt();
    column.iter_mut().for_each(|x| *x = x.unscale(length));
    Some(length)
}

/// Subtracts the projection on `q`, of length 1, from a column; returns its coefficient.
fn subtract_projection(q: &[Complex<f64>], column: &mut [Complex<f64>]) -> Complex<f64> {
    let projection: Complex<f64> = q.iter().zip(&*column).map(|(q, x)| q.conj() * x).sum();
    column
        .iter_mut()
        .zip(q)
        .for_each(|(x, q)| *x -= q * projection);
    projection
}

/// R^-1 Q* right.
fn back_substitution(upper: &[Vec<Complex<f64>>]) -> Vec<Complex<f64>> {
    let count = upper.len();
    let mut solution = vec![Complex::default(); count];
    for d in (0..count).rev() {
        let known: Complex<f64> = (d + 1..count).map(|e| upper[d][e] * solution[e]).sum();
        solution[d] = (upper[d][count] - known) / upper[d][d];
    }
    solution
}

/// The first row of R^-1 Q*.
fn gradient(q: &[Vec<Complex<f64>>], upper: &[Vec<Complex<f64>>]) -> Vec<Complex<f64>> {
    // Row 0 of R^-1, v R = (1, 0, ...), column by column.
    let mut row = vec![Complex::default(); upper.len()];
    for d in 0..upper.len() {
        let known: Complex<f64> = (0..d).map(|e| row[e] * upper[e][d]).sum();
        let one = if d == 0 {
            Complex::from(1.0)
        } else {
            Complex::default()
        };
        row[d] = (one - known) / upper[d][d];
    }
    (0..q[0].len())
        .map(|j| row.iter().zip(q).map(|(v, q)| v * q[j].conj()).sum())
        .collect()
}

fn leverage(q: &[Vec<Complex<f64>>]) -> Vec<f64> {
    (0..q[0].len())
        .map(|j| q.iter().map(|q| q[j].norm_sqr()).sum())
        .collect()
}
