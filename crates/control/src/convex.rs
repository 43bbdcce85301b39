//! Convex programmes, solved by the interior-point method of clarabel.
//!
//! ```text
//!  minimise x' P x/2 + q' x   subject to   a_j . x <= b_j   and   |(c_2 . x + d_2, c_3 . x + d_3)| <= c_1 . x + d_1
//! ```
//!
//! P is diagonal. (P. J. Goulart, Y. Chen, Clarabel: an interior-point solver for conic programs with quadratic objectives, 2024.)

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus,
    SupportedConeT,
};

/// One unknown and its factor.
pub(crate) type Entry = (usize, f64);

/// A programme that rows are added to. The number of unknowns is that of the costs.
#[derive(Clone, Debug, Default)]
pub(crate) struct ConvexProgramme {
    /// The diagonal of P by unknowns; those that are not given are 0.
    weights: Vec<f64>,
    /// q.
    costs: Vec<f64>,
    rows: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    limits: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

/// The end of the iteration.
pub(crate) struct Solution {
    /// x.
    pub unknowns: Vec<f64>,
    /// Lower bound of the minimum, by the dual programme.
    pub lower_bound: f64,
    /// Whether the solver reached its tolerances. Otherwise it made no further progress near the solution.
    pub is_exact: bool,
}

impl ConvexProgramme {
    /// A programme with P = 0 and without rows.
    pub fn linear(costs: Vec<f64>) -> ConvexProgramme {
        ConvexProgramme::quadratic(Vec::new(), costs)
    }

    /// A programme without rows, from the diagonal of P and from q. Entries of the diagonal that are not given are 0.
    pub fn quadratic(weights: Vec<f64>, costs: Vec<f64>) -> ConvexProgramme {
        ConvexProgramme {
            weights,
            costs,
            ..ConvexProgramme::default()
        }
    }

    /// Adds an unknown without costs.
    pub fn unknown(&mut self) -> usize {
        self.costs.push(0.0);
        self.costs.len() - 1
    }

    /// Adds a . x <= b.
    pub fn at_most(&mut self, entries: impl IntoIterator<Item = Entry>, limit: f64) {
        self.row(entries, limit);
        match self.cones.last_mut() {
            Some(NonnegativeConeT(rows)) => *rows += 1,
            _ => self.cones.push(NonnegativeConeT(1)),
        }
    }

    /// Adds |(c_2 . x + d_2, c_3 . x + d_3)| <= c_1 . x + d_1, with the three pairs of c and d in this order.
    pub fn in_cone<E: IntoIterator<Item = Entry>>(&mut self, sides: [(E, f64); 3]) {
        for (entries, constant) in sides {
            let negated = entries
                .into_iter()
                .map(|(unknown, factor)| (unknown, -factor));
            self.row(negated, constant);
        }
        self.cones.push(SecondOrderConeT(3));
    }

    /// a . x + s = b with s in the cone of this row.
    fn row(&mut self, entries: impl IntoIterator<Item = Entry>, limit: f64) {
        for (unknown, factor) in entries {
            self.rows.push(self.limits.len());
            self.columns.push(unknown);
            self.values.push(factor);
        }
        self.limits.push(limit);
    }

    /// `None` if there is no solution or it is not found.
    pub fn solve(self) -> Option<Solution> {
        let (height, width) = (self.limits.len(), self.costs.len());
        let matrix =
            CscMatrix::new_from_triplets(height, width, self.rows, self.columns, self.values);
        let quadratic = diagonal(&self.weights, width);
        let settings = DefaultSettings {
            verbose: false,
            ..DefaultSettings::default()
        };
        let solver = DefaultSolver::new(
            &quadratic,
            &self.costs,
            &matrix,
            &self.limits,
            &self.cones,
            settings,
        );
        let mut solver = solver.ok()?;
        solver.solve();
        let solution = solver.solution;
        let is_exact = match solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => true,
            SolverStatus::InsufficientProgress => false,
            _ => return None,
        };
        let is_finite = solution.x.iter().all(|value| value.is_finite());
        is_finite.then_some(Solution {
            unknowns: solution.x,
            lower_bound: solution.obj_val_dual,
            is_exact,
        })
    }
}

/// A diagonal matrix; entries that are not given are 0.
fn diagonal(entries: &[f64], width: usize) -> CscMatrix<f64> {
    let places: Vec<usize> = (0..entries.len()).collect();
    CscMatrix::new_from_triplets(width, width, places.clone(), places, entries.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The point of the circle |x| <= 2 that is nearest to (3, 4): (1.2, 1.6). With x_1 <= 1, it is (1, sqrt 3).
    #[test]
    fn nearest_point_of_a_circle() {
        let mut programme = ConvexProgramme::quadratic(vec![2.0, 2.0], vec![-6.0, -8.0]);
        programme.in_cone([(vec![], 2.0), (vec![(0, 1.0)], 0.0), (vec![(1, 1.0)], 0.0)]);
        let whole = programme.clone().solve().expect("feasible");
        assert!((whole.unknowns[0] - 1.2).abs() < 1e-6 && (whole.unknowns[1] - 1.6).abs() < 1e-6);
        // |x - (3, 4)|^2 - 25 = 9 - 25.
        assert!(whole.is_exact && (whole.lower_bound + 16.0).abs() < 1e-5);
        programme.at_most([(0, 1.0)], 1.0);
        let cut = programme.clone().solve().expect("feasible");
        assert!((cut.unknowns[0] - 1.0).abs() < 1e-6);
        assert!((cut.unknowns[1] - 3_f64.sqrt()).abs() < 1e-6);
        programme.at_most([(0, -1.0)], -1.5);
        assert!(programme.solve().is_none(), "x_1 <= 1 and x_1 >= 1.5");
    }
}
