//! The response of a closed loop to a step of its reference, by the model.

use crate::plan::Plan;
use bench_control::{ClosedLoop, StepMetrics, step_metrics};
use bench_excitation::command::{CommandFilter, CommandSource, FilteredCommand};
use bench_excitation::{Reference, StepOfReference};

/// Largest number of ticks of a step: 200 s at 5 kHz.
pub(crate) const MAX_STEP_TICKS: usize = 1_000_000;

/// The step by the linear model of the loop: without noise, disturbance and limits.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictedStep {
    /// Position in metres from the rest position, at each tick from the step on.
    pub positions_m: Vec<f64>,
    /// Settling and overshoot.
    pub metrics: StepMetrics,
}

/// The step of the planned reference by the model, with its command; `None` if the reference has no step within the run.
pub fn predicted_step(plan: &Plan, closed_loop: &ClosedLoop) -> Option<PredictedStep> {
    let config = &plan.config;
    let step = config.control.reference.design().step()?;
    let after_s = config.control.duration_s - step.at_s;
    let ticks = ((after_s * config.servo.rate_hz) as usize).min(MAX_STEP_TICKS);
    if step.height_m == 0.0 || ticks == 0 {
        return None;
    }
    let positions_m = match plan.command_filter() {
        None => closed_loop.simulate(ticks, |_| step.height_m),
        Some(filter) => commanded_step(closed_loop, filter, step, ticks),
    };
    let metrics = step_metrics(&positions_m, step.height_m, config.servo.period_s());
    Some(PredictedStep {
        positions_m,
        metrics,
    })
}

/// A step at a tick.
struct Step {
    height_m: f64,
    tick: u64,
}

impl Reference for Step {
    fn at_m(&self, tick: u64) -> f64 {
        if tick < self.tick { 0.0 } else { self.height_m }
    }
}

/// The positions from the step on, over `ticks`. Filters that read the reference ahead of time move the stage before the step.
fn commanded_step(
    closed_loop: &ClosedLoop,
    filter: &CommandFilter,
    step: StepOfReference,
    ticks: usize,
) -> Vec<f64> {
    let at = libm::round(step.at_s / closed_loop.plant().period_s()) as u64;
    let before = at.min(filter.preview_ticks());
    let reference = Step {
        height_m: step.height_m,
        tick: before,
    };
    let mut command = FilteredCommand::new(Box::new(reference), filter.clone());
    let signals =
        closed_loop.commanded_signals(before as usize + ticks, |tick| command.at(tick as u64));
    let positions_m = signals.map(|(_, position_m)| position_m);
    positions_m.skip(before as usize).collect()
}
