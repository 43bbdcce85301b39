//! The disturbance of the position, from a recorded closed loop that held its position.
//!
//! ```text
//!  S_dd = |1 + L|^2 S_ee - S_nn
//! ```
//!
//! S_ee is the spectrum of the recorded error (reference minus reading), L the loop by the model of the recording, S_nn that of the
//! probe's noise. Where the noise is larger than the disturbance, S_dd is 0.

use crate::analysis::Ending;
use crate::errors::ExperimentError;
use crate::plan::{Plan, PlanError, closed_loop_of};
use crate::results::{ClosedSignals, error_spectrum, steady_tick};
use bench_base::units::rad_s;
use bench_control::ControllerText;
use bench_control::tuning::DisturbanceSpectrum;
use bench_excitation::ReferenceSettings;
use bench_recording::{Recording, RecordingError};

/// Least length of the steady state in seconds: ten segments of the spectrum, which give each band to about 30 %.
const LEAST_STEADY_S: f64 = 10.0;

/// A recording from which no disturbance can be computed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DisturbanceError {
    /// It cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// It has no plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// Its loop cannot be computed.
    #[error(transparent)]
    Loop(#[from] ExperimentError),
    /// Not a closed loop that holds its position.
    #[error(
        "{0} is not a closed loop that held its position, so its error is not due to the disturbance alone; give a recording of `bench control --reference hold`"
    )]
    NotHeld(String),
    /// Ended by an interlock.
    #[error(
        "the run of {0} was ended by an interlock; repeat `bench control --reference hold` and give its recording"
    )]
    Tripped(String),
    /// Too short for a spectrum.
    #[error(
        "the steady state in {0} is shorter than 10 s, too short for a spectrum; repeat `bench control --reference hold` with --duration 20s or longer"
    )]
    TooShort(String),
}

impl DisturbanceError {
    /// Whether data or files are the reason, and not options or settings.
    pub fn is_failure(&self) -> bool {
        matches!(
            self,
            DisturbanceError::Recording(_) | DisturbanceError::Loop(_)
        )
    }
}

/// The spectrum of the disturbance in a recording with the name `file`, of a probe whose noise has the standard deviation
/// `noise_rms_m` in metres.
///
/// # Errors
/// When the recording cannot be read, is not of a held position, tripped, or is too short.
pub fn recorded_disturbance(
    recording: &Recording,
    file: &str,
    noise_rms_m: f64,
) -> Result<DisturbanceSpectrum, DisturbanceError> {
    let plan = Plan::of(recording)?;
    let controller = held_by(&plan).ok_or_else(|| DisturbanceError::NotHeld(file.into()))?;
    if Ending::of(recording).trip().is_some() {
        return Err(DisturbanceError::Tripped(file.into()));
    }
    let config = &plan.config;
    let rate_hz = config.servo.rate_hz;
    let closed_loop = closed_loop_of(controller, config)?;
    let signals = ClosedSignals::of(recording)?;
    let steady = steady_tick(&config.control, rate_hz) as usize;
    let too_short = || DisturbanceError::TooShort(file.into());
    let steady_s = signals.error_m.len().saturating_sub(steady) as f64 / rate_hz;
    if steady_s < LEAST_STEADY_S {
        return Err(too_short());
    }
    let spectrum = error_spectrum(&signals, steady, rate_hz, None).ok_or_else(too_short)?;
    let noise_m2_per_hz = 2.0 * noise_rms_m * noise_rms_m / rate_hz;
    let rows = spectrum.frequency_hz.iter().zip(&spectrum.measured);
    let densities = rows.map(|(frequency_hz, error_m2_per_hz)| {
        let difference = closed_loop.sampled_loop(rad_s(*frequency_hz)) + 1.0;
        let density = difference.norm_sqr() * error_m2_per_hz - noise_m2_per_hz;
        density.max(0.0) / rad_s(1.0)
    });
    let widths = spectrum.width_hz.iter().map(|width_hz| rad_s(*width_hz));
    let bands: Vec<(f64, f64)> = widths.zip(densities).collect();
    let first_hz = spectrum.frequency_hz.first().copied().unwrap_or(0.0);
    let first_width_hz = spectrum.width_hz.first().copied().unwrap_or(0.0);
    let start_rad_s = rad_s(first_hz - 0.5 * first_width_hz);
    Ok(DisturbanceSpectrum::new(start_rad_s, &bands))
}

/// The controller of a plan that holds the position.
fn held_by(plan: &Plan) -> Option<&ControllerText> {
    let controller = plan.controller.as_ref()?;
    let is_held = matches!(plan.config.control.reference, ReferenceSettings::Hold(_));
    is_held.then_some(controller)
}
