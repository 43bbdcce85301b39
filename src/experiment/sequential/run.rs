//! The sequence of shots.

use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;

use super::amplitude::{amplitude_of_fit, first_config, next_config};
use super::evidence::Evidence;
use super::information::{FirstShot, InformationByFrequency};
use super::next_shot::{NextShot, next_shot};
use super::shot::Shot;
use crate::config::{Config, validate};
use crate::excitation::AmplitudeCurve;
use crate::experiment::analysis::{Analysis, VerdictScope};
use crate::experiment::ending::Ending;
use crate::experiment::error::ExperimentError;
use crate::experiment::plan::Plan;
use crate::experiment::prediction::predicted_extremes;
use crate::experiment::run::Run;
use crate::experiment::runner::close;
use crate::identify::modal::MeasurementChain;
use crate::identify::verdict::{Certainty, Cnmp, DecisiveQuantity, MAX_LOOKS, decisive_quantities};
use crate::model::plant::{self, ModalModel};

/// The default limit of the motion, in lengths of the first shot.
const DEFAULT_LIMIT: f64 = 20.0;
/// The sequence ends early, because nothing can be decided, after this number of shots or more.
const MIN_LOOKS: usize = 2;
/// A verdict needs this number of modes.
const MIN_MODES: usize = 2;

/// A shot with the verdict of all data up to it.
#[derive(Clone, Debug, Serialize)]
pub struct ShotSummary {
    /// Band and length.
    #[serde(flatten)]
    pub shot: Shot,
    /// Its recording.
    pub recording: String,
    /// The verdict of this and all earlier shots.
    pub cnmp: Cnmp,
    /// The reasons.
    pub why: String,
}

/// Why a sequence ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "end")]
pub enum SequenceEnd {
    /// The verdict is certain.
    Decided,
    /// The motion or the number of looks reached its limit.
    LimitReached,
    /// More motion is predicted to be necessary than is allowed.
    NeedsMoreMotion {
        /// The predicted motion in seconds.
        needed_s: f64,
    },
    /// The model has fewer modes with a residue than a verdict needs, and all of them are found.
    Undecidable,
    /// A run was stopped or tripped, or the sequence was stopped between two runs.
    Interrupted,
}

/// What ends a sequence before the verdict is certain.
#[derive(Clone, Copy, Debug)]
pub struct SequenceLimits<'a> {
    /// Largest length of all sweeps in seconds.
    pub max_motion_s: f64,
    /// When it is set, no other shot begins.
    pub stop: &'a AtomicBool,
}

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

fn motion_s(shots: &[ShotSummary]) -> f64 {
    let lengths = shots.iter().map(|shot| shot.shot.duration_s);
    lengths.fold(0.0, |sum, length| sum + length)
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
    let mut experiment = SequentialExperiment::of(base, limits)?;
    let mut shot = Shot::first(base)?;
    shot.duration_s = shot.duration_s.min(limits.max_motion_s);
    let mut config = first_config(base, &shot)?;
    loop {
        predicted_extremes(&config)?;
        // Settings that are not allowed could not be read back from the recording.
        validate(&config)?;
        let mut run = make_run(&Plan::chirp(config.clone()))?;
        run.totals()?;
        let is_complete = Ending::from(&run.ended) == Ending::Completed;
        if !is_complete {
            return Ok(experiment.ended(SequenceEnd::Interrupted, run, config));
        }
        let summary = experiment.add(&run, shot, &config)?;
        watch(&summary);
        let next = experiment.next()?;
        let next = match next {
            Step::End(end) => return Ok(experiment.ended(end, run, config)),
            Step::Shot(next) => next,
        };
        close(run, &summary)?;
        (shot, config) = (next.shot, next.config);
    }
}

/// What follows a look at the data.
enum Step {
    Shot(Box<PlannedShot>),
    End(SequenceEnd),
}

struct PlannedShot {
    shot: Shot,
    config: Config,
}

/// The state between two shots.
struct SequentialExperiment<'a> {
    base: &'a Config,
    limits: SequenceLimits<'a>,
    chain: MeasurementChain,
    scope: VerdictScope,
    evidence: Evidence,
    first: Option<FirstShot>,
    analysis: Option<Analysis>,
    shots: Vec<ShotSummary>,
}

impl<'a> SequentialExperiment<'a> {
    fn of(
        base: &'a Config,
        limits: SequenceLimits<'a>,
    ) -> Result<SequentialExperiment<'a>, ExperimentError> {
        let modal = ModalModel::of(&plant::build(&base.plant)?)?;
        Ok(SequentialExperiment {
            base,
            limits,
            chain: MeasurementChain::bench(base),
            scope: VerdictScope::of_model(&modal, Certainty::REPEATED_LOOKS),
            evidence: Evidence::default(),
            first: None,
            analysis: None,
            shots: Vec::new(),
        })
    }

    /// Adds the run of a shot, and analyses all data.
    fn add(
        &mut self,
        run: &Run,
        shot: Shot,
        config: &Config,
    ) -> Result<ShotSummary, ExperimentError> {
        let data = self.evidence.add(&run.path, config)?;
        self.first.get_or_insert_with(|| FirstShot {
            shot,
            data,
            amplitude: AmplitudeCurve::of_current(&config.chirp.amplitude),
        });
        let analysis = self.evidence.analysis(self.base)?;
        let summary = ShotSummary {
            shot,
            recording: run.path.display().to_string(),
            cnmp: analysis.verdict.cnmp,
            why: analysis.verdict.why.clone(),
        };
        self.analysis = Some(analysis);
        self.shots.push(summary.clone());
        Ok(summary)
    }

    /// The next shot, or why there is none.
    fn next(&self) -> Result<Step, ExperimentError> {
        let (Some(first), Some(analysis)) = (&self.first, &self.analysis) else {
            return Ok(Step::End(SequenceEnd::LimitReached));
        };
        if let Some(end) = self.early_end(analysis) {
            return Ok(Step::End(end));
        }
        let left_s = self.limits.max_motion_s - motion_s(&self.shots);
        let shot = match self.informative_shot(first, analysis, left_s)? {
            Some(NextShot::Needs(needed_s)) if self.shots.len() >= MIN_LOOKS => {
                return Ok(Step::End(SequenceEnd::NeedsMoreMotion { needed_s }));
            }
            Some(NextShot::Take(shot)) => shot,
            Some(NextShot::Needs(_)) | None => repeated(&first.shot, self.shots.len()),
        };
        if shot.duration_s > left_s {
            return Ok(Step::End(SequenceEnd::LimitReached));
        }
        self.planned(first, analysis, shot)
    }

    /// Why no other shot is planned.
    fn early_end(&self, analysis: &Analysis) -> Option<SequenceEnd> {
        let looks = self.shots.len();
        if analysis.verdict.cnmp != Cnmp::Undecided {
            Some(SequenceEnd::Decided)
        } else if self.limits.stop.load(Ordering::Relaxed) {
            Some(SequenceEnd::Interrupted)
        } else if looks >= MAX_LOOKS {
            Some(SequenceEnd::LimitReached)
        } else if looks >= MIN_LOOKS && self.is_undecidable(analysis) {
            Some(SequenceEnd::Undecidable)
        } else {
            None
        }
    }

    /// Whether the model has fewer modes with a residue than a verdict needs, and all of them are found.
    fn is_undecidable(&self, analysis: &Analysis) -> bool {
        let found = analysis.fit.as_ref().map_or(0, |fit| fit.modes().len());
        let expected = self.scope.expected_modes.unwrap_or(0);
        analysis.verdict.phase_drop.is_none() && expected < MIN_MODES && found >= expected
    }

    /// The shot with the most information about the quantities that decide; `None` if there are none, or if nothing can be predicted.
    fn informative_shot(
        &self,
        first: &FirstShot,
        analysis: &Analysis,
        left_s: f64,
    ) -> Result<Option<NextShot>, ExperimentError> {
        let Ok(fit) = &analysis.fit else {
            return Ok(None);
        };
        let input = self.scope.input(fit, &self.evidence.data, &self.chain);
        let quantities: Vec<DecisiveQuantity> = decisive_quantities(&input)?;
        if quantities.is_empty() {
            return Ok(None);
        }
        let points = amplitude_of_fit(self.base, &first.shot, &self.chain, fit);
        let amplitude = AmplitudeCurve::of_current(&points);
        let information = InformationByFrequency::of(first, &self.chain, fit, &amplitude);
        let unit_s = first.shot.duration_s;
        Ok(
            information
                .and_then(|information| next_shot(&information, &quantities, unit_s, left_s)),
        )
    }

    fn planned(
        &self,
        first: &FirstShot,
        analysis: &Analysis,
        shot: Shot,
    ) -> Result<Step, ExperimentError> {
        let config = match &analysis.fit {
            Ok(fit) => {
                let amplitude = amplitude_of_fit(self.base, &first.shot, &self.chain, fit);
                next_config(self.base, &shot, amplitude)?
            }
            Err(_) => first_config(self.base, &shot)?,
        };
        Ok(Step::Shot(Box::new(PlannedShot { shot, config })))
    }

    fn ended(self, end: SequenceEnd, last: Run, config: Config) -> Sequence {
        Sequence {
            shots: self.shots,
            end,
            analysis: self.analysis,
            last,
            config,
        }
    }
}

/// The first shot again, twice as long after each look.
fn repeated(first: &Shot, looks: usize) -> Shot {
    Shot {
        duration_s: first.duration_s * f64::from(1u32 << looks.min(8)) / 2.0,
        ..*first
    }
}
