//! The analysis of an excitation: one function, whether it runs after a chirp, on an old recording or elsewhere.

use nalgebra::Complex;

use crate::config::{Config, IdentifySettings};
use crate::control::ClosedLoop;
use crate::identify::delay::{self, Delay};
use crate::identify::{EstimatorSettings, Frf, IdentifyError, Signals, local, welch};
use crate::plant::{self, Modal, PlantError};
use crate::recording::{Recording, RecordingError};
use crate::rt::arming::State;
use crate::rt::record::TickRecord;

/// Ticks that may be filled in, as a ratio of all: each adds an error of its own.
const FILLED_RATIO: f64 = 1e-3;

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
    /// The frequency response from the amplifier's set-point (A) to the probe (m): hold, amplifier, plant and computing
    /// delay.
    pub frf: Frf,
    /// The same by the model, at the same frequencies.
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
    let modal = Modal::of(&plant::build(&config.plant)?)?;
    let last_hz = modal.modes.iter().map(|mode| mode.omega_rad_s).fold(0.0, f64::max) / (2.0 * std::f64::consts::PI);
    let chain = ClosedLoop::new(config, modal.modes, Vec::new());
    let model: Vec<_> = frf.frequency_hz.iter().map(|f| chain.sampled_plant(2.0 * std::f64::consts::PI * f)).collect();
    let beyond = delay::beyond(&frf, &model, LAST_MODE * last_hz);
    Ok(Analysis { frf, model, delay_s: chain.chain().delay_s(), beyond, filled_ticks })
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
    let mut signals = Signals { rate_hz, input_a: Vec::new(), output_m: Vec::new() };
    let (mut before, mut filled): (Option<TickRecord>, u64) = (None, 0);
    for record in recording.ticks()? {
        let record = record?;
        if record.state != State::Running {
            continue;
        }
        if let Some(before) = before.filter(|before| before.tick + 1 < record.tick) {
            filled += fill(&mut signals, &before, &record, recording.tick_count())?;
        }
        signals.input_a.push(record.command_a);
        signals.output_m.push(record.position_m);
        before = Some(record);
    }
    if signals.input_a.is_empty() { Err(AnalysisError::NothingRan) } else { Ok((signals, filled)) }
}

/// Fills the gap between two records, if it is a short one.
fn fill(signals: &mut Signals, before: &TickRecord, after: &TickRecord, ticks: u64) -> Result<u64, AnalysisError> {
    let missing = after.tick - before.tick - 1;
    let allowed = (ticks as f64 * FILLED_RATIO) as u64;
    if missing > allowed {
        return Err(AnalysisError::Gaps { missing, ticks, allowed });
    }
    for step in 1..=missing {
        let share = step as f64 / (missing + 1) as f64;
        signals.input_a.push(before.command_a);
        signals.output_m.push(before.position_m + share * (after.position_m - before.position_m));
    }
    Ok(missing)
}
