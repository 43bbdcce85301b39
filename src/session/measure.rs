//! Figures of a closed-loop run, from its recording.

use serde::Serialize;

use crate::config::{Config, ReferenceSettings};
use crate::control::{StepFigures, StepMeter};
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

/// Measures a run; `None` if it ended before its steady state. One pass in little memory: a run may last for days.
pub fn measure(recording: &Recording, config: &Config) -> Result<Option<Measured>, RecordingError> {
    let tick = |seconds: f64| (seconds * config.servo.rate_hz).round() as u64;
    let (change, height_m) = match config.control.reference {
        ReferenceSettings::Step { amplitude_m, at_s } => (tick(at_s), amplitude_m),
        ReferenceSettings::Ramp { amplitude_m, speed_m_per_s, at_s } => {
            (tick(at_s + amplitude_m.abs() / speed_m_per_s), 0.0)
        }
        _ => (0, 0.0),
    };
    let steady = change.saturating_add(tick(config.control.steady_after_s));
    let (mut step, mut error, mut origin_m, mut active) = (StepMeter::new(height_m), Moments::default(), 0.0, 0);
    for record in recording.ticks()? {
        let record = record?;
        if record.flags & flag::ACTIVE == 0 {
            // Where the stage rests is known best in the last tick before the loop closes; a step may come with the first.
            origin_m = if active == 0 { record.reference_m } else { origin_m };
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
    let Some(sigma) = error.sigma() else { return Ok(None) };
    let step = (height_m != 0.0).then(|| {
        let figures = step.figures(config.servo.period_s());
        let seen = 0.02 * height_m.abs() > 3.0 * sigma;
        StepFigures { settling_time_s: figures.settling_time_s.filter(|_| seen), ..figures }
    });
    Ok(Some(Measured { step, steady_state_mean_error_m: error.mean, steady_state_sigma_m: sigma }))
}

/// Mean and standard deviation in one pass (Welford 1962).
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Moments {
    fn push(&mut self, x: f64) {
        self.count += 1.0;
        let from_old = x - self.mean;
        self.mean += from_old / self.count;
        self.squares += from_old * (x - self.mean);
    }

    /// Standard deviation, of two values at least.
    fn sigma(&self) -> Option<f64> {
        (self.count > 1.0).then(|| (self.squares / (self.count - 1.0)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_sigma_in_one_pass_are_those_of_two_passes() {
        let values: Vec<f64> = (0..10_000).map(|k| 5e-5 + 1e-8 * f64::sin(f64::from(k) * 1.7)).collect();
        let mut moments = Moments::default();
        values.iter().for_each(|x| moments.push(*x));
        let mean = values.iter().sum::<f64>() / 1e4;
        let sigma = (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 9999.0).sqrt();
        // 10,000 roundings of 1e-20 in the mean of 5e-5.
        assert!((moments.mean - mean).abs() < 1e-16 && (moments.sigma().unwrap() / sigma - 1.0).abs() < 1e-9);
        assert_eq!(Moments::default().sigma(), None);
    }
}
