//! The analysis of an excitation: one function, whether it runs after a chirp, on an old recording or elsewhere.

use nalgebra::Complex;

use super::gathered::Gathered;
use crate::config::{Config, IdentifySettings};
use crate::identify::delay::{self, Delay};
use crate::identify::{EstimatorSettings, Frf, IdentifyError, Signals, local, welch};
use crate::plant::{self, Chain, Modal, PlantError};
use crate::recording::{Recording, RecordingError};
use crate::rt::arming::State;

/// The model's phase is believed up to so many times its last mode: beyond are modes that it leaves out.
const LAST_MODE: f64 = 1.2;

/// A recording that carries no frequency response.
#[derive(Debug, thiserror::Error)]
pub enum AnalysisError {
    /// It cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The signals carry no estimate.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The model cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// No program ran.
    #[error("in this recording no program ran: there is no excitation to analyse")]
    NothingRan,
    /// Too many ticks are missing.
    #[error(
        "{missing} of {ticks} ticks are missing, {allowed} may be filled in; repeat the run at a rate the machine keeps, or in real-time scheduling"
    )]
    Gaps {
        /// Missing ticks.
        missing: u64,
        /// Ticks in all.
        ticks: u64,
        /// Ticks that may be missing.
        allowed: u64,
    },
}

/// What a recorded excitation shows.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// The frequency response from the amplifier's set-point (A) to the probe (m): hold, amplifier, plant, delays, and the
    /// mean age of the readings; what their ages differ is undone.
    pub frf: Frf,
    /// The same by the model, at the same frequencies, for readings of the mean age.
    pub model: Vec<Complex<f64>>,
    /// Mean time in seconds from a command to the position that its reading shows, by the model.
    pub delay_s: f64,
    /// How much later than the model the chain answers, by its phases up to the last mode of the model.
    pub beyond: Option<Delay>,
    /// Missing ticks that were filled in: the current held, the position on a straight line.
    pub filled_ticks: u64,
}

/// Analyses a recording made with `config`.
pub fn analyse(recording: &Recording, config: &Config) -> Result<Analysis, AnalysisError> {
    let (signals, filled_ticks) = signals(recording, config.servo.rate_hz)?;
    let (start_hz, stop_hz) = (config.chirp.start_hz, config.chirp.stop_hz);
    let frf = response(&signals, (start_hz.min(stop_hz), start_hz.max(stop_hz)), &config.identify)?;
    let modes = Modal::of(&plant::build(&config.plant)?)?.modes;
    let last_hz = modes.iter().map(|mode| mode.omega_rad_s).fold(0.0, f64::max) / (2.0 * std::f64::consts::PI);
    let chain = Chain::of_mean_age(config, &modes);
    let model: Vec<_> = frf.frequency_hz.iter().map(|f| chain.response(2.0 * std::f64::consts::PI * f)).collect();
    let beyond = delay::beyond(&frf, &model, LAST_MODE * last_hz);
    Ok(Analysis { frf, model, delay_s: chain.delay_s(), beyond, filled_ticks })
}

/// H1 as configured.
fn response(signals: &Signals, band_hz: (f64, f64), settings: &IdentifySettings) -> Result<Frf, IdentifyError> {
    match *settings {
        IdentifySettings::Local { resolution_ratio, min_half_width_bins } => {
            let min_half_width_bins = min_half_width_bins as f64;
            local::estimate(signals, band_hz, &EstimatorSettings { min_half_width_bins, resolution_ratio })
        }
        IdentifySettings::Welch { segment_s } => {
            welch::estimate(signals, band_hz, libm::round(segment_s * signals.rate_hz) as usize)
        }
    }
}

/// Command and position of every tick of the run.
fn signals(recording: &Recording, rate_hz: f64) -> Result<(Signals, u64), AnalysisError> {
    let mut gathered = Gathered::new(recording, rate_hz);
    for record in recording.ticks()? {
        let record = record?;
        if record.state == State::Running {
            gathered.push(&record)?;
        }
    }
    gathered.finish()
}
