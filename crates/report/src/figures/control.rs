//! Figures of a closed-loop run, measured and by the model.

use super::{Figure, Quantity, beside, margins};
use crate::table::Table;
use bench_base::units::UM_PER_M;
use bench_control::StepMetrics;
use bench_experiment::{
    ControlRun, PredictedSine, RunFigures, SineResponse, StepResponse, TrackingMetrics,
};

const MS_PER_S: f64 = 1e3;
/// Digits after the point of a length in micrometres.
const UM_DECIMALS: usize = 4;

/// The figures of a run, beside those of the model.
pub fn control_table(run: &ControlRun) -> Table {
    let tracking = run.tracking.as_ref();
    let measured = [
        run.step.iter().map(height).collect(),
        tracking.map_or_else(Vec::new, tracking_figures),
    ]
    .concat();
    let predicted_step = run.step.as_ref().and_then(|step| step.predicted.as_ref());
    let model = [
        predicted_step.map_or_else(Vec::new, |predicted| step(&predicted.metrics)),
        run.predicted_sine.iter().flat_map(predicted_sine).collect(),
        loop_figures(run),
    ]
    .concat();
    beside(&measured, &model)
}

fn loop_figures(run: &ControlRun) -> Vec<Figure> {
    let found = &run.model.margins;
    if found.stable {
        margins(found)
    } else {
        vec![Figure::new("Closed loop", None::<f64>, "", 0).or("unstable")]
    }
}

fn height(step: &StepResponse) -> Figure {
    Figure::new("Height of the step", step.height_m, "m", 3).times(UM_PER_M, "µm")
}

/// Settling and overshoot of a step.
pub fn step(step: &StepMetrics) -> Vec<Figure> {
    vec![
        Figure::new("Settling to 2 %", step.settling_time_s, "s", 1).times(MS_PER_S, "ms"),
        Figure::new("Overshoot", step.overshoot_percent, "%", 1),
    ]
}

/// Gain and phase of a sine by the model.
pub fn predicted_sine(sine: &PredictedSine) -> Vec<Figure> {
    vec![
        Figure::new("Gain", sine.gain, "", 5),
        Figure::new("Phase", sine.phase_deg, "deg", 3),
    ]
}

/// What was measured in a run: its step or its sine, and its steady state.
pub fn tracking_figures(tracking: &TrackingMetrics) -> Vec<Figure> {
    let (mean_m, sigma_m, rms_m) = (
        tracking.steady_state_mean_error_m,
        tracking.steady_state_sigma_m,
        tracking.steady_state_rms_m,
    );
    [
        tracking.step.as_ref().map_or_else(Vec::new, step),
        tracking.sine.as_ref().map_or_else(Vec::new, sine),
        vec![
            micrometres("Mean error", mean_m),
            micrometres("Sigma of the error", sigma_m),
            micrometres("RMS of the error", rms_m),
        ],
    ]
    .concat()
}

/// Gain and phase of a measured sine, and what it leaves. The errors are known from three periods on.
fn sine(sine: &SineResponse) -> Vec<Figure> {
    let at = format!(" at {} Hz", sine.frequency_hz);
    let gain = Quantity::new(sine.gain, sine.gain_sigma);
    let phase_deg = Quantity::new(sine.phase_deg, sine.phase_sigma_deg);
    vec![
        Figure::new("Gain", gain, "", 4).remark(&at),
        Figure::new("Phase", phase_deg, "deg", 2),
        micrometres("RMS beside the sine", sine.residual_rms_m),
    ]
}

/// The largest values of a whole run, and its heat.
pub fn whole_run(figures: &RunFigures) -> Vec<Figure> {
    let heat_percent = 100.0 * (figures.thermal_peak_a / figures.thermal_limit_a).powi(2);
    vec![
        micrometres("Largest error", figures.peak_error_m),
        micrometres("RMS of the error", figures.rms_error_m),
        Figure::new("Peak current", figures.peak_current_a, "A", 4),
        Figure::new("RMS current", figures.rms_current_a, "A", 4),
        Figure::new("Heat of the motor", heat_percent, "%", 2)
            .remark(" of the limit of the interlock"),
    ]
}

fn micrometres(name: &str, metres: f64) -> Figure {
    Figure::new(name, metres, "m", UM_DECIMALS).times(UM_PER_M, "µm")
}
