//! Figures of closed-loop runs side by side. Their errors are not known, so that no significance is stated.

use serde::Serialize;

use super::run_result::RunResult;
use crate::experiment::ControlRun;

/// A figure of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Figure {
    /// Settling time to 2 % of a step in seconds.
    SettlingTimeS,
    /// Overshoot of a step in percent.
    OvershootPercent,
    /// Mean error in the steady state in metres.
    SteadyStateMeanErrorM,
    /// RMS of the error in the steady state in metres.
    SteadyStateRmsM,
    /// Gain of a sine.
    SineGain,
    /// Phase of a sine in degrees.
    SinePhaseDeg,
    /// Largest error in metres.
    PeakErrorM,
    /// RMS of the error of the whole run in metres.
    RmsErrorM,
    /// Largest current in amperes.
    PeakCurrentA,
    /// RMS current in amperes.
    RmsCurrentA,
    /// Overruns of the loop.
    Overruns,
    /// Lost records.
    LostRecords,
}

/// A figure of the reference run and of another run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FigureDifference {
    /// Which figure.
    pub figure: Figure,
    /// In the reference run; `None` if it has none.
    pub reference: Option<f64>,
    /// In the other run.
    pub other: Option<f64>,
    /// The other minus the reference.
    pub difference: Option<f64>,
}

impl Figure {
    const OF_A_LOOP: [Figure; 10] = [
        Figure::SettlingTimeS,
        Figure::OvershootPercent,
        Figure::SteadyStateMeanErrorM,
        Figure::SteadyStateRmsM,
        Figure::SineGain,
        Figure::SinePhaseDeg,
        Figure::PeakErrorM,
        Figure::RmsErrorM,
        Figure::PeakCurrentA,
        Figure::RmsCurrentA,
    ];

    /// Name and unit, and the factor from the SI unit.
    pub fn name_and_factor(self) -> (&'static str, f64) {
        match self {
            Figure::SettlingTimeS => ("settling to 2 % (ms)", 1e3),
            Figure::OvershootPercent => ("overshoot (%)", 1.0),
            Figure::SteadyStateMeanErrorM => ("mean error, steady (um)", 1e6),
            Figure::SteadyStateRmsM => ("RMS error, steady (um)", 1e6),
            Figure::SineGain => ("gain of the sine", 1.0),
            Figure::SinePhaseDeg => ("phase of the sine (deg)", 1.0),
            Figure::PeakErrorM => ("largest error (um)", 1e6),
            Figure::RmsErrorM => ("RMS error, whole run (um)", 1e6),
            Figure::PeakCurrentA => ("largest current (A)", 1.0),
            Figure::RmsCurrentA => ("RMS current (A)", 1.0),
            Figure::Overruns => ("overruns", 1.0),
            Figure::LostRecords => ("lost records", 1.0),
        }
    }

    /// Printed decimals in the unit of [`Figure::name_and_factor`].
    pub fn decimals(self) -> usize {
        match self {
            Figure::Overruns | Figure::LostRecords => 0,
            _ => 4,
        }
    }

    fn of_loop(self, run: &ControlRun) -> Option<f64> {
        let (tracking, figures) = (run.tracking, run.figures);
        let step = tracking.and_then(|tracking| tracking.step);
        let sine = tracking.and_then(|tracking| tracking.sine);
        match self {
            Figure::SettlingTimeS => step?.settling_time_s,
            Figure::OvershootPercent => step.map(|step| step.overshoot_percent),
            Figure::SteadyStateMeanErrorM => tracking.map(|t| t.steady_state_mean_error_m),
            Figure::SteadyStateRmsM => tracking.map(|t| t.steady_state_rms_m),
            Figure::SineGain => sine.map(|sine| sine.gain),
            Figure::SinePhaseDeg => sine.map(|sine| sine.phase_deg),
            Figure::PeakErrorM => Some(figures.peak_error_m),
            Figure::RmsErrorM => Some(figures.rms_error_m),
            Figure::PeakCurrentA => Some(figures.peak_current_a),
            Figure::RmsCurrentA => Some(figures.rms_current_a),
            Figure::Overruns | Figure::LostRecords => None,
        }
    }
}

/// The figures that at least one of two runs has. Overruns and lost records are figures of every run.
pub(super) fn figures(reference: &RunResult, other: &RunResult) -> Vec<FigureDifference> {
    let (first, second) = (reference.control.as_ref(), other.control.as_ref());
    let of_loops = Figure::OF_A_LOOP.into_iter().map(|figure| {
        let value = |run: Option<&ControlRun>| run.and_then(|run| figure.of_loop(run));
        difference(figure, value(first), value(second))
    });
    let counts = [
        (Figure::Overruns, reference.overruns, other.overruns),
        (
            Figure::LostRecords,
            reference.lost_records,
            other.lost_records,
        ),
    ];
    let counts = counts
        .map(|(figure, first, second)| difference(figure, Some(first as f64), Some(second as f64)));
    let all = of_loops.chain(counts);
    all.filter(|figure| figure.reference.is_some() || figure.other.is_some())
        .collect()
}

fn difference(figure: Figure, reference: Option<f64>, other: Option<f64>) -> FigureDifference {
    FigureDifference {
        figure,
        reference,
        other,
        difference: other
            .zip(reference)
            .map(|(other, reference)| other - reference),
    }
}
