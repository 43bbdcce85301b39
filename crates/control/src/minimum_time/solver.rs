//! The programme of the blocks, as rows.

use crate::convex::ConvexProgramme;

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
    let mut programme = objective(count);
    for row in rows {
        let coefficients = row.coefficients.iter().copied().enumerate();
        let needed = coefficients.filter(|(_, coefficient)| *coefficient != 0.0);
        if row.is_error {
            programme.at_most(needed.chain([(count, -1.0)]), -row.rest);
        } else {
            programme.at_most(needed, 1.0 - row.rest);
        }
    }
    for block in 0..count {
        programme.at_most([(block, 1.0)], bound);
        programme.at_most([(block, -1.0)], bound);
    }
    let solution = programme.solve().filter(|solution| solution.is_exact)?;
    let (error, blocks) = solution.unknowns.split_last()?;
    Some(Solution {
        blocks: blocks.to_vec(),
        error: *error,
    })
}

/// t + SMOOTHNESS sum (x - 1)^2, without rows. The unknowns are x, then t.
fn objective(count: usize) -> ConvexProgramme {
    let mut costs = vec![-2.0 * SMOOTHNESS; count];
    costs.push(1.0);
    ConvexProgramme::quadratic(vec![2.0 * SMOOTHNESS; count], costs)
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
