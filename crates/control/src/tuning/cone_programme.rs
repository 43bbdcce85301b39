//! Limits on magnitudes of complex affine functions, as second-order cones.
//!
//! ```text
//!  minimise v   subject to   weight |constant + sum of factors_n x_n| <= 1 + v        for each limit
//! ```

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus, SupportedConeT,
};
use nalgebra::Complex;

use crate::solver_settings::solver_settings;

/// weight |constant + sum of factors_n x_n|.
#[derive(Clone, Debug)]
pub struct Term {
    /// Factor of the magnitude.
    pub weight: f64,
    /// The part that does not depend on x.
    pub constant: Complex<f64>,
    /// One factor for each unknown.
    pub factors: Vec<Complex<f64>>,
}

/// A programme with the unknowns x, v, and one magnitude for each term of a sum.
#[derive(Clone, Debug)]
pub struct ConeProgramme {
    unknowns: usize,
    /// Magnitudes that are unknowns of their own.
    magnitudes: usize,
    rows: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    limits: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

impl ConeProgramme {
    /// A programme with `unknowns` unknowns x and without limits.
    pub fn new(unknowns: usize) -> ConeProgramme {
        ConeProgramme {
            unknowns,
            magnitudes: 0,
            rows: Vec::new(),
            columns: Vec::new(),
            values: Vec::new(),
            limits: Vec::new(),
            cones: Vec::new(),
        }
    }

    /// Adds the limit that a term is at most 1 + v.
    pub fn limit(&mut self, term: Term) {
        let violation = self.unknowns;
        self.push(self.limits.len(), violation, -1.0);
        self.limits.push(1.0);
        self.push_term(&term, term.weight);
    }

    /// Adds the limit that the sum of two terms is at most 1 + v.
    pub fn limit_sum(&mut self, first: Term, second: Term) {
        let violation = self.unknowns;
        let own = [&first, &second].map(|term| self.magnitude(term));
        let row = self.limits.len();
        self.push(row, violation, -1.0);
        for column in own {
            self.push(row, column, 1.0);
        }
        self.limits.push(1.0);
        self.cones.push(NonnegativeConeT(1));
    }

    /// An unknown that is at least the term.
    fn magnitude(&mut self, term: &Term) -> usize {
        self.magnitudes += 1;
        let column = self.unknowns + self.magnitudes;
        self.push(self.limits.len(), column, -1.0);
        self.limits.push(0.0);
        self.push_term(term, term.weight);
        column
    }

    /// Real and imaginary part of a term below the first row of its cone.
    fn push_term(&mut self, term: &Term, weight: f64) {
        let parts: [fn(&Complex<f64>) -> f64; 2] = [|z| z.re, |z| z.im];
        for part in parts {
            let row = self.limits.len();
            for (column, factor) in term.factors.iter().enumerate() {
                self.push(row, column, -weight * part(factor));
            }
            self.limits.push(weight * part(&term.constant));
        }
        self.cones.push(SecondOrderConeT(3));
    }

    fn push(&mut self, row: usize, column: usize, value: f64) {
        self.rows.push(row);
        self.columns.push(column);
        self.values.push(value);
    }

    /// The smallest v. `None` if the solver fails.
    pub fn least_violation(self) -> Option<f64> {
        let columns = self.unknowns + 1 + self.magnitudes;
        let matrix = CscMatrix::new_from_triplets(
            self.limits.len(),
            columns,
            self.rows,
            self.columns,
            self.values,
        );
        let mut objective = vec![0.0; columns];
        objective[self.unknowns] = 1.0;
        let quadratic = CscMatrix::zeros((columns, columns));
        let solver = DefaultSolver::new(
            &quadratic,
            &objective,
            &matrix,
            &self.limits,
            &self.cones,
            solver_settings(),
        );
        let mut solver = solver.ok()?;
        solver.solve();
        let solution = &solver.solution;
        let solved = matches!(
            solution.status,
            SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::InsufficientProgress
        );
        // The dual value is a lower bound of the violation: a target that it excludes is excluded.
        solved.then_some(solution.obj_val_dual)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn term(weight: f64, constant: f64, factor: Complex<f64>) -> Term {
        Term {
            weight,
            constant: Complex::new(constant, 0.0),
            factors: vec![factor],
        }
    }

    #[test]
    fn two_magnitudes_balance() {
        // |1 - x| <= 1 + v and 3 |x| <= 1 + v: x = 1/4, 1 + v = 3/4.
        let mut programme = ConeProgramme::new(1);
        programme.limit(term(1.0, 1.0, Complex::new(-1.0, 0.0)));
        programme.limit(term(3.0, 0.0, Complex::new(1.0, 0.0)));
        assert!((programme.least_violation().unwrap() + 0.25).abs() < 1e-6);
    }

    #[test]
    fn a_sum_of_magnitudes_is_limited() {
        // |1 - j x| + 2 |x| <= 1 + v: smallest at x = 0, where the first term has no slope: v = 0.
        let mut programme = ConeProgramme::new(1);
        let first = term(1.0, 1.0, Complex::new(0.0, -1.0));
        programme.limit_sum(first, term(2.0, 0.0, Complex::new(1.0, 0.0)));
        assert!(programme.least_violation().unwrap().abs() < 1e-6);
    }
}
