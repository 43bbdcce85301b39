//! The linear programme of a settling time, with constraints added where a solution violates them.

use std::collections::BTreeSet;

use super::limits::{StepLimits, StepTiming};
use super::responses::{BlockResponse, StepPlant};
use super::solver::{self, Row};

/// A constraint may be violated by this ratio of its limit.
const TOLERANCE: f64 = 1e-4;
/// Largest number of solutions for one settling time. Some ten are needed.
const MAX_ROUNDS: usize = 60;
/// A first solution obeys each constraint at every so many ticks.
const FIRST_STRIDE: usize = 25;

/// What a constraint limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Quantity {
    /// The error from the settling time on.
    Error,
    Current,
    Change,
    Travel,
    Overshoot,
}

const QUANTITIES: [Quantity; 5] = [
    Quantity::Error,
    Quantity::Current,
    Quantity::Change,
    Quantity::Travel,
    Quantity::Overshoot,
];

/// A quantity of a plant at a tick, from above or from below.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Constraint {
    plant: usize,
    quantity: Quantity,
    tick: usize,
    is_upper: bool,
}

/// Largest current and overshoot of all plants.
pub(super) struct PlannedExtremes {
    pub current_a: f64,
    pub overshoot_m: f64,
}

/// The programmes of one step. Constraints that were active for one settling time are kept for the next.
pub(super) struct Programme<'a> {
    plants: &'a [StepPlant],
    limits: &'a StepLimits,
    timing: StepTiming,
    constraints: BTreeSet<Constraint>,
}

impl<'a> Programme<'a> {
    pub(super) fn new(
        plants: &'a [StepPlant],
        limits: &'a StepLimits,
        timing: StepTiming,
    ) -> Programme<'a> {
        let mut programme = Programme {
            plants,
            limits,
            timing,
            constraints: BTreeSet::new(),
        };
        for plant in 0..plants.len() {
            programme.add_first(plant);
        }
        programme
    }

    fn ticks(&self) -> usize {
        self.plants.first().map_or(0, |plant| plant.position.len())
    }

    fn add_first(&mut self, plant: usize) {
        for tick in (0..self.ticks()).step_by(FIRST_STRIDE) {
            for (quantity, is_upper) in [(Quantity::Error, true), (Quantity::Error, false)] {
                self.constraints.insert(Constraint {
                    plant,
                    quantity,
                    tick,
                    is_upper,
                });
            }
        }
    }

    /// The values of the blocks, over the height of the step, with which every plant settles within `settling_ticks`; `None` if
    /// there are none.
    pub(super) fn solve(&mut self, settling_ticks: usize) -> Option<Vec<f64>> {
        for _ in 0..MAX_ROUNDS {
            let rows: Vec<Row> = self.rows(settling_ticks);
            let bound = self.limits.travel_m / self.limits.height_m;
            let solution = solver::minimise(self.timing.blocks, &rows, bound)?;
            // Fewer constraints allow a smaller error.
            if solution.error > 1.0 + TOLERANCE {
                return None;
            }
            let violated = self.violated(settling_ticks, &solution.blocks);
            let count = self.constraints.len();
            self.constraints.extend(violated.iter().copied());
            if violated.is_empty() {
                return Some(solution.blocks);
            }
            if self.constraints.len() == count {
                // All of them are in the programme: the solver is not more accurate.
                return None;
            }
        }
        None
    }

    fn rows(&self, settling_ticks: usize) -> Vec<Row> {
        let applies = |c: &&Constraint| c.quantity != Quantity::Error || c.tick >= settling_ticks;
        let constraints = self.constraints.iter().filter(applies);
        constraints.map(|c| self.row(c)).collect()
    }

    fn row(&self, constraint: &Constraint) -> Row {
        let response = self.response(constraint.plant, constraint.quantity);
        let (scale, offset) = self.scale(constraint.quantity);
        let sign = if constraint.is_upper { 1.0 } else { -1.0 };
        let blocks = 0..self.timing.blocks;
        let coefficients =
            blocks.map(|block| sign * scale * response.coefficient(constraint.tick, block));
        Row {
            coefficients: coefficients.collect(),
            is_error: constraint.quantity == Quantity::Error,
            rest: sign * (scale * response.rest(constraint.tick) - offset),
        }
    }

    /// Each quantity as a signal times a scale minus an offset, so that its limit is 1.
    fn scale(&self, quantity: Quantity) -> (f64, f64) {
        let limits = self.limits;
        let height_m = limits.height_m;
        match quantity {
            Quantity::Error => (height_m / limits.error_m, height_m / limits.error_m),
            Quantity::Current => (height_m / limits.current_a, 0.0),
            Quantity::Change => (height_m / limits.change_a, 0.0),
            Quantity::Travel => (height_m / limits.travel_m, 0.0),
            Quantity::Overshoot => {
                let highest_m = height_m + limits.overshoot_m.unwrap_or(f64::INFINITY);
                (height_m / highest_m, 0.0)
            }
        }
    }

    fn response(&self, plant: usize, quantity: Quantity) -> BlockResponse<'a> {
        let plant = &self.plants[plant];
        let step = match quantity {
            Quantity::Error | Quantity::Travel | Quantity::Overshoot => &plant.position,
            Quantity::Current => &plant.current_a_per_m,
            Quantity::Change => &plant.change_a_per_m,
        };
        BlockResponse {
            step,
            block_ticks: self.timing.block_ticks,
            blocks: self.timing.blocks,
        }
    }

    /// The constraints that a solution violates most: the largest value of each excursion beyond a limit.
    fn violated(&self, settling_ticks: usize, blocks: &[f64]) -> Vec<Constraint> {
        let mut violated = Vec::new();
        for plant in 0..self.plants.len() {
            for quantity in QUANTITIES {
                let values = self.values(plant, quantity, settling_ticks, blocks);
                excursions(&values, |tick, is_upper| {
                    violated.push(Constraint {
                        plant,
                        quantity,
                        tick,
                        is_upper,
                    });
                });
            }
        }
        violated.retain(|constraint| self.is_limited(constraint));
        violated
    }

    /// Whether there is such a limit: an overshoot only upwards, and only if it is limited.
    fn is_limited(&self, constraint: &Constraint) -> bool {
        constraint.quantity != Quantity::Overshoot
            || constraint.is_upper && self.limits.overshoot_m.is_some()
    }

    /// A quantity over its limit at each tick; 0 where it is not limited.
    fn values(
        &self,
        plant: usize,
        quantity: Quantity,
        settling_ticks: usize,
        blocks: &[f64],
    ) -> Vec<f64> {
        let response = self.response(plant, quantity);
        let (scale, offset) = self.scale(quantity);
        let first = match quantity {
            Quantity::Error => settling_ticks,
            _ => 0,
        };
        let value = |tick| {
            if tick < first {
                0.0
            } else {
                scale * response.at(tick, blocks) - offset
            }
        };
        (0..self.ticks()).map(value).collect()
    }

    /// The extremes of a solution.
    pub(super) fn extremes(&self, blocks: &[f64]) -> PlannedExtremes {
        let height_m = self.limits.height_m;
        let mut extremes = PlannedExtremes {
            current_a: 0.0,
            overshoot_m: 0.0,
        };
        for plant in 0..self.plants.len() {
            let current = self.response(plant, Quantity::Current);
            let position = self.response(plant, Quantity::Travel);
            for tick in 0..self.ticks() {
                let current_a = height_m * current.at(tick, blocks).abs();
                let beyond_m = height_m * (position.at(tick, blocks) - 1.0);
                extremes.current_a = extremes.current_a.max(current_a);
                extremes.overshoot_m = extremes.overshoot_m.max(beyond_m);
            }
        }
        extremes
    }
}

/// Calls `found` with the tick and the side of the largest magnitude of each run of values beyond 1 on one side.
fn excursions(values: &[f64], mut found: impl FnMut(usize, bool)) {
    let mut largest: Option<usize> = None;
    for (tick, value) in values.iter().enumerate() {
        let is_beyond = value.abs() > 1.0 + TOLERANCE;
        let continues = largest.is_some_and(|at| (values[at] > 0.0) == (*value > 0.0));
        if let Some(at) = largest.filter(|_| !is_beyond || !continues) {
            found(at, values[at] > 0.0);
            largest = None;
        }
        if is_beyond && largest.is_none_or(|at| value.abs() > values[at].abs()) {
            largest = Some(tick);
        }
    }
    if let Some(at) = largest {
        found(at, values[at] > 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_excursion_beyond_the_limit_is_found_at_its_peak() {
        let values = [0.0, 1.5, 1.2, -1.1, -3.0, 0.5, 1.0, 2.0];
        let mut found = Vec::new();
        excursions(&values, |tick, is_upper| found.push((tick, is_upper)));
        assert_eq!(found, [(1, true), (4, false), (7, true)]);
    }
}
