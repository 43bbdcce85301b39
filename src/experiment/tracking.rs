//! Figures of a closed-loop run, from its recording.

use serde::Serialize;

use crate::config::Config;
use crate::control::{StepMeter, StepMetrics};
use crate::recording::{Recording, RecordingError};
use crate::rt::record::flag;
use crate::util::running_stats::RunningStats;

/// What the recording of a closed loop shows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TrackingMetrics {
    /// Settling and overshoot, where the reference is a step; a settling band (2 % of the step) below three sigma of the
    /// steady state is lost in it, and there is no settling time.
    #[serde(flatten)]
    pub step: Option<StepMetrics>,
    /// Mean of r - y in metres over the steady state.
    pub steady_state_mean_error_m: f64,
    /// Standard deviation of r - y in metres over the steady state.
    pub steady_state_sigma_m: f64,
}

/// Measures a run; `None` if it ended before its steady state. One pass in little memory: a run may last for days.
pub fn tracking_metrics(
    recording: &Recording,
    config: &Config,
) -> Result<Option<TrackingMetrics>, RecordingError> {
    let tick = |seconds: f64| (seconds * config.servo.rate_hz).round() as u64;
    let reference = config.control.reference.design();
    let change = tick(reference.last_change_s());
    let height_m = reference.step().map_or(0.0, |step| step.height_m);
    let steady = change.saturating_add(tick(config.control.steady_after_s));
    let (mut step, mut error, mut origin_m, mut active) =
        (StepMeter::new(height_m), RunningStats::default(), 0.0, 0);
    for record in recording.ticks()? {
        let record = record?;
        if record.flags & flag::ACTIVE == 0 {
            // Where the stage rests is known best in the last tick before the loop closes; a step may come with the first.
            origin_m = if active == 0 {
                record.reference_m
            } else {
                origin_m
            };
            continue;
        }
        if active >= change {
            step.push(record.position_m - origin_m);
        }
        if active >= steady {
            error.push(record.reference_m - record.position_m);
        }
        active += 1;
    }
    let Some(sigma) = error.sigma() else {
        return Ok(None);
    };
    let step = (height_m != 0.0).then(|| {
        let figures = step.figures(config.servo.period_s());
        let seen = 0.02 * height_m.abs() > 3.0 * sigma;
        StepMetrics {
            settling_time_s: figures.settling_time_s.filter(|_| seen),
            ..figures
        }
    });
    Ok(Some(TrackingMetrics {
        step,
        steady_state_mean_error_m: error.mean,
        steady_state_sigma_m: sigma,
    }))
}
