//! Figures of a closed-loop run, from its recording.

use serde::Serialize;

use crate::config::{Config, ReferenceSettings};
use crate::control::{StepFigures, step_figures};
use crate::recording::{Recording, RecordingError};
use crate::rt::record::flag;

/// What the recording of a closed loop shows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// Settling and overshoot, where the reference is a step; a settling band (2 % of the step) below three sigma of the
    /// steady state is lost in it, and there is no settling time.
    #[serde(flatten)]
    pub step: Option<StepFigures>,
    /// Mean of r - y in metres over the steady state.
    pub steady_state_mean_error_m: f64,
    /// Standard deviation of r - y in metres over the steady state.
    pub steady_state_sigma_m: f64,
}

/// Measures a run; `None` if it ended before its steady state.
pub fn measure(recording: &Recording, config: &Config) -> Result<Option<Measured>, RecordingError> {
    let (mut reference_m, mut position_m) = (Vec::new(), Vec::new());
    for record in recording.ticks()? {
        let record = record?;
        if record.flags & flag::ACTIVE != 0 {
            reference_m.push(record.reference_m);
            position_m.push(record.position_m);
        }
    }
    let tick = |seconds: f64| (seconds * config.servo.rate_hz).round() as usize;
    let (change, height_m) = match config.control.reference {
        ReferenceSettings::Step { amplitude_m, at_s } => (tick(at_s), amplitude_m),
        ReferenceSettings::Ramp { amplitude_m, speed_m_per_s, at_s } => {
            (tick(at_s + amplitude_m.abs() / speed_m_per_s), 0.0)
        }
        _ => (0, 0.0),
    };
    let steady = change + tick(config.control.steady_after_s);
    if steady + 1 >= position_m.len() {
        return Ok(None);
    }
    let (mean, sigma) = mean_and_sigma(reference_m[steady..].iter().zip(&position_m[steady..]).map(|(r, y)| r - y));
    let origin_m = reference_m[0];
    let step = (height_m != 0.0).then(|| {
        let moved: Vec<f64> = position_m[change..].iter().map(|y| y - origin_m).collect();
        let figures = step_figures(&moved, height_m, config.servo.period_s());
        let seen = 0.02 * height_m.abs() > 3.0 * sigma;
        StepFigures { settling_time_s: figures.settling_time_s.filter(|_| seen), ..figures }
    });
    Ok(Some(Measured { step, steady_state_mean_error_m: mean, steady_state_sigma_m: sigma }))
}

fn mean_and_sigma(errors: impl ExactSizeIterator<Item = f64> + Clone) -> (f64, f64) {
    let n = errors.len() as f64;
    let mean = errors.clone().sum::<f64>() / n;
    (mean, (errors.map(|e| (e - mean) * (e - mean)).sum::<f64>() / (n - 1.0)).sqrt())
}
