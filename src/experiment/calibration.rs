//! From the recording of a staircase to scale, sign, offset, linearity and hysteresis.

use crate::config::{CalibrateSettings, Config, ScaleBy};
use crate::excitation::Staircase;
use crate::identify::RunningStats;
use crate::recording::{Recording, RecordingError};
use crate::rt::arming::State;

/// The stage must move by so many standard deviations of a level's mean.
const SEEN: f64 = 20.0;

/// A staircase that says nothing.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// It cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A level has no ticks.
    #[error(
        "level {0} of the staircase has no ticks in the recording: the run did not come to its end"
    )]
    Short(usize),
    /// The stage did not move.
    #[error(
        "the reading moved by {travel_m:.3e} m over the whole staircase, with {noise_m:.3e} m of noise in a level's mean: the stage does not follow the current; check motor, amplifier and probe, or raise calibrate.amplitude_a"
    )]
    Still {
        /// From the lowest to the highest level.
        travel_m: f64,
        /// Standard deviation of a mean.
        noise_m: f64,
    },
    /// Not a straight line.
    #[error(
        "{what} is {found:.4} of the travel, {limit} is allowed ({setting}): friction, a stop, or a probe near the end of its range; look at the recording"
    )]
    Crooked {
        /// What is too large.
        what: &'static str,
        /// How large.
        found: f64,
        /// The limit.
        limit: f64,
        /// The setting.
        setting: &'static str,
    },
}

/// What the staircase shows, in readings and commands as they were.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Metres of reading per ampere commanded, with its sign.
    pub compliance_m_per_a: f64,
    /// Standard deviation of that, by the scatter about the line.
    pub compliance_sigma_m_per_a: f64,
    /// Reading in metres at zero command, by the line.
    pub rest_m: f64,
    /// See [`crate::rig::calibration::ChainCalibration::nonlinearity_ratio`].
    pub nonlinearity_ratio: f64,
    /// See [`crate::rig::calibration::ChainCalibration::hysteresis_ratio`].
    pub hysteresis_ratio: f64,
    /// RMS of the reading about the means of its levels, in metres.
    pub noise_rms_m: f64,
    /// Amperes that flow per ampere commanded and at none, where the amplifier says.
    pub current: Option<(f64, f64)>,
}

/// Fits the recording of a staircase.
pub fn fit(recording: &Recording, config: &Config) -> Result<Fit, FitError> {
    let staircase = Staircase::new(&config.calibrate, config.servo.period_s());
    let levels = levels(recording, &staircase)?;
    let (offset_m, slope, sigma) =
        line(levels.iter().map(|l| (l.command_a.mean, l.position_m.mean)));
    let noise = levels
        .iter()
        .filter_map(|l| l.position_m.sigma())
        .map(|s| s * s)
        .sum::<f64>()
        / levels.len() as f64;
    let span_a = 2.0 * config.calibrate.amplitude_a;
    let travel_m = (slope * span_a).abs();
    let ticks = levels
        .iter()
        .map(|l| l.position_m.count)
        .fold(f64::INFINITY, f64::min);
    let noise_m = (noise / ticks).sqrt();
    if travel_m.partial_cmp(&(SEEN * noise_m)) != Some(std::cmp::Ordering::Greater) {
        return Err(FitError::Still { travel_m, noise_m });
    }
    let off = |l: &Level| (l.position_m.mean - offset_m - slope * l.command_a.mean).abs();
    let fit = Fit {
        compliance_m_per_a: slope,
        compliance_sigma_m_per_a: sigma,
        rest_m: offset_m,
        nonlinearity_ratio: levels.iter().map(off).fold(0.0, f64::max) / travel_m,
        hysteresis_ratio: hysteresis_m(&levels, staircase.levels_a(), slope) / travel_m,
        noise_rms_m: noise.sqrt(),
        current: current(&levels),
    };
    straight(&fit, &config.calibrate).map(|()| fit)
}

impl Fit {
    /// Metres per metre of reading that a calibration applies: the sign, and the size where it is known otherwise.
    pub fn probe_gain(&self, scale_by: ScaleBy, model_m_per_a: f64) -> f64 {
        let gain = self.current.map_or(1.0, |(gain, _)| gain);
        match scale_by {
            ScaleBy::Nothing => self.compliance_m_per_a.signum() * model_m_per_a.signum(),
            ScaleBy::Model => model_m_per_a * gain / self.compliance_m_per_a,
        }
    }
}

/// Refuses what is not a straight line.
fn straight(fit: &Fit, settings: &CalibrateSettings) -> Result<(), FitError> {
    let cases = [
        (
            "the distance between the ways up and down",
            fit.hysteresis_ratio,
            settings.largest_hysteresis_ratio,
            "calibrate.largest_hysteresis_ratio",
        ),
        (
            "the distance from a straight line",
            fit.nonlinearity_ratio,
            settings.largest_nonlinearity_ratio,
            "calibrate.largest_nonlinearity_ratio",
        ),
    ];
    match cases.into_iter().find(|(_, found, limit, _)| found > limit) {
        Some((what, found, limit, setting)) => Err(FitError::Crooked {
            what,
            found,
            limit,
            setting,
        }),
        None => Ok(()),
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Level {
    command_a: RunningStats,
    position_m: RunningStats,
    actual_a: RunningStats,
}

fn levels(recording: &Recording, staircase: &Staircase) -> Result<Vec<Level>, FitError> {
    let mut levels = vec![Level::default(); staircase.levels_a().len()];
    let mut first = None;
    for record in recording.ticks()? {
        let record = record?;
        if record.state != State::Running {
            continue;
        }
        let first = *first.get_or_insert(record.tick);
        let Some(level) = staircase.level(record.tick - first) else {
            continue;
        };
        let level = &mut levels[level];
        level.command_a.push(record.command_a);
        level.position_m.push(record.position_m);
        record
            .actual_a
            .into_iter()
            .for_each(|actual_a| level.actual_a.push(actual_a));
    }
    match levels.iter().position(|level| level.position_m.count < 2.0) {
        Some(short) => Err(FitError::Short(short)),
        None => Ok(levels),
    }
}

/// Largest difference of two visits of a level from opposite sides, the difference of their commands allowed for.
fn hysteresis_m(levels: &[Level], wanted_a: &[f64], slope: f64) -> f64 {
    let rest_m = |l: &Level| l.position_m.mean - slope * l.command_a.mean;
    let pairs = (0..levels.len()).flat_map(|i| (i + 1..levels.len()).map(move |j| (i, j)));
    let same = pairs.filter(|&(i, j)| wanted_a[i] == wanted_a[j]);
    same.map(|(i, j)| (rest_m(&levels[i]) - rest_m(&levels[j])).abs())
        .fold(0.0, f64::max)
}

/// Gain and offset of the current that flows, where the amplifier measured it at every level.
fn current(levels: &[Level]) -> Option<(f64, f64)> {
    if levels.iter().any(|level| level.actual_a.count == 0.0) {
        return None;
    }
    let (offset_a, gain, _) = line(levels.iter().map(|l| (l.command_a.mean, l.actual_a.mean)));
    Some((gain, offset_a))
}

/// Offset, slope and the slope's standard deviation of the least-squares line y = offset + slope x.
fn line(points: impl Iterator<Item = (f64, f64)> + Clone) -> (f64, f64, f64) {
    let n = points.clone().count() as f64;
    let (x, y) = points
        .clone()
        .fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (xx, xy) = points.clone().fold((0.0, 0.0), |(xx, xy), p| {
        (xx + (p.0 - x) * (p.0 - x), xy + (p.0 - x) * (p.1 - y))
    });
    let slope = xy / xx;
    let offset = y - slope * x;
    let square: f64 = points
        .map(|p| (p.1 - offset - slope * p.0) * (p.1 - offset - slope * p.0))
        .sum();
    (offset, slope, (square / (n - 2.0).max(1.0) / xx).sqrt())
}
