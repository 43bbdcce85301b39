//! Complex least squares by the modified Gram-Schmidt process.
//!
//! The right side is orthogonalised like another column, which makes the solution as accurate as Householder's (A. Bjorck, BIT
//! 7 (1967) 1): the error grows with the condition of the columns, not with its square as by normal equations. Columns need no
//! scaling: no step compares one with another.

use nalgebra::Complex;

/// A column of which less than this part is left beside the others says nothing of its own.
const ALIKE: f64 = 1e-10;

/// What solves min |right - sum of solution_i column_i|^2.
pub(super) struct Squares {
    pub(super) solution: Vec<Complex<f64>>,
    /// right - sum of solution_i column_i
    pub(super) residual: Vec<Complex<f64>>,
    /// g of solution_0 = sum over rows of g_j right_j.
    pub(super) first: Vec<Complex<f64>>,
    /// Share of each row in its own fit, the diagonal of the projection.
    pub(super) leverage: Vec<f64>,
}

/// Solves for `columns`, of equal length with `right`; `None` where they are not independent, or not finite.
pub(super) fn solve(
    mut columns: Vec<Vec<Complex<f64>>>,
    mut right: Vec<Complex<f64>>,
) -> Option<Squares> {
    let count = columns.len();
    // R of columns = Q R, row by row, with Q* right as its last column.
    let mut above = vec![vec![Complex::default(); count + 1]; count];
    for d in 0..count {
        let (done, rest) = columns.split_at_mut(d + 1);
        let q = &mut done[d];
        let before = above[..d].iter().map(|row| row[d].norm_sqr()).sum::<f64>();
        let left = power(q);
        // A NaN compares as false.
        if !(left > ALIKE * ALIKE * (left + before) && left.is_finite()) {
            return None;
        }
        let size = left.sqrt();
        q.iter_mut().for_each(|x| *x = x.unscale(size));
        above[d][d] = Complex::from(size);
        for (e, column) in rest.iter_mut().enumerate() {
            above[d][d + 1 + e] = take_off(q, column);
        }
        above[d][count] = take_off(q, &mut right);
    }
    let solution = back(&above, |d| above[d][count]);
    Some(Squares {
        solution,
        residual: right,
        first: first(&columns, &above),
        leverage: leverage(&columns),
    })
}

fn power(column: &[Complex<f64>]) -> f64 {
    column.iter().map(|x| x.norm_sqr()).sum()
}

/// Takes the part along `q`, of length 1, off a column; returns it.
fn take_off(q: &[Complex<f64>], column: &mut [Complex<f64>]) -> Complex<f64> {
    let along: Complex<f64> = q.iter().zip(&*column).map(|(q, x)| q.conj() * x).sum();
    column.iter_mut().zip(q).for_each(|(x, q)| *x -= q * along);
    along
}

/// R^-1 times what `right` gives.
fn back(above: &[Vec<Complex<f64>>], right: impl Fn(usize) -> Complex<f64>) -> Vec<Complex<f64>> {
    let mut solution = vec![Complex::default(); above.len()];
    for d in (0..above.len()).rev() {
        let known: Complex<f64> = (d + 1..above.len())
            .map(|e| above[d][e] * solution[e])
            .sum();
        solution[d] = (right(d) - known) / above[d][d];
    }
    solution
}

/// The first row of R^-1 Q*.
fn first(q: &[Vec<Complex<f64>>], above: &[Vec<Complex<f64>>]) -> Vec<Complex<f64>> {
    // Row 0 of R^-1, v R = (1, 0, ...), column by column.
    let mut row = vec![Complex::default(); above.len()];
    for d in 0..above.len() {
        let known: Complex<f64> = (0..d).map(|e| row[e] * above[e][d]).sum();
        let one = if d == 0 {
            Complex::from(1.0)
        } else {
            Complex::default()
        };
        row[d] = (one - known) / above[d][d];
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
