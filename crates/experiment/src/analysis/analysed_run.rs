//! A run with its analysis.

use super::recorded_excitation::Analysis;
use bench_config::Config;
use bench_recording::Recording;

/// A run with its analysis and the configuration that it ran with.
#[derive(Clone, Copy, Debug)]
pub struct AnalysedRun<'a> {
    /// The recording of the run.
    pub recording: &'a Recording,
    /// Its analysis.
    pub analysis: &'a Analysis,
    /// The configuration that it ran with.
    pub config: &'a Config,
    /// Whether the analysis is that of this recording alone, so that it can certify the stage.
    pub is_one_recording: bool,
}

impl<'a> AnalysedRun<'a> {
    /// A run with the analysis of its recording.
    pub fn new(
        recording: &'a Recording,
        analysis: &'a Analysis,
        config: &'a Config,
    ) -> AnalysedRun<'a> {
        AnalysedRun {
            recording,
            analysis,
            config,
            is_one_recording: true,
        }
    }

    /// The run of the last of several shots, with the analysis of all of them.
    pub fn of_shots(
        recording: &'a Recording,
        analysis: &'a Analysis,
        config: &'a Config,
    ) -> AnalysedRun<'a> {
        AnalysedRun {
            is_one_recording: false,
            ..AnalysedRun::new(recording, analysis, config)
        }
    }
}
