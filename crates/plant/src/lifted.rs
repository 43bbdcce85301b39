//! A mode over blocks of ticks, for the readings of a known sequence of commands.
//!
//! ```text
//! x(k + n) = A^n x(k) + sum over i < n of A^(n-1-i) B u(k + i)                    x = [q, q'/w, current],  n = 4 ticks
//! y(k + j) = C A^j x(k) + D u(k + j) + sum over i < j of C A^(j-1-i) B u(k + i)   for each output, j < n
//! ```
//!
//! Tick by tick each state waits for the one before it. Over a block only one state in n does, and the processor computes the n outputs
//! together. The coefficients are the states and outputs of n steps from a unit state, or with a set-point of 1 at one tick.

use super::DiscreteMode;

/// Ticks of a block. Blocks of 8 have more products for each tick, and took a fifth longer.
pub(super) const BLOCK: usize = 4;

/// [q, q'/w, current].
type State = [f64; 3];

/// What is measured of a mode and of the current, and when: row . [q, q'/w] + current i + setpoint u, `periods` later.
pub(super) struct Output {
    pub(super) periods: usize,
    pub(super) row: [f64; 2],
    pub(super) current: f64,
    pub(super) setpoint: f64,
}

/// A mode and the amplifier's current over a block.
pub(super) struct LiftedMode {
    /// The state after a block by each element of that before it.
    by_state: [State; 3],
    /// The state after a block by the set-point of each tick.
    by_setpoint: [State; BLOCK],
    outputs: Vec<LiftedOutput>,
}

/// The outputs of a block.
struct LiftedOutput {
    periods: usize,
    /// By each element of the state before the block.
    by_state: [[f64; BLOCK]; 3],
    /// By the set-point of each tick.
    by_setpoint: [[f64; BLOCK]; BLOCK],
}

impl Output {
    fn of(&self, x: State, setpoint: f64) -> f64 {
        self.row[0] * x[0] + self.row[1] * x[1] + self.current * x[2] + self.setpoint * setpoint
    }
}

/// The states before each tick of a block, and the one after it. `lag` is that of [`super::DiscretePlant`].
fn steps(
    mode: &DiscreteMode,
    lag: f64,
    from: State,
    setpoints: &[f64; BLOCK],
) -> ([State; BLOCK], State) {
    let mut x = from;
    let states = setpoints.map(|u| {
        let before = x;
        let [q, rate] = mode.advanced([x[0], x[1]], x[2], u, 0.0);
        x = [q, rate, u + (x[2] - u) * lag];
        before
    });
    (states, x)
}

/// 1 at one index, and 0 elsewhere.
fn unit<const N: usize>(index: usize) -> [f64; N] {
    std::array::from_fn(|k| if k == index { 1.0 } else { 0.0 })
}

impl LiftedMode {
    pub(super) fn new(mode: &DiscreteMode, lag: f64, outputs: &[Output]) -> LiftedMode {
        let by_state = [0, 1, 2].map(|element| steps(mode, lag, unit(element), &[0.0; BLOCK]));
        let by_setpoint: [_; BLOCK] =
            std::array::from_fn(|tick| steps(mode, lag, [0.0; 3], &unit(tick)));
        let outputs = outputs.iter().map(|output| LiftedOutput {
            periods: output.periods,
            by_state: by_state.map(|(states, _)| states.map(|x| output.of(x, 0.0))),
            by_setpoint: std::array::from_fn(|tick| {
                let setpoints: [f64; BLOCK] = unit(tick);
                let (states, _) = by_setpoint[tick];
                std::array::from_fn(|j| output.of(states[j], setpoints[j]))
            }),
        });
        LiftedMode {
            outputs: outputs.collect(),
            by_state: by_state.map(|(_, after)| after),
            by_setpoint: by_setpoint.map(|(_, after)| after),
        }
    }

    /// Adds the outputs from rest to the readings: that of each tick `periods` later. There are as many readings as set-points, a
    /// block more, and the periods of each output.
    pub(super) fn add_to(&self, readings: &mut [f64], setpoints: &[f64]) {
        let (blocks, rest) = setpoints.as_chunks::<BLOCK>();
        let mut last = [0.0; BLOCK];
        last[..rest.len()].copy_from_slice(rest);
        let mut x = [0.0; 3];
        for (block, u) in blocks.iter().chain([&last]).enumerate() {
            for output in &self.outputs {
                let first = BLOCK * block + output.periods;
                let sum = output.of(x, u);
                let readings = &mut readings[first..first + BLOCK];
                readings.iter_mut().zip(sum).for_each(|(y, sum)| *y += sum);
            }
            x = self.after(x, u);
        }
    }

    /// The state after a block. The part of the set-points first: it need not wait for the state.
    fn after(&self, x: State, setpoints: &[f64; BLOCK]) -> State {
        let mut sum = [0.0; 3];
        add_products(&mut sum, &self.by_setpoint, setpoints);
        add_products(&mut sum, &self.by_state, &x);
        sum
    }
}

impl LiftedOutput {
    fn of(&self, x: State, setpoints: &[f64; BLOCK]) -> [f64; BLOCK] {
        let mut sum = [0.0; BLOCK];
        add_products(&mut sum, &self.by_setpoint, setpoints);
        add_products(&mut sum, &self.by_state, &x);
        sum
    }
}

/// Adds the columns times their factors to a sum.
fn add_products<const N: usize, const M: usize>(
    sum: &mut [f64; N],
    columns: &[[f64; N]; M],
    factors: &[f64; M],
) {
    for (column, factor) in columns.iter().zip(factors) {
        for (sum, element) in sum.iter_mut().zip(column) {
            *sum += element * factor;
        }
    }
}
