//! The linear programme as matrices for the interior-point solver.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, SupportedConeT};

use crate::solver_settings::solver_settings;

/// Weight of sum (x - 1)^2 beside t: of several solutions the one with the smoothest reference.
const SMOOTHNESS: f64 = 1e-6;

/// A constraint coefficients . x + rest <= 1; for an error, <= t.
pub(super) struct Row {
    pub coefficients: Vec<f64>,
    pub is_error: bool,
    pub rest: f64,
}

/// The values of the blocks, and the largest error over its limit.
pub(super) struct Solution {
    pub blocks: Vec<f64>,
    pub error: f64,
}

/// Minimises t over the values x of `count` blocks, each at most `bound` in magnitude. `None` if there is no solution.
pub(super) fn minimise(count: usize, rows: &[Row], bound: f64) -> Option<Solution> {
    let (matrix, limits) = constraints(count, rows, bound);
    let (weights, costs) = objective(count);
    let cones: [SupportedConeT<f64>; 1] = [NonnegativeConeT(limits.len())];
    let settings = solver_settings();
    let mut solver =
        DefaultSolver::new(&weights, &costs, &matrix, &limits, &cones, settings).ok()?;
    solver.solve();
    let solution = &solver.solution;
    let is_solved = matches!(
        solution.status,
        SolverStatus::Solved | SolverStatus::AlmostSolved
    );
    let (error, blocks) = solution.x.split_last()?;
    let is_finite = solution.x.iter().all(|value| value.is_finite());
    (is_solved && is_finite).then(|| Solution {
        blocks: blocks.to_vec(),
        error: *error,
    })
}

/// A z <= b for z = (x, t): the rows, then the bounds of x from above and below.
fn constraints(count: usize, rows: &[Row], bound: f64) -> (CscMatrix<f64>, Vec<f64>) {
    let height = rows.len() + 2 * count;
    let (mut starts, mut places, mut values) = (vec![0], Vec::new(), Vec::new());
    for block in 0..count {
        for (place, row) in rows.iter().enumerate() {
            if row.coefficients[block] != 0.0 {
                places.push(place);
                values.push(row.coefficients[block]);
            }
        }
        places.extend([rows.len() + 2 * block, rows.len() + 2 * block + 1]);
        values.extend([1.0, -1.0]);
        starts.push(places.len());
    }
    for (place, _) in rows.iter().enumerate().filter(|(_, row)| row.is_error) {
        places.push(place);
        values.push(-1.0);
    }
    starts.push(places.len());
    let limit = |row: &Row| {
        if row.is_error {
            -row.rest
        } else {
            1.0 - row.rest
        }
    };
    let mut limits: Vec<f64> = rows.iter().map(limit).collect();
    limits.extend(vec![bound; 2 * count]);
    let matrix = CscMatrix::new(height, count + 1, starts, places, values);
    (matrix, limits)
}

/// t + SMOOTHNESS sum (x - 1)^2, as z' P z/2 + q' z.
fn objective(count: usize) -> (CscMatrix<f64>, Vec<f64>) {
    let mut starts: Vec<usize> = (0..=count).collect();
    starts.push(count);
    let weights = vec![2.0 * SMOOTHNESS; count];
    let matrix = CscMatrix::new(count + 1, count + 1, starts, (0..count).collect(), weights);
    let mut costs = vec![-2.0 * SMOOTHNESS; count];
    costs.push(1.0);
    (matrix, costs)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// min max(|x1 - 3|, |x2 + 1|) with x1 <= 2, x2 <= 1 and |x| <= 10: t = 1, x1 = 2, x2 anywhere within -2 ... 0.
    #[test]
    fn solution_of_a_small_programme_is_that_of_its_geometry() {
        let row = |coefficients: [f64; 2], is_error, rest| Row {
            coefficients: coefficients.to_vec(),
            is_error,
            rest,
        };
        let rows = [
            row([1.0, 0.0], true, -3.0),
            row([-1.0, 0.0], true, 3.0),
            row([0.0, 1.0], true, 1.0),
            row([0.0, -1.0], true, -1.0),
            row([1.0, 0.0], false, -1.0),
            row([0.0, 1.0], false, 0.0),
        ];
        let solution = minimise(2, &rows, 10.0).expect("feasible");
        // The weight of the smoothness moves t by at most 1e-6 times a few.
        assert!((solution.error - 1.0).abs() < 1e-5, "{}", solution.error);
        assert!((solution.blocks[0] - 2.0).abs() < 1e-5);
        assert!((-2.0 - 1e-5..1e-5).contains(&solution.blocks[1]));
        let impossible = [row([1.0, 0.0], false, 0.0), row([-1.0, 0.0], false, 3.0)];
        assert!(minimise(2, &impossible, 10.0).is_none());
    }
}
