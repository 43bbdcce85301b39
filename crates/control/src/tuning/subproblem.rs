//! The linear programme of one step: the change of the parameters that makes the smallest slack largest.
//!
//! ```text
//!  maximise t   subject to   c_j + g_j . d >= t for all j,   low_i <= d_i <= high_i,   t <= MOST
//! ```
//!
//! Only few of the many slacks limit the step, so the programme begins with the smallest ones and adds those that its solution
//! violates. Slacks of neighbouring frequencies follow each other: of each valley the lowest one is enough.

use crate::convex::ConvexProgramme;

/// A slack c and its derivatives g.
#[derive(Clone, Debug)]
pub struct Row {
    /// c.
    pub value: f64,
    /// g.
    pub gradient: Vec<f64>,
}

impl Row {
    /// c + g . d.
    fn at(&self, step: &[f64]) -> f64 {
        let products = self.gradient.iter().zip(step).map(|(g, d)| g * d);
        self.value + products.sum::<f64>()
    }
}

/// A step and the smallest slack that the linear model predicts for it.
#[derive(Clone, Debug)]
pub struct Step {
    /// d.
    pub change: Vec<f64>,
    /// t.
    pub predicted: f64,
}

/// Upper limit of t, without which a programme whose rows are all positive were unbounded only in theory.
const MOST: f64 = 10.0;
/// A row is violated if its slack is smaller than t by more than this.
const TOLERANCE: f64 = 1e-7;
/// Rows of the first programme, and rows that are added to the next ones.
const ROWS: usize = 40;
/// Largest number of programmes.
const ROUNDS: usize = 12;

/// The best step within a box. `None` if the solver fails.
pub fn best_step(rows: &[Row], range: &[(f64, f64)]) -> Option<Step> {
    let values: Vec<f64> = rows.iter().map(|row| row.value).collect();
    let mut chosen = lowest_minima(&values);
    let mut step = None;
    for _ in 0..ROUNDS {
        let found = solve(rows, &chosen, range)?;
        let slacks: Vec<f64> = rows
            .iter()
            .map(|row| row.at(&found.change) - found.predicted)
            .collect();
        let violated: Vec<usize> = lowest_minima(&slacks)
            .into_iter()
            .filter(|j| slacks[*j] < -TOLERANCE && !chosen.contains(j))
            .collect();
        let worst = slacks.iter().copied().fold(0.0, f64::min);
        step = Some(Step {
            predicted: found.predicted + worst,
            change: found.change,
        });
        if violated.is_empty() {
            break;
        }
        chosen.extend(violated);
    }
    step
}

/// Indices of the smallest values that are not above their neighbours.
fn lowest_minima(values: &[f64]) -> Vec<usize> {
    let last = values.len().saturating_sub(1);
    let is_minimum = |i: &usize| {
        let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
        values[*i] <= values[before] && values[*i] <= values[after]
    };
    let mut indices: Vec<usize> = (0..values.len()).filter(is_minimum).collect();
    indices.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    indices.truncate(ROWS);
    indices
}

/// The programme with some of the rows. Its unknowns are d and t.
fn solve(rows: &[Row], chosen: &[usize], range: &[(f64, f64)]) -> Option<Step> {
    let n = range.len();
    let mut costs = vec![0.0; n];
    costs.push(-1.0);
    let mut programme = ConvexProgramme::linear(costs);
    for row in chosen.iter().map(|j| &rows[*j]) {
        let slopes = row.gradient.iter().map(|g| -g).enumerate();
        programme.at_most(slopes.chain([(n, 1.0)]), row.value);
    }
    for (i, (low, high)) in range.iter().enumerate() {
        programme.at_most([(i, -1.0)], -low);
        programme.at_most([(i, 1.0)], *high);
    }
    programme.at_most([(n, 1.0)], MOST);
    let solution = programme.solve()?;
    let (predicted, change) = solution.unknowns.split_last()?;
    let within = change.iter().zip(range);
    Some(Step {
        change: within
            .map(|(d, (low, high))| d.clamp(*low, *high))
            .collect(),
        predicted: *predicted,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(value: f64, gradient: &[f64]) -> Row {
        Row {
            value,
            gradient: gradient.to_vec(),
        }
    }

    #[test]
    fn step_balances_two_slacks() {
        // t <= 1 + d, t <= 3 - d: largest t = 2 at d = 1.
        let rows = [row(1.0, &[1.0]), row(3.0, &[-1.0])];
        let step = best_step(&rows, &[(-5.0, 5.0)]).unwrap();
        assert!((step.change[0] - 1.0).abs() < 1e-6 && (step.predicted - 2.0).abs() < 1e-6);
    }

    #[test]
    fn step_remains_within_its_range() {
        let rows = [row(1.0, &[1.0, 0.5]), row(3.0, &[-1.0, 0.0])];
        let step = best_step(&rows, &[(-0.2, 0.2), (-0.1, 0.3)]).unwrap();
        // t <= 1 + d1 + d2/2 is the smaller one in the whole range: the upper ends.
        assert!((step.change[0] - 0.2).abs() < 1e-6 && (step.change[1] - 0.3).abs() < 1e-6);
    }

    #[test]
    fn rows_that_were_left_out_limit_the_step() {
        // 200 rows t <= 1 + d and one row t <= 50 - 100 d beyond the first programme: t = 1 + d = 50 - 100 d.
        let mut rows = vec![row(1.0, &[1.0]); 200];
        rows.push(row(50.0, &[-100.0]));
        let step = best_step(&rows, &[(-5.0, 5.0)]).unwrap();
        assert!((step.change[0] - 49.0 / 101.0).abs() < 1e-6);
    }
}
