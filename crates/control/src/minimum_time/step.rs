//! The fastest step: bisection over the settling time.

use super::limits::{StepLimits, StepTiming};
use super::programme::Programme;
use super::responses::StepPlant;
use bench_excitation::command::{Tap, Taps};

/// The fastest step.
#[derive(Clone, Debug, PartialEq)]
pub struct MinimumTime {
    /// The filter that makes the reference of the loop from a step.
    pub taps: Taps,
    /// Ticks from the step on after which the error of every plant is within its limit.
    pub settling_ticks: usize,
    /// Largest current of the plants in amperes.
    pub current_a: f64,
    /// Largest overshoot of the plants in metres.
    pub overshoot_m: f64,
}

/// A step that cannot be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MinimumTimeError {
    /// No reference settles within the time of all blocks.
    #[error(
        "no reference within the limits settles all {plants} planned plants within {ticks} ticks: current {current_a:.2} A, error {error_um:.3} um; lower the step, raise control.shaper.longest_s, or narrow the range of control.shaper (operating_points_m, frequency_tolerance_ratio)"
    )]
    Infeasible {
        /// Number of plants.
        plants: usize,
        /// The time.
        ticks: usize,
        /// The limit of the current.
        current_a: f64,
        /// The permitted error.
        error_um: f64,
    },
    /// A response that is not finite, or nothing to plan.
    #[error(
        "the step responses of the planned plants are not finite; check the model with `bench model modes` and the loop with `bench margins`"
    )]
    NotFinite,
}

/// The fastest step of all `plants`, whose responses are equally long. The time to settle is at most that of all blocks.
///
/// # Errors
/// If no reference settles within this time, or a response is not finite.
pub fn minimum_time(
    plants: &[StepPlant],
    limits: &StepLimits,
    timing: StepTiming,
) -> Result<MinimumTime, MinimumTimeError> {
    if plants.is_empty() || !plants.iter().all(StepPlant::is_finite) {
        return Err(MinimumTimeError::NotFinite);
    }
    let mut programme = Programme::new(plants, limits, timing);
    let (settling_ticks, blocks) =
        least_settling(&mut programme, timing).ok_or_else(|| MinimumTimeError::Infeasible {
            plants: plants.len(),
            ticks: timing.block_ticks * timing.blocks,
            current_a: limits.current_a,
            error_um: limits.error_m * 1e6,
        })?;
    let extremes = programme.extremes(&blocks);
    Ok(MinimumTime {
        taps: taps(&blocks, timing.block_ticks),
        settling_ticks,
        current_a: extremes.current_a,
        overshoot_m: extremes.overshoot_m,
    })
}

/// The least settling tick with a solution, by bisection, and the values of its blocks.
fn least_settling(programme: &mut Programme<'_>, timing: StepTiming) -> Option<(usize, Vec<f64>)> {
    let (mut impossible, mut possible) = (0, timing.block_ticks * timing.blocks);
    let mut best = programme.solve(possible)?;
    while possible - impossible > 1 {
        let middle = (impossible + possible) / 2;
        match programme.solve(middle) {
            Some(blocks) => (possible, best) = (middle, blocks),
            None => impossible = middle,
        }
    }
    Some((possible, best))
}

/// The filter of a step with these values of the blocks, then 1.
fn taps(blocks: &[f64], block_ticks: usize) -> Taps {
    let before = std::iter::once(&0.0).chain(blocks);
    let after = blocks.iter().chain(std::iter::once(&1.0));
    let changes = before.zip(after).zip(0_i64..);
    Taps::new(changes.map(|((before, after), block)| Tap {
        delay_ticks: block * block_ticks as i64,
        weight: after - before,
    }))
}
