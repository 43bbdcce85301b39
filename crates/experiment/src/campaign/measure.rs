//! The measurement of one point of a campaign.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::error::{CampaignError, file_error};
use super::point::{PointResult, analyse_point, sequence_result};
use crate::errors::ExperimentError;
use crate::forecast::predicted_extremes;
use crate::live::Run;
use crate::plan::Plan;
use crate::run::close;
use crate::sequential::{SequenceEnd, SequenceLimits, default_max_motion_s, until_decided};
use bench_base::checkpoint::FileAction;
use bench_config::Config;

/// How each point is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// One chirp, as configured. Campaigns of earlier versions have no other method.
    #[default]
    SingleChirp,
    /// Short chirps until the verdict is certain.
    UntilDecided,
}

impl Method {
    pub(super) fn is_single_chirp(&self) -> bool {
        *self == Method::SingleChirp
    }
}

/// One point of a campaign.
pub(super) struct PointMeasurement<'a> {
    /// The configuration at the point.
    pub(super) config: &'a Config,
    /// Folder of its recordings.
    pub(super) folder: &'a Path,
    /// Whether they are kept after the analysis.
    pub(super) keep_recordings: bool,
    pub(super) method: Method,
    /// When it is set, no other chirp begins.
    pub(super) stop: &'a AtomicBool,
}

type MakeRun<'a> = dyn FnMut(&Plan) -> Result<Run, ExperimentError> + 'a;

impl PointMeasurement<'_> {
    /// Makes, records and analyses the chirps of the point; `None` if they were stopped.
    pub(super) fn measure(
        &self,
        make_run: &mut MakeRun<'_>,
    ) -> Result<Option<PointResult>, CampaignError> {
        // There is a recording without a result if an earlier process was killed.
        remove(self.folder)?;
        let result = match self.method {
            Method::SingleChirp => self.single_chirp(make_run)?,
            Method::UntilDecided => self.until_decided(make_run)?,
        };
        if result.is_none() || !self.keep_recordings {
            remove(self.folder)?;
        }
        Ok(result)
    }

    fn single_chirp(
        &self,
        make_run: &mut MakeRun<'_>,
    ) -> Result<Option<PointResult>, CampaignError> {
        predicted_extremes(self.config)?;
        let mut run = make_run(&Plan::chirp(self.config.clone()))?;
        if run.end.stop_cause.is_some() {
            return Ok(None);
        }
        let result = analyse_point(&mut run, self.config).map_err(ExperimentError::from)?;
        close(run, &result)?;
        Ok(Some(result))
    }

    fn until_decided(
        &self,
        make_run: &mut MakeRun<'_>,
    ) -> Result<Option<PointResult>, CampaignError> {
        let limits = SequenceLimits {
            max_motion_s: default_max_motion_s(self.config)?,
            stop: self.stop,
        };
        let mut sequence = until_decided(self.config, limits, make_run, &mut |_| {})?;
        let tripped = sequence.last.end.servo.trip.is_some();
        if sequence.end == SequenceEnd::Interrupted && !tripped {
            return Ok(None);
        }
        let result = sequence_result(&mut sequence).map_err(ExperimentError::from)?;
        close(sequence.last, &result)?;
        Ok(Some(result))
    }
}

fn remove(folder: &Path) -> Result<(), CampaignError> {
    match std::fs::remove_dir_all(folder) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
            Err(file_error(FileAction::Remove, folder, &e))
        }
        _ => Ok(()),
    }
}
