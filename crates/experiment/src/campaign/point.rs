//! The result of a campaign at one point.

use serde::{Deserialize, Serialize};

use super::load::LoadCheck;
use crate::analysis::{Analysis, AnalysisError, ReadSignals, analyse, never_cancels};
use crate::live::Run;
use crate::sequential::Sequence;
use bench_config::Config;
use bench_identify::modal::FittedMode;
use bench_identify::verdict::Cnmp;
use bench_recording::{Recording, RecordingError};

/// Verdict, modes and zeros of the chirps at one point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointResult {
    /// Verdict on CNMP zeros.
    pub cnmp: Cnmp,
    /// Reasons of the verdict.
    pub why: String,
    /// Frequencies of the modes in hertz, lowest first.
    pub modes_hz: Vec<f64>,
    /// Signs of their residues.
    pub signs: String,
    /// The zeros with damping in the band of the verdict, as real and imaginary part in rad/s, without those below the real axis.
    pub zeros_rad_s: Vec<[f64; 2]>,
    /// Equal for two runs whose loops had the same input and output, bit for bit.
    pub loop_digest: String,
    /// Length of all chirps in seconds, if several were made until the verdict was certain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion_s: Option<f64>,
    /// The load that the operator set, and its check; none on the simulated stage.
    #[serde(default, skip_serializing_if = "Option::is_none", alias = "put_on")]
    pub load_check: Option<LoadCheck>,
}

impl PointResult {
    /// Frequency in hertz and sign of the residue of each mode.
    pub fn modes(&self) -> Vec<(f64, char)> {
        let frequencies = self.modes_hz.iter().copied();
        frequencies.zip(self.signs.chars()).collect()
    }
}

/// Analyses the finished run of a point. A run that tripped, or whose recording contains no frequency response, is undecided
/// with the reason. Fails if the recording cannot be read.
pub fn analyse_point(run: &mut Run, config: &Config) -> Result<PointResult, RecordingError> {
    let loop_digest = format!("{:016x}", run.totals()?.loop_digest);
    if let Some(why) = trip_reason(run) {
        return Ok(undecided(why, loop_digest));
    }
    match analyse(
        &Recording::open(&run.path)?,
        ReadSignals::default(),
        config,
        &mut never_cancels,
    ) {
        Ok(analysis) => Ok(result(&analysis, loop_digest)),
        Err(AnalysisError::Recording(error)) => Err(error),
        Err(error) => Ok(undecided(error.to_string(), loop_digest)),
    }
}

/// The result of the chirps of a point that were made until the verdict was certain.
///
/// # Errors
/// When the last recording was removed.
pub(super) fn sequence_result(sequence: &mut Sequence) -> Result<PointResult, RecordingError> {
    let loop_digest = format!("{:016x}", sequence.last.totals()?.loop_digest);
    let motion_s = Some(sequence.motion_s());
    let analysed = match (trip_reason(&sequence.last), &sequence.analysis) {
        (None, Some(analysis)) => result(analysis, loop_digest),
        (why, _) => undecided(why.unwrap_or_default(), loop_digest),
    };
    Ok(PointResult {
        motion_s,
        ..analysed
    })
}

/// Why a run that tripped has no result.
fn trip_reason(run: &Run) -> Option<String> {
    let (trip, tick) = run.end.servo.trip?;
    let remedy = trip.remedy();
    Some(format!("the run tripped at tick {tick}: {trip}; {remedy}"))
}

fn undecided(why: String, loop_digest: String) -> PointResult {
    PointResult {
        cnmp: Cnmp::Undecided,
        why,
        modes_hz: Vec::new(),
        signs: String::new(),
        zeros_rad_s: Vec::new(),
        loop_digest,
        motion_s: None,
        load_check: None,
    }
}

fn result(analysis: &Analysis, loop_digest: String) -> PointResult {
    let verdict = &analysis.verdict;
    let modes = analysis.fit.as_ref().map(|fit| fit.modes());
    let modes = modes.unwrap_or_default();
    PointResult {
        cnmp: verdict.cnmp,
        why: verdict.why.clone(),
        modes_hz: modes.iter().map(|mode| mode.frequency_hz().value).collect(),
        signs: modes.iter().map(FittedMode::sign).collect(),
        zeros_rad_s: verdict.zeros.iter().map(|z| [z.s.re, z.s.im]).collect(),
        loop_digest,
        motion_s: None,
        load_check: None,
    }
}
