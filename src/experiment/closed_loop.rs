//! What a recording under control shows: the plant, and the loop around it.

use nalgebra::Complex;

use super::analysis_error::{AnalysisError, ClosedLoopError};
use super::plan::Plan;
use super::plan_error::PlanError;
use super::response_estimate::{ClosedResponses, MeasuredMargins, ResponseEstimate};
use crate::config::{Config, ReferenceSettings};
use crate::control::ClosedLoop;
use crate::identify::Frf;
use crate::identify::joint::{self, JointEstimate, LoopSignals};
use crate::identify::modal::Estimate;
use crate::model::plant::{self, LoopPlant, ModalModel};
use crate::recording::Recording;

/// The plant by the reference as instrument, and the loop.
pub(super) fn estimate_loop(
    signals: &LoopSignals,
    band_hz: (f64, f64),
    recording: &Recording,
    config: &Config,
) -> Result<ResponseEstimate, AnalysisError> {
    swept(&config.control.reference)?;
    let JointEstimate {
        plant,
        frf_data,
        complementary,
        sensitivity,
        loop_gain,
    } = joint::estimate(signals, band_hz, &config.identify.local())?;
    let model = model(recording, config)?;
    let model_loop = loop_gain
        .frequency_hz
        .iter()
        .map(|f| model.sampled_loop(TURN * f))
        .collect();
    let margins = margins(&loop_gain, &sensitivity);
    let predicted = model.margins();
    let closed = ClosedResponses {
        complementary,
        sensitivity,
        loop_gain,
        model_loop,
        predicted,
        margins,
    };
    Ok(ResponseEstimate {
        frf: plant,
        frf_data,
        closed: Some(closed),
    })
}

const TURN: f64 = 2.0 * std::f64::consts::PI;

/// Refuses references that do not sweep; a file may.
fn swept(reference: &ReferenceSettings) -> Result<(), ClosedLoopError> {
    let reference = reference.design();
    let kind = reference.name();
    match reference.can_identify() {
        true => Ok(()),
        false => Err(ClosedLoopError::Reference { kind }),
    }
}

/// The loop of the recorded controller around the configured model.
fn model(recording: &Recording, config: &Config) -> Result<ClosedLoop, AnalysisError> {
    let modes = ModalModel::of(&plant::build(&config.plant)?)?.modes;
    let plan = Plan::of(recording).map_err(ClosedLoopError::Plan)?;
    let text = plan
        .controller
        .ok_or(ClosedLoopError::Plan(PlanError::Missing("controller")))?;
    let design = text
        .design(config.servo.rate_hz)
        .map_err(ClosedLoopError::Controller)?;
    let plant = LoopPlant::new(config, &modes);
    let force_constant_n_per_a = config.motor.force_constant_n_per_a;
    let closed_loop = ClosedLoop::new(plant, modes, force_constant_n_per_a, design);
    Ok(closed_loop.map_err(ClosedLoopError::Controller)?)
}

fn margins(loop_gain: &Frf, sensitivity: &Frf) -> MeasuredMargins {
    let crossing = loop_gain
        .response
        .windows(2)
        .position(|pair| pair[0].norm() > 1.0 && pair[1].norm() <= 1.0);
    let peak = (0..sensitivity.len()).max_by(|a, b| {
        sensitivity.response[*a]
            .norm_sqr()
            .total_cmp(&sensitivity.response[*b].norm_sqr())
    });
    let modulus_margin = peak.map_or(
        Estimate {
            value: f64::NAN,
            sigma: f64::NAN,
        },
        |k| {
            let size = sensitivity.response[k].norm();
            Estimate {
                value: 1.0 / size,
                sigma: sensitivity.magnitude_sigma[k] / (size * size),
            }
        },
    );
    MeasuredMargins {
        crossover_rad_s: crossing.map(|k| TURN * crossed(loop_gain, k)),
        phase_margin_deg: crossing.map(|k| phase_margin_deg(loop_gain, k)),
        modulus_margin,
        sensitivity_peak_rad_s: peak.map_or(f64::NAN, |k| TURN * sensitivity.frequency_hz[k]),
    }
}

/// Where |L| is 1 between two frequencies: ln |L| over ln f is a straight line.
fn crossed(loop_gain: &Frf, k: usize) -> f64 {
    let share = share(loop_gain, k);
    loop_gain.frequency_hz[k]
        * (loop_gain.frequency_hz[k + 1] / loop_gain.frequency_hz[k]).powf(share)
}

fn share(loop_gain: &Frf, k: usize) -> f64 {
    let height = |k: usize| loop_gain.response[k].norm().ln();
    height(k) / (height(k) - height(k + 1))
}

fn phase_margin_deg(loop_gain: &Frf, k: usize) -> Estimate {
    let (from, to) = (loop_gain.response[k], loop_gain.response[k + 1]);
    let turned = (to / from).arg() * share(loop_gain, k);
    let value = (-from * Complex::from_polar(1.0, turned))
        .arg()
        .to_degrees();
    Estimate {
        value,
        sigma: loop_gain.phase_sigma_rad[k].to_degrees(),
    }
}
