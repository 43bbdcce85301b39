//! The response of a closed loop to a step of its reference, in a recording and by the model.

use super::tracking::{TrackingMetrics, tracking_metrics};
use crate::errors::ExperimentError;
use crate::forecast::{MAX_STEP_TICKS, PredictedStep, predicted_step};
use crate::plan::{Plan, closed_loop_of};
use bench_recording::Recording;
use bench_rt::record::flag;

/// A recorded step beside that of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct StepResponse {
    /// Height of the step in metres.
    pub height_m: f64,
    /// Rest position in metres.
    pub rest_m: f64,
    /// Time of the step in seconds since the loop closed.
    pub at_s: f64,
    /// Sampling period in seconds.
    pub period_s: f64,
    /// Measured position in metres from the rest position, at each tick from the step on.
    pub positions_m: Vec<f64>,
    /// By the model; `None` if the loop of the model is unstable.
    pub predicted: Option<PredictedStep>,
    /// Measured settling, overshoot and error; `None` if the run ended before its steady state.
    pub metrics: Option<TrackingMetrics>,
}

impl StepResponse {
    /// (Seconds since the step, metres from the rest position), measured, up to a time.
    pub fn measured_points(&self, up_to_s: f64) -> Vec<(f64, f64)> {
        points(&self.positions_m, self.period_s, up_to_s)
    }

    /// The same by the model.
    pub fn predicted_points(&self, up_to_s: f64) -> Vec<(f64, f64)> {
        let predicted = self.predicted.as_ref();
        let positions_m = predicted.map_or(&[][..], |predicted| &predicted.positions_m);
        points(positions_m, self.period_s, up_to_s)
    }
}

fn points(positions_m: &[f64], period_s: f64, up_to_s: f64) -> Vec<(f64, f64)> {
    let times_s = (0..positions_m.len()).map(|tick| tick as f64 * period_s);
    let points = times_s.zip(positions_m.iter().copied());
    points
        .take_while(|(time_s, _)| *time_s <= up_to_s)
        .collect()
}

/// The step in the recording of a closed loop; `None` if its reference has none.
///
/// # Errors
/// When the recording cannot be read, or the loop of its controller cannot be computed.
pub fn step_response(
    recording: &Recording,
    plan: &Plan,
) -> Result<Option<StepResponse>, ExperimentError> {
    let (config, Some(controller)) = (&plan.config, &plan.controller) else {
        return Ok(None);
    };
    let Some(step) = config.control.reference.design().step() else {
        return Ok(None);
    };
    let closed_loop = closed_loop_of(controller, config)?;
    let predicted = if closed_loop.margins().stable {
        predicted_step(plan, &closed_loop)
    } else {
        None
    };
    let (rest_m, positions_m) = positions_after(recording, step.at_s * config.servo.rate_hz)?;
    Ok(Some(StepResponse {
        height_m: step.height_m,
        rest_m,
        at_s: step.at_s,
        period_s: config.servo.period_s(),
        positions_m,
        predicted,
        metrics: tracking_metrics(recording, &config.control, &config.servo)?,
    }))
}

/// The rest position, and the positions from it from a tick on, counted since the loop was closed. The rest position is the reference of the last tick before the
/// loop was closed, as in [`tracking_metrics`].
fn positions_after(recording: &Recording, tick: f64) -> Result<(f64, Vec<f64>), ExperimentError> {
    let first = tick.round() as u64;
    let (mut active, mut rest_m) = (0, 0.0);
    let mut positions_m = Vec::new();
    for record in recording.ticks()? {
        let record = record?;
        if record.flags & flag::ACTIVE == 0 {
            if active == 0 {
                rest_m = record.reference_m;
            }
            continue;
        }
        if active >= first && positions_m.len() < MAX_STEP_TICKS {
            positions_m.push(record.position_m - rest_m);
        }
        active += 1;
    }
    Ok((rest_m, positions_m))
}
