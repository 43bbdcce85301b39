//! `bench chirp --until-decided`: short chirps until the verdict is certain.

use std::path::Path;

use serde::Serialize;

use super::analysis_output::{self, analysis_exit, analysis_failed, write_results};
use super::error::CliError;
use super::exit::Exit;
use super::output::print_text;
use super::progress::ProgressLine;
use super::run_options::{RunCommand, close, run_text};
use super::table::wrap;
use bench_base::progress::Progress;
use bench_config::Config;
use bench_experiment::outputs::{AnalysisOutputs, ExistingFile, ResultFiles};
use bench_experiment::sequential::{
    Sequence, SequenceEnd, SequenceLimits, Shot, ShotSummary, until_decided,
};
use bench_experiment::{AnalysedRun, Plan, RunError, RunSummary, Runner, Setup, stop_on_signal};
use bench_identify::verdict::MAX_LOOKS;
use bench_recording::Recording;
use bench_report::MagnitudeAxis;
use bench_report::run_pages::BenchRun;

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    run: RunSummary,
    shots: Vec<ShotSummary>,
    sequence: SequenceEnd,
    motion_s: f64,
    #[serde(flatten)]
    made: AnalysisOutputs,
}

/// What a sequence needs besides the configuration.
pub(super) struct SequenceCommand<'a> {
    pub(super) command: RunCommand<'a>,
    pub(super) magnitude_axis: MagnitudeAxis,
}

impl SequenceCommand<'_> {
    /// Makes the shots and writes the results of all of them beside the last recording.
    pub(super) fn measure(&self, base: &Config, max_motion_s: f64) -> Result<Exit, CliError> {
        let setup = self.command.setup(base)?;
        let json = self.command.bench().json;
        let sequence = stop_on_signal(|stop| {
            let limits = SequenceLimits { max_motion_s, stop };
            shots(base, limits, setup, json)
        });
        let failed = |error: RunError| CliError::Failed(error.to_string());
        self.report(sequence.map_err(failed)??)
    }

    fn report(&self, mut sequence: Sequence) -> Result<Exit, CliError> {
        let summary = RunSummary::of(&mut sequence.last)?;
        let path = sequence.last.path.clone();
        let made = outputs(&sequence, &path, self.magnitude_axis);
        let made = made.map_err(|error| analysis_failed(&error, &path))?;
        let report = Report {
            run: summary,
            motion_s: sequence.motion_s(),
            shots: sequence.shots,
            sequence: sequence.end,
            made,
        };
        let text = run_text(&report.run, &sequence.config)
            + &wrap(&end_text(report.sequence, report.motion_s), 2)
            + &analysis_output::text(&report.made);
        close(sequence.last, &report, self.command.bench().json, &text)?;
        let last = analysis_exit(&report.run, &report.made);
        Ok(sequence_exit(report.sequence, &report.shots, last))
    }
}

fn shots(
    base: &Config,
    limits: SequenceLimits<'_>,
    setup: Setup,
    json: bool,
) -> Result<Sequence, CliError> {
    let progress = Progress::new("chirp");
    let _line = ProgressLine::show(&progress);
    let runner = Runner::with_progress(setup, progress);
    let mut printed = Ok(());
    let mut number = 0;
    let mut watch = |shot: &ShotSummary| {
        number += 1;
        if !json && printed.is_ok() {
            printed = print_text(&shot_text(number, shot));
        }
    };
    let mut make_run = |plan: &Plan| runner.run(plan, "chirp");
    let sequence = until_decided(base, limits, &mut make_run, &mut watch)?;
    printed.map(|()| sequence)
}

/// The outcome of a sequence, given that of its last run. Losses of earlier chirps count as well, because the verdict uses the data of
/// all chirps.
fn sequence_exit(end: SequenceEnd, shots: &[ShotSummary], last: Exit) -> Exit {
    match (end, last) {
        (SequenceEnd::Interrupted, _) => Exit::Failed,
        (_, Exit::Done) if shots.iter().any(ShotSummary::has_losses) => Exit::Impaired,
        _ => last,
    }
}

/// Analysis, plots and page of all shots.
fn outputs(
    sequence: &Sequence,
    path: &Path,
    magnitude_axis: MagnitudeAxis,
) -> Result<AnalysisOutputs, CliError> {
    let Some(analysis) = &sequence.analysis else {
        return Ok(AnalysisOutputs::run_incomplete());
    };
    let recording = Recording::open(path)?;
    let shots: Vec<Shot> = sequence.shots.iter().map(|shot| shot.shot).collect();
    let run = AnalysedRun::of_shots(&recording, analysis, &sequence.config);
    let page = BenchRun::new(&recording, analysis, &sequence.config)
        .of_shots(excitation_text(&shots))
        .with_magnitude_axis(magnitude_axis);
    let results = ResultFiles {
        beside: path,
        existing: ExistingFile::Replace,
    };
    write_results(&run, &page, results)
}

/// `2 chirps (11.5 to 116 Hz, 3.1 s; 71 to 92 Hz, 1.5 s)`.
fn excitation_text(shots: &[Shot]) -> String {
    let plural = if shots.len() == 1 { "" } else { "s" };
    let texts: Vec<String> = shots.iter().map(band_text).collect();
    format!("{} chirp{plural} ({})", shots.len(), texts.join("; "))
}

fn band_text(shot: &Shot) -> String {
    let Shot {
        low_hz,
        high_hz,
        duration_s,
    } = shot;
    format!("{low_hz:.1} to {high_hz:.1} Hz, {duration_s:.1} s")
}

fn shot_text(number: usize, summary: &ShotSummary) -> String {
    let band = band_text(&summary.shot);
    let losses = if summary.has_losses() {
        format!(
            ", {} overruns, {} lost records",
            summary.overruns, summary.lost_records
        )
    } else {
        String::new()
    };
    let verdict = summary.cnmp.name();
    wrap(&format!("chirp {number}: {band}: {verdict}{losses}"), 0)
}

fn end_text(end: SequenceEnd, motion_s: f64) -> String {
    let why = match end {
        SequenceEnd::Decided => "the verdict is certain".into(),
        SequenceEnd::ChirpLimitReached => format!(
            "the verdict is not certain after {MAX_LOOKS} chirps, which is the limit; raise shape.travel_m or shape.current_ratio, or make one long chirp without --until-decided (--duration)"
        ),
        SequenceEnd::LimitReached => {
            "the verdict is not certain at the limit; allow more with --max-duration".into()
        }
        SequenceEnd::NeedsMoreMotion { needed_s } => format!(
            "the verdict is not certain, and about {needed_s:.0} s more are predicted to be necessary; allow them with --max-duration"
        ),
        SequenceEnd::Undecidable => {
            "the modes that the verdict needs have no residue at this operating point, so that no length of chirp decides it; measure at another operating point".into()
        }
        SequenceEnd::Interrupted => "stopped before the verdict was certain".into(),
    };
    format!("{motion_s:.1} s of motion: {why}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_identify::verdict::Cnmp;

    fn shot(overruns: u64, lost_records: u64) -> ShotSummary {
        ShotSummary {
            shot: Shot {
                low_hz: 10.0,
                high_hz: 100.0,
                duration_s: 3.0,
            },
            recording: "shot.mcap".into(),
            overruns,
            lost_records,
            cnmp: Cnmp::Excluded,
            why: String::new(),
        }
    }

    fn exit_of(end: SequenceEnd, shots: &[ShotSummary]) -> Exit {
        sequence_exit(end, shots, Exit::Done)
    }

    #[test]
    fn losses_of_an_earlier_chirp_make_the_result_impaired() {
        let end = SequenceEnd::Decided;
        assert_eq!(exit_of(end, &[shot(0, 0), shot(0, 0)]), Exit::Done);
        assert_eq!(exit_of(end, &[shot(1, 0), shot(0, 0)]), Exit::Impaired);
        assert_eq!(exit_of(end, &[shot(0, 1), shot(0, 0)]), Exit::Impaired);
    }

    #[test]
    fn interrupted_sequence_fails_also_with_losses() {
        let end = SequenceEnd::Interrupted;
        assert_eq!(exit_of(end, &[shot(1, 0)]), Exit::Failed);
    }

    #[test]
    fn remedy_after_the_last_permitted_chirp_is_not_more_motion() {
        let text = end_text(SequenceEnd::ChirpLimitReached, 9.0);
        assert!(text.contains("after 8 chirps") && !text.contains("--max-duration"));
        let text = end_text(SequenceEnd::LimitReached, 9.0);
        assert!(text.contains("--max-duration"));
    }
}
