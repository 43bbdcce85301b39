//! The responses in a closed-loop recording: the plant and the loop.

use std::f64::consts::TAU;

use nalgebra::Complex;

use super::analysis_error::{AnalysisError, ClosedLoopError};
use super::loop_check::closed_loop_of;
use super::plan::Plan;
use super::plan_error::PlanError;
use super::response_estimate::{ClosedResponses, MeasuredMargins, ResponseEstimate};
use crate::config::{Config, ReferenceSettings};
use crate::control::ClosedLoop;
use crate::identify::Frf;
use crate::identify::joint::{self, JointEstimate, LoopSignals};
use crate::identify::modal::Estimate;
use crate::recording::Recording;

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
    Ok(with_margins(estimate, &model))
}

fn with_margins(estimate: JointEstimate, model: &ClosedLoop) -> ResponseEstimate {
    let loop_gain = estimate.loop_gain;
    let frequencies = loop_gain.frequency_hz.iter();
    let closed = ClosedResponses {
        model_loop: frequencies.map(|f| model.sampled_loop(TAU * f)).collect(),
        predicted: model.margins(),
        margins: margins(&loop_gain, &estimate.sensitivity),
        complementary: estimate.complementary,
        sensitivity: estimate.sensitivity,
        loop_gain,
    };
    ResponseEstimate {
        frf: estimate.plant,
        frf_data: estimate.frf_data,
        closed: Some(closed),
        linearity: None,
    }
}

/// Refuses a reference that does not sweep the band. A reference from a file may sweep it.
fn require_swept(reference: &ReferenceSettings) -> Result<(), ClosedLoopError> {
    let reference = reference.design();
    let kind = reference.name();
    match reference.can_identify() {
        true => Ok(()),
        false => Err(ClosedLoopError::Reference { kind }),
    }
}

/// The loop of the recorded controller and the configured model.
fn model(recording: &Recording, config: &Config) -> Result<ClosedLoop, ClosedLoopError> {
    let controller = Plan::of(recording)?.controller;
    let controller = controller.ok_or(PlanError::Missing("controller"))?;
    Ok(closed_loop_of(&controller, config)?)
}

fn margins(loop_gain: &Frf, sensitivity: &Frf) -> MeasuredMargins {
    let falls_below_1 = |pair: &[Complex<f64>]| pair[0].norm() > 1.0 && pair[1].norm() <= 1.0;
    let crossing = loop_gain.response.windows(2).position(falls_below_1);
    let size = |k: &usize| sensitivity.response[*k].norm_sqr();
    let peak = (0..sensitivity.len()).max_by(|a, b| size(a).total_cmp(&size(b)));
    MeasuredMargins {
        crossover_rad_s: crossing.map(|k| TAU * crossover_hz(loop_gain, k)),
        phase_margin_deg: crossing.map(|k| phase_margin_deg(loop_gain, k)),
        modulus_margin: peak.map_or(UNKNOWN, |k| modulus_margin(sensitivity, k)),
        sensitivity_peak_rad_s: peak.map_or(f64::NAN, |k| TAU * sensitivity.frequency_hz[k]),
    }
}

/// The estimate of an empty response.
const UNKNOWN: Estimate = Estimate {
    value: f64::NAN,
    sigma: f64::NAN,
};

/// 1/|S| at index `k`.
fn modulus_margin(sensitivity: &Frf, k: usize) -> Estimate {
    let size = sensitivity.response[k].norm();
    Estimate {
        value: 1.0 / size,
        sigma: sensitivity.magnitude_sigma[k] / (size * size),
    }
}

/// The frequency between `k` and `k + 1` at which |L| is 1, with ln |L| linear in ln f.
fn crossover_hz(loop_gain: &Frf, k: usize) -> f64 {
    let (from_hz, to_hz) = (loop_gain.frequency_hz[k], loop_gain.frequency_hz[k + 1]);
    from_hz * (to_hz / from_hz).powf(crossing_fraction(loop_gain, k))
}

/// Position of the crossing between `k` (0) and `k + 1` (1), on logarithmic axes.
fn crossing_fraction(loop_gain: &Frf, k: usize) -> f64 {
    let height = |k: usize| loop_gain.response[k].norm().ln();
    height(k) / (height(k) - height(k + 1))
}

fn phase_margin_deg(loop_gain: &Frf, k: usize) -> Estimate {
    let (from, to) = (loop_gain.response[k], loop_gain.response[k + 1]);
    let turned = (to / from).arg() * crossing_fraction(loop_gain, k);
    let value = (-from * Complex::from_polar(1.0, turned))
        .arg()
        .to_degrees();
    Estimate {
        value,
        sigma: loop_gain.phase_sigma_rad[k].to_degrees(),
    }
}
