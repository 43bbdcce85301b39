//! The analysis of an excitation: one function, whether it runs after a chirp, on an old recording or elsewhere.

use nalgebra::Complex;

use crate::config::{Config, IdentifySettings};
use crate::identify::align::Readings;
use crate::identify::delay::{self, Delay};
use crate::identify::{EstimatorSettings, Frf, IdentifyError, Moments, Signals, local, welch};
use crate::plant::{self, Chain, Modal, PlantError};
use crate::recording::{Recording, RecordingError};
use crate::rt::arming::State;
use crate::rt::record::TickRecord;

/// Ticks that may be filled in, as a ratio of all: each adds an error of its own.
const FILLED_RATIO: f64 = 1e-3;

/// Ages that differ by less than this part of a period are the same.
const SAME_AGE: f64 = 1e-3;

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
    let mut course = Course::new(recording, 1.0 / rate_hz);
    for record in recording.ticks()? {
        let record = record?;
        if record.state == State::Running {
            course.push(&record)?;
        }
    }
    course.finish(rate_hz)
}

/// The ticks of a run as they come, missing ones filled in.
struct Course {
    input_a: Vec<f64>,
    output_m: Vec<f64>,
    readings: Readings,
    /// Mean, and extremes, of the time in seconds from a tick to the measurement it had: minus the age.
    offset_s: Moments,
    offset_range_s: (f64, f64),
    /// Mean of the time in periods from a tick to its command.
    late: Moments,
    before: Option<TickRecord>,
    first_s: f64,
    period_s: f64,
    /// Devices answer when they are asked; the simulated stage answers at the tick itself, however late it was served.
    on_devices: bool,
    filled: u64,
    allowed: u64,
    ticks: u64,
}

impl Course {
    fn new(recording: &Recording, period_s: f64) -> Self {
        let ticks = recording.tick_count();
        Course {
            input_a: Vec::new(),
            output_m: Vec::new(),
            readings: Readings::default(),
            offset_s: Moments::default(),
            offset_range_s: (f64::INFINITY, f64::NEG_INFINITY),
            late: Moments::default(),
            before: None,
            first_s: 0.0,
            period_s,
            on_devices: recording.metadata().get("probe").is_some_and(|probe| probe != "simulated"),
            filled: 0,
            allowed: (ticks as f64 * FILLED_RATIO) as u64,
            ticks,
        }
    }

    fn push(&mut self, record: &TickRecord) -> Result<(), AnalysisError> {
        let scheduled_s = record.scheduled_ns as f64 * 1e-9;
        let asked_s = if self.on_devices { record.woke_ns as f64 * 1e-9 } else { scheduled_s };
        let measured_s = asked_s - record.probe_age_ns as f64 * 1e-9;
        match self.before {
            None => self.first_s = scheduled_s,
            Some(before) => self.fill(&before, record)?,
        }
        let offset_s = measured_s - scheduled_s;
        self.readings.push(measured_s, record.position_m);
        self.offset_s.push(offset_s);
        self.offset_range_s = (self.offset_range_s.0.min(offset_s), self.offset_range_s.1.max(offset_s));
        self.take_command(record, scheduled_s);
        self.output_m.push(record.position_m);
        self.before = Some(*record);
        Ok(())
    }

    /// A command that came later than the mean acts for a shorter part of its period, the one before for a longer one.
    fn take_command(&mut self, record: &TickRecord, scheduled_s: f64) {
        let late = if self.on_devices { (record.done_ns as f64 * 1e-9 - scheduled_s) / self.period_s } else { 0.0 };
        let mean = if self.late.count > 0.0 { self.late.mean } else { late };
        let before_a = self.before.map_or(0.0, |before| before.command_a);
        self.input_a.push(record.command_a + (before_a - record.command_a) * (late - mean));
        self.late.push(late);
    }

    /// Fills the gap between two records, if it is a short one: the current held, the position on a straight line.
    fn fill(&mut self, before: &TickRecord, after: &TickRecord) -> Result<(), AnalysisError> {
        let missing = after.tick.saturating_sub(before.tick + 1);
        if missing > self.allowed {
            return Err(AnalysisError::Gaps { missing, ticks: self.ticks, allowed: self.allowed });
        }
        for step in 1..=missing {
            let share = step as f64 / (missing + 1) as f64;
            self.input_a.push(before.command_a);
            self.output_m.push(before.position_m + share * (after.position_m - before.position_m));
        }
        self.filled += missing;
        Ok(())
    }

    /// Where ages differ from tick to tick, the positions as of the mean age.
    fn finish(self, rate_hz: f64) -> Result<(Signals, u64), AnalysisError> {
        if self.input_a.is_empty() {
            return Err(AnalysisError::NothingRan);
        }
        let differ = self.offset_range_s.1 - self.offset_range_s.0 > SAME_AGE * self.period_s;
        let start_s = self.first_s + self.offset_s.mean;
        let aligned = if differ {
            self.readings.at_regular_times(start_s, self.period_s, self.input_a.len())
        } else {
            Vec::new()
        };
        let output_m = if aligned.len() == self.input_a.len() { aligned } else { self.output_m };
        Ok((Signals { rate_hz, input_a: self.input_a, output_m }, self.filled))
    }
}
