//! What the run of a chirp says of its point.

use super::Point;
use crate::config::Config;
use crate::experiment::{Analysis, AnalysisError, Run, analyse};
use crate::identify::modal::FittedMode;
use crate::identify::verdict::{Cnmp, Verdict};
use crate::recording::{Recording, RecordingError};

/// Analyses a run that has come to its end. One that tripped, or whose recording carries no analysis, is undecided, and says
/// why. Fails where the recording cannot be read.
pub fn measured(run: &mut Run, config: &Config) -> Result<Point, RecordingError> {
    let loop_digest = format!("{:016x}", run.totals()?.loop_digest);
    let analysis = match run.ended.trip {
        Some((trip, tick)) => Err(format!(
            "the run tripped at tick {tick}: {trip}; {}",
            trip.remedy()
        )),
        None => match analyse(&Recording::open(&run.path)?, config) {
            Err(AnalysisError::Recording(error)) => return Err(error),
            other => other.map_err(|error| error.to_string()),
        },
    };
    Ok(match analysis {
        Ok(analysis) => said(&analysis, loop_digest),
        Err(why) => {
            let (modes_hz, signs, zeros_rad_s) = Default::default();
            Point {
                cnmp: Cnmp::Undecided,
                why,
                modes_hz,
                signs,
                zeros_rad_s,
                loop_digest,
                put_on: None,
            }
        }
    })
}

fn said(analysis: &Analysis, loop_digest: String) -> Point {
    let Verdict {
        cnmp, why, zeros, ..
    } = analysis.verdict.clone();
    let modes = analysis
        .fit
        .as_ref()
        .map(|fit| fit.modes())
        .unwrap_or_default();
    Point {
        cnmp,
        why,
        modes_hz: modes.iter().map(|mode| mode.frequency_hz().value).collect(),
        signs: modes.iter().map(FittedMode::sign).collect(),
        zeros_rad_s: zeros.iter().map(|zero| [zero.s.re, zero.s.im]).collect(),
        loop_digest,
        put_on: None,
    }
}
