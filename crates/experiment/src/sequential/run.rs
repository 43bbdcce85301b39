//! The sequence of shots.

use super::amplitude::first_config;
use super::planner::{PlannedShot, SequentialExperiment, Step};
use super::shot::Shot;
use super::summary::{SequenceEnd, SequenceLimits, ShotSummary, motion_s};
use crate::analysis::{Analysis, Ending};
use crate::errors::ExperimentError;
use crate::forecast::predicted_extremes;
use crate::live::Run;
use crate::plan::Plan;
use crate::run::close;
use bench_config::{Config, validate};

/// The default limit of the motion, in lengths of the first shot.
const DEFAULT_LIMIT: f64 = 20.0;

/// The result of a sequence.
pub struct Sequence {
    /// The shots that came to their end.
    pub shots: Vec<ShotSummary>,
    /// Why no other shot follows.
    pub end: SequenceEnd,
    /// The analysis of all shots; `None` if the first one did not come to its end.
    pub analysis: Option<Analysis>,
    /// The last run, whose recording is not closed yet.
    pub last: Run,
    /// The configuration of the last run.
    pub config: Config,
}

impl Sequence {
    /// Length of all sweeps in seconds.
    pub fn motion_s(&self) -> f64 {
        motion_s(&self.shots)
    }
}

/// The limit of the motion in seconds, if none is given: 20 first shots.
///
/// # Errors
/// When the model of the plant cannot be built.
pub fn default_max_motion_s(config: &Config) -> Result<f64, ExperimentError> {
    Ok(DEFAULT_LIMIT * Shot::first(config)?.duration_s)
}

/// The configuration of the first shot.
///
/// # Errors
/// When the model of the plant cannot be built.
pub fn first_shot_config(base: &Config) -> Result<Config, ExperimentError> {
    first_config(base, &Shot::first(base)?)
}

/// Makes shots until the verdict is certain or a limit is reached. `make_run` makes each run; `watch` is called after each shot.
///
/// # Errors
/// When a shot is refused or fails, or its recording contains no frequency response.
pub fn until_decided(
    base: &Config,
    limits: SequenceLimits<'_>,
    make_run: &mut dyn FnMut(&Plan) -> Result<Run, ExperimentError>,
    watch: &mut dyn FnMut(&ShotSummary),
) -> Result<Sequence, ExperimentError> {
    let mut planned = PlannedShot::first(base, limits.max_motion_s)?;
    let mut run = made(&planned, make_run)?;
    if !is_complete(&run) {
        return Ok(Sequence {
            shots: Vec::new(),
            end: SequenceEnd::Interrupted,
            analysis: None,
            last: run,
            config: planned.config,
        });
    }
    let (mut experiment, mut summary) =
        SequentialExperiment::after(base, limits, &planned, &mut run)?;
    loop {
        watch(&summary);
        planned = match experiment.next()? {
            Step::End(end) => return Ok(ended(experiment, end, run, planned)),
            Step::Shot(next) => *next,
        };
        close(run, &summary)?;
        run = made(&planned, make_run)?;
        if !is_complete(&run) {
            return Ok(ended(experiment, SequenceEnd::Interrupted, run, planned));
        }
        summary = experiment.add(&planned, &mut run)?;
    }
}

/// Checks a shot against the interlocks and makes its run, whose recording contains every tick.
fn made(
    planned: &PlannedShot,
    make_run: &mut dyn FnMut(&Plan) -> Result<Run, ExperimentError>,
) -> Result<Run, ExperimentError> {
    predicted_extremes(&planned.config)?;
    // Settings that are not allowed could not be read back from the recording.
    validate(&planned.config)?;
    let mut run = make_run(&Plan::chirp(planned.config.clone()))?;
    run.totals()?;
    Ok(run)
}

fn is_complete(run: &Run) -> bool {
    Ending::from(&run.end.servo) == Ending::Completed
}

fn ended(
    experiment: SequentialExperiment<'_>,
    end: SequenceEnd,
    last: Run,
    planned: PlannedShot,
) -> Sequence {
    Sequence {
        shots: experiment.shots,
        end,
        analysis: Some(experiment.analysis),
        last,
        config: planned.config,
    }
}
