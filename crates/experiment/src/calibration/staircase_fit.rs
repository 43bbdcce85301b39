//! Fits the recording of a staircase of static currents: compliance with its sign, rest position, linearity, hysteresis.

use bench_base::running_stats::RunningStats;
use bench_config::{CalibrateSettings, ScaleBy};
use bench_excitation::Staircase;
use bench_recording::{Recording, RecordingError};
use bench_rt::arming::State;
use bench_rt::record::TickRecord;

/// The stage must move by this many standard deviations of the mean of a level.
const MIN_SIGMAS: f64 = 20.0;

/// A staircase without a usable fit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StaircaseError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A level has no ticks.
    #[error(
        "level {0} of the staircase has no ticks in the recording, because the run was not completed; repeat the run"
    )]
    Short(usize),
    /// The stage did not move.
    #[error(
        "the reading changed by {travel_m:.3e} m over the whole staircase, with a noise of {noise_m:.3e} m in the mean of a level: the stage does not follow the current; check motor, amplifier and probe, or raise calibrate.amplitude_a"
    )]
    NoMotion {
        /// Travel from the lowest to the highest level.
        travel_m: f64,
        /// Standard deviation of the mean of a level.
        noise_m: f64,
    },
    /// The readings are not on a straight line.
    #[error(
        "{what} is {found:.4} of the travel, above the limit of {limit} ({setting}): friction, a stop, or a probe near the end of its range is likely; examine the recording"
    )]
    NotStraight {
        /// The quantity that is too large.
        what: &'static str,
        /// Its value.
        found: f64,
        /// The limit.
        limit: f64,
        /// The setting.
        setting: &'static str,
    },
}

/// The fit of a staircase, in readings and commands as recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaircaseFit {
    /// Change of the reading in metres per ampere of command, with its sign.
    pub compliance_m_per_a: f64,
    /// Its standard deviation, from the scatter around the line.
    pub compliance_sigma_m_per_a: f64,
    /// Reading in metres at zero command, by the line.
    pub rest_m: f64,
    /// See [`bench_rig::calibration::ChainCalibration::nonlinearity_ratio`].
    pub nonlinearity_ratio: f64,
    /// See [`bench_rig::calibration::ChainCalibration::hysteresis_ratio`].
    pub hysteresis_ratio: f64,
    /// RMS of the readings around the means of their levels, in metres.
    pub noise_rms_m: f64,
    /// Gain and offset of the measured current over the command, if the amplifier measures its current.
    pub current: Option<(f64, f64)>,
}

/// Fits the recording of a staircase with these settings and this period.
pub fn fit(
    recording: &Recording,
    settings: &CalibrateSettings,
    period_s: f64,
) -> Result<StaircaseFit, StaircaseError> {
    let staircase = Staircase::new(&settings.steps(), period_s);
    let levels = levels(recording, &staircase)?;
    let (rest_m, slope, sigma) = line(levels.iter().map(Level::reading));
    let noise = mean_variance(&levels);
    let travel_m = (slope * 2.0 * settings.amplitude_a).abs();
    require_motion(travel_m, (noise / shortest(&levels)).sqrt())?;
    let fit = StaircaseFit {
        compliance_m_per_a: slope,
        compliance_sigma_m_per_a: sigma,
        rest_m,
        nonlinearity_ratio: nonlinearity_m(&levels, rest_m, slope) / travel_m,
        hysteresis_ratio: hysteresis_m(&levels, staircase.levels_a(), slope) / travel_m,
        noise_rms_m: noise.sqrt(),
        current: current(&levels),
    };
    require_straight(&fit, settings)?;
    Ok(fit)
}

fn require_motion(travel_m: f64, noise_m: f64) -> Result<(), StaircaseError> {
    if travel_m > MIN_SIGMAS * noise_m {
        return Ok(());
    }
    // NaN is refused as well.
    Err(StaircaseError::NoMotion { travel_m, noise_m })
}

impl StaircaseFit {
    /// Metres per metre of reading that a calibration applies: the sign, and the scale if `scale_by` states a reference for it.
    pub fn probe_gain(&self, scale_by: ScaleBy, model_m_per_a: f64) -> f64 {
        let gain = self.current.map_or(1.0, |(gain, _)| gain);
        match scale_by {
            ScaleBy::Nothing => self.compliance_m_per_a.signum() * model_m_per_a.signum(),
            ScaleBy::Model => model_m_per_a * gain / self.compliance_m_per_a,
        }
    }
}

fn require_straight(
    fit: &StaircaseFit,
    settings: &CalibrateSettings,
) -> Result<(), StaircaseError> {
    require_ratio(
        "the difference between rising and falling current",
        fit.hysteresis_ratio,
        settings.max_hysteresis_ratio,
        "calibrate.max_hysteresis_ratio",
    )?;
    require_ratio(
        "the deviation from a straight line",
        fit.nonlinearity_ratio,
        settings.max_nonlinearity_ratio,
        "calibrate.max_nonlinearity_ratio",
    )
}

fn require_ratio(
    what: &'static str,
    found: f64,
    limit: f64,
    setting: &'static str,
) -> Result<(), StaircaseError> {
    if found > limit {
        return Err(StaircaseError::NotStraight {
            what,
            found,
            limit,
            setting,
        });
    }
    Ok(())
}

#[derive(Clone, Copy, Debug, Default)]
struct Level {
    command_a: RunningStats,
    position_m: RunningStats,
    actual_a: RunningStats,
}

impl Level {
    /// Mean command and mean reading.
    fn reading(&self) -> (f64, f64) {
        (self.command_a.mean, self.position_m.mean)
    }

    fn push(&mut self, record: &TickRecord) {
        self.command_a.push(record.command_a);
        self.position_m.push(record.position_m);
        if let Some(actual_a) = record.actual_a {
            self.actual_a.push(actual_a);
        }
    }
}

fn mean_variance(levels: &[Level]) -> f64 {
    let sigmas = levels.iter().filter_map(|level| level.position_m.sigma());
    sigmas.map(|sigma| sigma * sigma).sum::<f64>() / levels.len() as f64
}

/// Ticks of the shortest level.
fn shortest(levels: &[Level]) -> f64 {
    let counts = levels.iter().map(|level| level.position_m.count);
    counts.fold(f64::INFINITY, f64::min)
}

/// Largest distance of a level from the line.
fn nonlinearity_m(levels: &[Level], rest_m: f64, slope: f64) -> f64 {
    let distances = levels.iter().map(|level| {
        let (command_a, position_m) = level.reading();
        (position_m - rest_m - slope * command_a).abs()
    });
    distances.fold(0.0, f64::max)
}

fn levels(recording: &Recording, staircase: &Staircase) -> Result<Vec<Level>, StaircaseError> {
    let mut levels = vec![Level::default(); staircase.levels_a().len()];
    let mut first = None;
    for record in recording.ticks()? {
        let record = record?;
        if record.state != State::Running {
            continue;
        }
        let first = *first.get_or_insert(record.tick);
        if let Some(level) = staircase.level(record.tick - first) {
            levels[level].push(&record);
        }
    }
    match levels.iter().position(|level| level.position_m.count < 2.0) {
        Some(short) => Err(StaircaseError::Short(short)),
        None => Ok(levels),
    }
}

/// Largest difference between two visits of a level from opposite sides, corrected for the difference of their commands.
fn hysteresis_m(levels: &[Level], wanted_a: &[f64], slope: f64) -> f64 {
    let rest_m = |l: &Level| l.position_m.mean - slope * l.command_a.mean;
    let pairs = (0..levels.len()).flat_map(|i| (i + 1..levels.len()).map(move |j| (i, j)));
    let same = pairs.filter(|&(i, j)| wanted_a[i] == wanted_a[j]);
    same.map(|(i, j)| (rest_m(&levels[i]) - rest_m(&levels[j])).abs())
        .fold(0.0, f64::max)
}

/// Gain and offset of the measured current, if the amplifier measured it at every level.
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
