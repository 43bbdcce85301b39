//! The results of a recorded run without a frequency response: static steps, a rest position, a stage check.

use crate::calibration::{StaircaseResult, staircase};
use crate::campaign::RestPosition;
use crate::plan::RunKind;
use crate::stage_check::StageCheck;
use bench_config::Config;
use bench_recording::Recording;

/// What a run without a frequency response has found.
#[derive(Clone, Debug)]
pub enum BasicResults {
    /// The static steps of a calibration.
    Staircase(StaircaseResult),
    /// The rest position of a run without current.
    Rest(RestPosition),
    /// A check of the stage before a loop closes.
    StageCheck(StageCheck),
    /// Nothing, with the reason.
    Nothing(String),
}

impl BasicResults {
    /// The results of a recording by its kind. `why` is the reason why an excitation or a closed loop has no analysis.
    pub fn of(recording: &Recording, kind: RunKind, config: &Config, why: &str) -> BasicResults {
        match kind {
            RunKind::Calibrate => match staircase(recording, config) {
                Ok(result) => BasicResults::Staircase(result),
                Err(why) => BasicResults::Nothing(why),
            },
            RunKind::Quiet => {
                let name = recording.path().display().to_string();
                match RestPosition::of(recording, &name) {
                    Ok(rest) => BasicResults::Rest(rest),
                    Err(error) => BasicResults::Nothing(error.to_string()),
                }
            }
            RunKind::StageCheck => match StageCheck::recorded(recording) {
                Some(check) => BasicResults::StageCheck(check),
                None => {
                    BasicResults::Nothing("the recording contains no result of the check".into())
                }
            },
            RunKind::Chirp | RunKind::Control => BasicResults::Nothing(why.into()),
        }
    }
}
