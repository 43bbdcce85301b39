//! Limits on magnitudes of complex affine functions, as second-order cones.
//!
//! ```text
//!  minimise v   subject to   weight |constant + sum of factors_n x_n| <= 1 + v        for each limit
//! ```

use nalgebra::Complex;

use crate::convex::{ConvexProgramme, Entry};

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
    /// Place of v among the unknowns.
    violation: usize,
    programme: ConvexProgramme,
}

impl ConeProgramme {
    /// A programme with `unknowns` unknowns x and without limits.
    pub fn new(unknowns: usize) -> ConeProgramme {
        let mut costs = vec![0.0; unknowns];
        costs.push(1.0);
        ConeProgramme {
            violation: unknowns,
            programme: ConvexProgramme::linear(costs),
        }
    }

    /// Adds the limit that a term is at most 1 + v.
    pub fn limit(&mut self, term: Term) {
        self.limit_by(&term, self.violation, 1.0);
    }

    /// Adds the limit that the sum of two terms is at most 1 + v.
    pub fn limit_sum(&mut self, first: Term, second: Term) {
        let [first, second] = [&first, &second].map(|term| self.magnitude(term));
        let sum = [(self.violation, -1.0), (first, 1.0), (second, 1.0)];
        self.programme.at_most(sum, 1.0);
    }

    /// An unknown that is at least the term.
    fn magnitude(&mut self, term: &Term) -> usize {
        let unknown = self.programme.unknown();
        self.limit_by(term, unknown, 0.0);
        unknown
    }

    /// Adds the limit that a term is at most an unknown and a constant.
    fn limit_by(&mut self, term: &Term, unknown: usize, constant: f64) {
        let side = |part: fn(&Complex<f64>) -> f64| {
            let factors = term.factors.iter().map(|factor| term.weight * part(factor));
            let entries: Vec<Entry> = factors.enumerate().collect();
            (entries, term.weight * part(&term.constant))
        };
        let sides = [
            (vec![(unknown, 1.0)], constant),
            side(|z| z.re),
            side(|z| z.im),
        ];
        self.programme.in_cone(sides);
    }

    /// The smallest v. `None` if the solver fails.
    pub fn least_violation(self) -> Option<f64> {
        // The dual value is a lower bound of the violation: a target that it excludes is excluded.
        Some(self.programme.solve()?.lower_bound)
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
