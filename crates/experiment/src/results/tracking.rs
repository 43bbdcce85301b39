//! Figures of a closed-loop run, from its recording.

use serde::Serialize;

use super::sine_response::{SineMeter, SineResponse};
use bench_base::running_stats::RunningStats;
use bench_config::{ControlSettings, LoopSettings};
use bench_control::{SETTLING_BAND, StepMeter, StepMetrics};
use bench_recording::{Recording, RecordingError};
use bench_rt::record::{TickRecord, flag};

/// How well a closed loop followed its reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TrackingMetrics {
    /// Settling and overshoot, if the reference is a step. There is no settling time if the settling band (2 % of the step)
    /// is below three sigma of the steady state.
    #[serde(flatten)]
    pub step: Option<StepMetrics>,
    /// Mean of r - y in metres over the steady state.
    pub steady_state_mean_error_m: f64,
    /// Standard deviation of r - y in metres over the steady state.
    pub steady_state_sigma_m: f64,
    /// RMS of r - y in metres over the steady state.
    pub steady_state_rms_m: f64,
    /// Gain and phase, if the reference is a sine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sine: Option<SineResponse>,
}

/// The tick, counted since the loop closed, at which the steady state begins.
pub(crate) fn steady_tick(control: &ControlSettings, rate_hz: f64) -> u64 {
    let last_change_s = control.reference.design().last_change_s();
    ticks(last_change_s, rate_hz).saturating_add(ticks(control.steady_after_s, rate_hz))
}

fn ticks(seconds: f64, rate_hz: f64) -> u64 {
    (seconds * rate_hz).round() as u64
}

/// The metrics of a run; `None` if it ended before its steady state. One pass with constant memory: a run may last for days.
pub fn tracking_metrics(
    recording: &Recording,
    control: &ControlSettings,
    servo: &LoopSettings,
) -> Result<Option<TrackingMetrics>, RecordingError> {
    let mut meter = TrackingMeter::new(control, servo.rate_hz);
    for record in recording.ticks()? {
        meter.push(&record?);
    }
    Ok(meter.metrics(servo.period_s()))
}

/// Sums over the ticks of a run. Times are in ticks since the loop closed.
struct TrackingMeter {
    /// The last change of the reference.
    last_change: u64,
    /// Beginning of the steady state.
    steady: u64,
    /// Ticks with the loop closed.
    active: u64,
    origin_m: f64,
    height_m: f64,
    step: StepMeter,
    error: RunningStats,
    sine: Option<SineMeter>,
}

impl TrackingMeter {
    fn new(control: &ControlSettings, rate_hz: f64) -> TrackingMeter {
        let reference = control.reference.design();
        let height_m = reference.step().map_or(0.0, |step| step.height_m);
        TrackingMeter {
            last_change: ticks(reference.last_change_s(), rate_hz),
            steady: steady_tick(control, rate_hz),
            active: 0,
            origin_m: 0.0,
            height_m,
            step: StepMeter::new(height_m),
            error: RunningStats::default(),
            sine: reference.sine_hz().map(|hz| SineMeter::new(hz, rate_hz)),
        }
    }

    fn push(&mut self, record: &TickRecord) {
        if record.flags & flag::ACTIVE == 0 {
            // The last tick before the loop closes has the best estimate of the rest position; the first tick after it may
            // already contain a step.
            if self.active == 0 {
                self.origin_m = record.reference_m;
            }
            return;
        }
        if self.active >= self.last_change {
            self.step.push(record.position_m - self.origin_m);
        }
        if self.active >= self.steady {
            self.error.push(record.reference_m - record.position_m);
            if let Some(sine) = &mut self.sine {
                sine.push(record.tick, record.reference_m, record.position_m);
            }
        }
        self.active += 1;
    }

    fn metrics(&self, period_s: f64) -> Option<TrackingMetrics> {
        let sigma_m = self.error.sigma()?;
        let step = (self.height_m != 0.0).then(|| self.step_metrics(sigma_m, period_s));
        Some(TrackingMetrics {
            step,
            steady_state_mean_error_m: self.error.mean,
            steady_state_sigma_m: sigma_m,
            steady_state_rms_m: self.error.mean.hypot(sigma_m),
            sine: self.sine.as_ref().and_then(SineMeter::response),
        })
    }

    fn step_metrics(&self, sigma_m: f64, period_s: f64) -> StepMetrics {
        let figures = self.step.figures(period_s);
        let is_band_visible = SETTLING_BAND * self.height_m.abs() > 3.0 * sigma_m;
        StepMetrics {
            settling_time_s: figures.settling_time_s.filter(|_| is_band_visible),
            ..figures
        }
    }
}
