//! The analysis of an excitation: one function, whether it runs after a chirp, on an old recording or elsewhere.

use nalgebra::Complex;

use super::closed_loop::{self, ClosedLoopError, ClosedResponses};
use super::ending::Ending;
use super::gathered::{Gathered, Ran};
use super::patterns::{Taken, taken};
use super::plan::{KIND, RunKind};
use crate::config::Config;
use crate::excitation::{self, Excitation};
use crate::identify::delay::excess_delay;
use crate::identify::linearity::Linearity;
use crate::identify::modal::{self, FitError, MeasurementChain, ModalFit};
use crate::identify::verdict::{Verdict, VerdictInput, verdict};
use crate::identify::{Estimate, Frf, FrfDatum, IdentifyError, Signals, frf_data, response};
use crate::model::plant::{self, LoopPlant, ModalModel, Mode, PlantError, Sign};
use crate::recording::{Recording, RecordingError};
use crate::rt::arming::State;
use crate::rt::record::flag;

/// The model's phase is believed, and a verdict given, up to so many times its last mode: beyond are modes that it leaves
/// out.
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
    /// A closed loop whose controller is not known, or whose reference did not sweep.
    #[error(transparent)]
    Loop(#[from] ClosedLoopError),
    /// No program ran.
    #[error("in this recording no program ran: there is no excitation to analyse")]
    NothingRan,
    /// Too many ticks are missing.
    #[error(
        "{missing} ticks or more are missing beside the {ticks} that were recorded, {allowed} may be filled in; repeat the run at a rate the machine keeps, or in real-time scheduling"
    )]
    Gaps {
        /// Missing ticks, up to where there were too many.
        missing: u64,
        /// Recorded ones.
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
    pub excess_delay: Option<Estimate>,
    /// Missing ticks that were filled in: the current held, the position on a straight line.
    pub filled_ticks: u64,
    /// The modes that the response shows, or why none are told.
    pub fit: Result<ModalFit, FitError>,
    /// What that says of CNMP zeros.
    pub verdict: Verdict,
    /// Modes and zeros up to here count for the verdict, in rad/s.
    pub judged_up_to_rad_s: f64,
    /// The loop around the plant, of a recording under control.
    pub closed: Option<ClosedResponses>,
    /// How linear the stage answered, of a multisine with lines left out.
    pub linearity: Option<Linearity>,
}

/// Analyses a recording made with `config`: of an excitation, or of a closed loop whose reference was swept. Of a run that did
/// not come to its end the verdict's reasons say so.
pub fn analyse(recording: &Recording, config: &Config) -> Result<Analysis, AnalysisError> {
    let closed = recording
        .metadata()
        .get(KIND)
        .is_some_and(|kind| kind == RunKind::Control.name());
    let Ran {
        loop_signals,
        filled_ticks,
    } = ran(recording, config.servo.rate_hz, closed)?;
    let band_hz = config.chirp.band_hz();
    let (seen, linearity) = if closed {
        (
            closed_loop::seen(&loop_signals, band_hz, recording, config)?,
            None,
        )
    } else {
        open_loop(loop_signals.signals, band_hz, config)?
    };
    let shown = shown(seen, config, filled_ticks)?;
    let verdict = shown.verdict.with(Ending::of(recording).caution());
    Ok(Analysis {
        linearity,
        verdict,
        ..shown
    })
}

/// A response in both its forms.
pub(super) struct Seen {
    pub(super) frf: Frf,
    pub(super) frf_data: Vec<FrfDatum>,
    pub(super) closed: Option<ClosedResponses>,
}

fn open_loop(
    signals: Signals,
    band_hz: (f64, f64),
    config: &Config,
) -> Result<(Seen, Option<Linearity>), AnalysisError> {
    let (frf, frf_data, linearity) =
        match taken(signals, &excitation::of(config).pattern(), band_hz)? {
            Taken::Lines(frf, frf_data, linearity) => {
                (frf, frf_data, linearity.map(|boxed| *boxed))
            }
            Taken::Record(signals) => {
                let frf = response(&signals, band_hz, &config.identify)?;
                (
                    frf,
                    frf_data(&signals, band_hz, &config.identify.local())?,
                    None,
                )
            }
        };
    Ok((
        Seen {
            frf,
            frf_data,
            closed: None,
        },
        linearity,
    ))
}

/// What a response shows beside the model.
fn shown(seen: Seen, config: &Config, filled_ticks: u64) -> Result<Analysis, AnalysisError> {
    let Seen {
        frf,
        frf_data,
        closed,
    } = seen;
    let modal = ModalModel::of(&plant::build(&config.plant)?)?;
    let last_rad_s = LAST_MODE
        * modal
            .modes
            .iter()
            .map(|mode| mode.omega_rad_s)
            .fold(0.0, f64::max);
    let plant = LoopPlant::with_mean_age(config, &modal.modes);
    let model: Vec<_> = frf
        .frequency_hz
        .iter()
        .map(|f| plant.response(2.0 * std::f64::consts::PI * f))
        .collect();
    let chain = MeasurementChain::bench(config);
    let excess_delay = excess_delay(&frf, &model, last_rad_s / (2.0 * std::f64::consts::PI));
    let fit = modal::fit(&frf_data, &chain);
    let verdict = judge(&fit, &frf_data, &chain, last_rad_s, Some(&modal))?;
    Ok(Analysis {
        frf,
        model,
        delay_s: plant.delay_s(),
        excess_delay,
        filled_ticks,
        fit,
        verdict,
        judged_up_to_rad_s: last_rad_s,
        closed,
        linearity: None,
    })
}

impl Analysis {
    /// From a command to the position that its reading shows, in seconds: by the configuration, and what the phases show beyond.
    pub fn measured_delay_s(&self) -> f64 {
        self.delay_s + self.excess_delay.map_or(0.0, |delay| delay.value)
    }
}

/// What the fit says of CNMP zeros up to `up_to_rad_s`, beside the modes that the model has there.
pub(super) fn judge(
    fit: &Result<ModalFit, FitError>,
    frf_data: &[FrfDatum],
    chain: &MeasurementChain,
    up_to_rad_s: f64,
    model: Option<&ModalModel>,
) -> Result<Verdict, AnalysisError> {
    let fit = match fit {
        Ok(fit) => fit,
        Err(error) => return Ok(Verdict::undecided(error.to_string())),
    };
    let shows =
        |(mode, sign): &(&Mode, Sign)| *sign != Sign::Hidden && mode.omega_rad_s <= up_to_rad_s;
    let expected_modes =
        model.map(|modal| modal.modes.iter().zip(modal.signs()).filter(shows).count());
    Ok(verdict(&VerdictInput {
        fit,
        chain,
        frf_data,
        up_to_rad_s,
        expected_modes,
    })?)
}

/// Every tick of the run, or those with the loop closed.
fn ran(recording: &Recording, rate_hz: f64, closed: bool) -> Result<Ran, AnalysisError> {
    let mut gathered = Gathered::new(recording, rate_hz);
    for record in recording.ticks()? {
        let record = record?;
        if record.state == State::Running && (!closed || record.flags & flag::ACTIVE != 0) {
            gathered.push(&record)?;
        }
    }
    gathered.finish()
}
