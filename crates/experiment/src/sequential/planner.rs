//! What follows the data of the shots so far: the next shot, or the end.

use std::sync::atomic::Ordering;

use super::amplitude::{amplitude_of_fit, first_config, next_config};
use super::evidence::Evidence;
use super::information::{FirstShot, InformationByFrequency};
use super::next_shot::{NextShot, next_shot};
use super::shot::Shot;
use super::summary::{SequenceEnd, SequenceLimits, ShotSummary, motion_s};
use crate::analysis::{Analysis, scope_of_model};
use crate::errors::ExperimentError;
use crate::live::Run;
use crate::run::RunSummary;
use bench_config::Config;
use bench_excitation::AmplitudeCurve;
use bench_identify::modal::MeasurementChain;
use bench_identify::verdict::{Certainty, Cnmp, MAX_LOOKS, VerdictScope, decisive_quantities};
use bench_plant::ModalModel;

/// The sequence ends early, because nothing can be decided, after this number of shots or more.
const MIN_LOOKS: usize = 2;
/// A verdict needs this number of modes.
const MIN_MODES: usize = 2;

/// What follows a look at the data.
pub(super) enum Step {
    Shot(Box<PlannedShot>),
    End(SequenceEnd),
}

/// A shot with the configuration of its run.
pub(super) struct PlannedShot {
    pub(super) shot: Shot,
    pub(super) config: Config,
}

impl PlannedShot {
    /// The first shot, shortened to the permitted motion.
    pub(super) fn first(base: &Config, max_motion_s: f64) -> Result<PlannedShot, ExperimentError> {
        let mut shot = Shot::first(base)?;
        shot.duration_s = shot.duration_s.min(max_motion_s);
        let config = first_config(base, &shot)?;
        Ok(PlannedShot { shot, config })
    }
}

/// The data of the shots so far.
pub(super) struct SequentialExperiment<'a> {
    base: &'a Config,
    limits: SequenceLimits<'a>,
    chain: MeasurementChain,
    scope: VerdictScope,
    evidence: Evidence,
    first: FirstShot,
    /// The analysis of all shots.
    pub(super) analysis: Analysis,
    pub(super) shots: Vec<ShotSummary>,
}

impl<'a> SequentialExperiment<'a> {
    /// The experiment after its first shot.
    pub(super) fn after(
        base: &'a Config,
        limits: SequenceLimits<'a>,
        planned: &PlannedShot,
        run: &mut Run,
    ) -> Result<(SequentialExperiment<'a>, ShotSummary), ExperimentError> {
        let modal = ModalModel::of(&bench_plant::build(&base.plant)?)?;
        let mut evidence = Evidence::default();
        evidence.add(&run.path, &planned.config)?;
        let first = FirstShot {
            shot: planned.shot,
            data: evidence.frf.data.clone(),
            amplitude: AmplitudeCurve::of_current(&planned.config.chirp.amplitude),
        };
        let analysis = evidence.analysis(base)?;
        let summary = summary(planned, run, &analysis)?;
        let experiment = SequentialExperiment {
            base,
            limits,
            chain: MeasurementChain::bench(base),
            scope: scope_of_model(&modal, Certainty::REPEATED_LOOKS),
            evidence,
            first,
            shots: vec![summary.clone()],
            analysis,
        };
        Ok((experiment, summary))
    }

    /// Adds another shot, and analyses all data.
    pub(super) fn add(
        &mut self,
        planned: &PlannedShot,
        run: &mut Run,
    ) -> Result<ShotSummary, ExperimentError> {
        self.evidence.add(&run.path, &planned.config)?;
        self.analysis = self.evidence.analysis(self.base)?;
        let summary = summary(planned, run, &self.analysis)?;
        self.shots.push(summary.clone());
        Ok(summary)
    }

    /// The next shot, or why there is none.
    pub(super) fn next(&self) -> Result<Step, ExperimentError> {
        if let Some(end) = self.early_end() {
            return Ok(Step::End(end));
        }
        let left_s = self.limits.max_motion_s - motion_s(&self.shots);
        let shot = match self.informative_shot(left_s)? {
            Some(NextShot::Needs(needed_s)) if self.shots.len() >= MIN_LOOKS => {
                return Ok(Step::End(SequenceEnd::NeedsMoreMotion { needed_s }));
            }
            Some(NextShot::Take(shot)) => shot,
            Some(NextShot::Needs(_)) | None => repeated(&self.first.shot, self.shots.len()),
        };
        if shot.duration_s <= left_s {
            Ok(Step::Shot(Box::new(self.planned(shot)?)))
        } else {
            Ok(Step::End(SequenceEnd::LimitReached))
        }
    }

    /// Why no other shot is planned.
    fn early_end(&self) -> Option<SequenceEnd> {
        let looks = self.shots.len();
        if self.analysis.verdict.cnmp != Cnmp::Undecided {
            Some(SequenceEnd::Decided)
        } else if self.limits.stop.load(Ordering::Relaxed) {
            Some(SequenceEnd::Interrupted)
        } else if looks >= MAX_LOOKS {
            Some(SequenceEnd::ChirpLimitReached)
        } else if looks >= MIN_LOOKS && self.is_undecidable() {
            Some(SequenceEnd::Undecidable)
        } else {
            None
        }
    }

    /// Whether the model has fewer modes with a residue than a verdict needs, and all of them are found.
    fn is_undecidable(&self) -> bool {
        let found = self.analysis.fit.as_ref();
        let found = found.map_or(0, |fit| fit.modes().len());
        let expected = self.scope.expected_modes.unwrap_or(0);
        let has_phase_drop = self.analysis.verdict.phase_drop.is_some();
        !has_phase_drop && expected < MIN_MODES && found >= expected
    }

    /// The shot with the most information about the quantities that decide; `None` if there are none, or if nothing can be
    /// predicted.
    fn informative_shot(&self, left_s: f64) -> Result<Option<NextShot>, ExperimentError> {
        let Ok(fit) = &self.analysis.fit else {
            return Ok(None);
        };
        let input = self.scope.input(fit, &self.evidence.frf.data, &self.chain);
        let quantities = decisive_quantities(&input)?;
        if quantities.is_empty() {
            return Ok(None);
        }
        let points = amplitude_of_fit(self.base, &self.first.shot, &self.chain, fit);
        let amplitude = AmplitudeCurve::of_current(&points);
        let information = InformationByFrequency::of(&self.first, &self.chain, fit, &amplitude);
        let unit_s = self.first.shot.duration_s;
        let next = information
            .and_then(|information| next_shot(&information, &quantities, unit_s, left_s));
        Ok(next)
    }

    fn planned(&self, shot: Shot) -> Result<PlannedShot, ExperimentError> {
        let config = match &self.analysis.fit {
            Ok(fit) => {
                let amplitude = amplitude_of_fit(self.base, &self.first.shot, &self.chain, fit);
                next_config(self.base, &shot, amplitude)?
            }
            Err(_) => first_config(self.base, &shot)?,
        };
        Ok(PlannedShot { shot, config })
    }
}

/// A shot with the verdict of all data up to it.
fn summary(
    planned: &PlannedShot,
    run: &mut Run,
    analysis: &Analysis,
) -> Result<ShotSummary, ExperimentError> {
    let run = RunSummary::of(run)?;
    Ok(ShotSummary {
        shot: planned.shot,
        recording: run.recording,
        overruns: run.overruns,
        lost_records: run.lost_records,
        cnmp: analysis.verdict.cnmp,
        why: analysis.verdict.why.clone(),
    })
}

/// The first shot again, twice as long after each look.
fn repeated(first: &Shot, looks: usize) -> Shot {
    Shot {
        duration_s: first.duration_s * f64::from(1u32 << looks.min(MAX_LOOKS)) / 2.0,
        ..*first
    }
}

#[cfg(test)]
mod tests;
