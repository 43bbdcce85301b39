//! The responses in a closed-loop recording: the plant and the loop.

use std::f64::consts::TAU;

use super::analysis_error::{AnalysisError, ClosedLoopError};
use super::response_estimate::{ClosedResponses, ResponseEstimate};
use super::response_points::margins_of_loop;
use crate::plan::{Plan, PlanError, closed_loop_of};
use bench_config::{Config, ReferenceSettings};
use bench_control::ClosedLoop;
use bench_identify::joint::{self, JointEstimate, LoopSignals};
use bench_recording::Recording;

/// Estimates plant and loop by the instrumental-variable method, with the reference as the instrument.
pub(super) fn estimate_loop(
    signals: &LoopSignals,
    band_hz: (f64, f64),
    recording: &Recording,
    config: &Config,
) -> Result<ResponseEstimate, AnalysisError> {
    require_swept(&config.control.reference)?;
    let estimate = joint::estimate(signals, band_hz, &config.identify.local())?;
    let model = model(recording, config)?;
    with_margins(estimate, &model)
}

fn with_margins(
    estimate: JointEstimate,
    model: &ClosedLoop,
) -> Result<ResponseEstimate, AnalysisError> {
    let loop_gain = estimate.loop_gain;
    let frequencies = loop_gain.frequency_hz.iter();
    let closed = ClosedResponses {
        model_loop: frequencies.map(|f| model.sampled_loop(TAU * f)).collect(),
        predicted: model.margins(),
        margins: margins_of_loop(&loop_gain).map_err(ClosedLoopError::from)?,
        complementary: estimate.complementary,
        sensitivity: estimate.sensitivity,
        loop_gain,
    };
    Ok(ResponseEstimate {
        frf: estimate.plant,
        closed: Some(closed),
        linearity: None,
    })
}

/// Refuses a reference that does not sweep the band. A reference from a file may sweep it.
fn require_swept(reference: &ReferenceSettings) -> Result<(), ClosedLoopError> {
    if reference.design().can_identify() {
        Ok(())
    } else {
        Err(ClosedLoopError::Reference {
            kind: reference.kind(),
        })
    }
}

/// The loop of the recorded controller and the configured model.
fn model(recording: &Recording, config: &Config) -> Result<ClosedLoop, ClosedLoopError> {
    let controller = Plan::of(recording)?.controller;
    let controller = controller.ok_or(PlanError::Missing("controller"))?;
    Ok(closed_loop_of(&controller, config)?)
}
