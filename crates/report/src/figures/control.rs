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
/// Head of a column beside that of a measured figure.
const BY_THE_MODEL: &str = "by the model";

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
    vec![settling(Some(step)), overshoot(Some(step))]
}

fn settling(step: Option<&StepMetrics>) -> Figure {
    let time_s = step.and_then(|step| step.settling_time_s);
    Figure::new("Settling to 2 %", time_s, "s", 1).times(MS_PER_S, "ms")
}

fn overshoot(step: Option<&StepMetrics>) -> Figure {
    let percent = step.map(|step| step.overshoot_percent);
    Figure::new("Overshoot", percent, "%", 1)
}

/// The steps of several runs, a row for each, with measured figures and those of the model.
pub fn step_table(steps: &[(&str, &StepResponse)]) -> Table {
    let columns = [
        "Recording",
        "Step (µm)",
        &settling(None).head(),
        BY_THE_MODEL,
        &overshoot(None).head(),
        BY_THE_MODEL,
        &mean_error(None).head(),
        &sigma_of_error(None).head(),
    ];
    Table::new(columns).with_rows(steps.iter().map(|(name, step)| step_row(name, step)))
}

fn step_row(name: &str, step: &StepResponse) -> Vec<String> {
    let tracking = step.metrics.as_ref();
    let measured = tracking.and_then(|tracking| tracking.step.as_ref());
    let predicted = step.predicted.as_ref().map(|predicted| &predicted.metrics);
    let figures = [
        height(step),
        settling(measured),
        settling(predicted),
        overshoot(measured),
        overshoot(predicted),
        mean_error(tracking),
        sigma_of_error(tracking),
    ];
    let numbers = figures.iter().map(Figure::number);
    std::iter::once(name.into()).chain(numbers).collect()
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
    [
        tracking.step.as_ref().map_or_else(Vec::new, step),
        tracking.sine.as_ref().map_or_else(Vec::new, sine),
        vec![
            mean_error(Some(tracking)),
            sigma_of_error(Some(tracking)),
            micrometres("RMS of the error", tracking.steady_state_rms_m),
        ],
    ]
    .concat()
}

fn mean_error(tracking: Option<&TrackingMetrics>) -> Figure {
    let mean_m = tracking.map(|tracking| tracking.steady_state_mean_error_m);
    micrometres("Mean error", mean_m)
}

fn sigma_of_error(tracking: Option<&TrackingMetrics>) -> Figure {
    let sigma_m = tracking.map(|tracking| tracking.steady_state_sigma_m);
    micrometres("Sigma of the error", sigma_m)
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

fn micrometres(name: &str, metres: impl Into<Quantity>) -> Figure {
    Figure::new(name, metres, "m", UM_DECIMALS).times(UM_PER_M, "µm")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A step of 40 µm that ended before its steady state, without a prediction.
    const SHORT: StepResponse = StepResponse {
        height_m: 40e-6,
        rest_m: 0.0,
        at_s: 0.2,
        period_s: 2e-4,
        positions_m: Vec::new(),
        predicted: None,
        metrics: None,
    };

    fn metrics(settling_time_s: Option<f64>, overshoot_percent: f64) -> StepMetrics {
        StepMetrics {
            settling_time_s,
            overshoot_percent,
        }
    }

    #[test]
    fn table_of_steps_has_the_units_in_its_heads_and_numbers_in_its_cells() {
        let whole = StepResponse {
            predicted: Some(bench_experiment::PredictedStep {
                positions_m: Vec::new(),
                metrics: metrics(Some(0.0315), 4.5),
            }),
            metrics: Some(TrackingMetrics {
                step: Some(metrics(None, 5.2)),
                steady_state_mean_error_m: -1.3e-9,
                steady_state_sigma_m: 12.34e-9,
                steady_state_rms_m: 12.4e-9,
                sine: None,
            }),
            ..SHORT
        };
        let table = step_table(&[("whole", &whole), ("short", &SHORT)]);
        let columns = [
            "Recording",
            "Step (µm)",
            "Settling to 2 % (ms)",
            "by the model",
            "Overshoot (%)",
            "by the model",
            "Mean error (µm)",
            "Sigma of the error (µm)",
        ];
        assert_eq!(table.columns, columns);
        let row = |cells: [&str; 8]| cells.map(String::from).to_vec();
        let none = "none";
        let expected = [
            row([
                "whole", "40.000", none, "31.5", "5.2", "4.5", "-0.0013", "0.0123",
            ]),
            row(["short", "40.000", none, none, none, none, none, none]),
        ];
        assert_eq!(table.rows, expected);
    }
}
