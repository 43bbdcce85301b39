//! Figures of closed-loop runs side by side. Their errors are not known, so that no significance is stated.

use serde::Serialize;

use super::run_result::RunResult;

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
    /// All figures.
    pub const ALL: [Figure; 12] = [
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
        Figure::Overruns,
        Figure::LostRecords,
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

    /// Its value in a run; `None` if the run has no such figure.
    fn value(self, run: &RunResult) -> Option<f64> {
        let control = run.control.as_ref();
        let figures = control.map(|control| control.figures);
        let tracking = control.and_then(|control| control.tracking);
        let step = tracking.and_then(|tracking| tracking.step);
        let sine = tracking.and_then(|tracking| tracking.sine);
        match self {
            Figure::SettlingTimeS => step?.settling_time_s,
            Figure::OvershootPercent => Some(step?.overshoot_percent),
            Figure::SteadyStateMeanErrorM => Some(tracking?.steady_state_mean_error_m),
            Figure::SteadyStateRmsM => Some(tracking?.steady_state_rms_m),
            Figure::SineGain => Some(sine?.gain),
            Figure::SinePhaseDeg => Some(sine?.phase_deg),
            Figure::PeakErrorM => Some(figures?.peak_error_m),
            Figure::RmsErrorM => Some(figures?.rms_error_m),
            Figure::PeakCurrentA => Some(figures?.peak_current_a),
            Figure::RmsCurrentA => Some(figures?.rms_current_a),
            Figure::Overruns => Some(run.overruns as f64),
            Figure::LostRecords => Some(run.lost_records as f64),
        }
    }
}

/// The figures that at least one of two runs has. Overruns and lost records are figures of every run.
pub(super) fn figures(reference: &RunResult, other: &RunResult) -> Vec<FigureDifference> {
    let all = Figure::ALL.map(|figure| difference(figure, reference, other));
    let found = all.into_iter();
    found
        .filter(|found| found.reference.is_some() || found.other.is_some())
        .collect()
}

fn difference(figure: Figure, reference: &RunResult, other: &RunResult) -> FigureDifference {
    let (reference, other) = (figure.value(reference), figure.value(other));
    FigureDifference {
        figure,
        reference,
        other,
        difference: other
            .zip(reference)
            .map(|(other, reference)| other - reference),
    }
}
