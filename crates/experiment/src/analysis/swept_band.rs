//! The band that a run excited: of a sweep that ended early, that up to the frequency which it had reached.
//!
//! ```text
//! band of [chirp] --the run was completed, or its excitation does not sweep--> the same
//!                 --the sweep ended at f--> from its first frequency to f, without the last bins
//! ```

use super::analysis_error::AnalysisError;
use super::ending::Ending;
use bench_config::{Config, ReferenceSettings};
use bench_excitation::{Excitation, Pattern, ReferenceContext};
use bench_recording::Recording;

/// Bins of the record before the last frequency of a sweep that ended early: the local model of a frequency there would need bins that
/// are not excited.
const EDGE_BINS: f64 = 16.0;

/// What swept the band.
pub(super) enum SweptBy<'a> {
    /// The current of an excitation with this pattern.
    Current(&'a Pattern),
    /// The reference of a closed loop.
    Reference,
}

/// The band in hertz that a run of this number of ticks excited.
///
/// # Errors
/// When a sweep ended too early to excite a band.
pub(super) fn swept_band_hz(
    recording: &Recording,
    config: &Config,
    swept_by: &SweptBy<'_>,
    ticks: usize,
) -> Result<(f64, f64), AnalysisError> {
    let band_hz = config.chirp.band_hz();
    if Ending::of(recording) == Ending::Completed {
        return Ok(band_hz);
    }
    let Some(reached_hz) = reached_hz(config, swept_by, ticks)? else {
        return Ok(band_hz);
    };
    let edge_hz = EDGE_BINS * config.servo.rate_hz / ticks.max(1) as f64;
    let swept_hz = if config.chirp.start_hz < config.chirp.stop_hz {
        (band_hz.0, band_hz.1.min(reached_hz - edge_hz))
    } else {
        (band_hz.0.max(reached_hz + edge_hz), band_hz.1)
    };
    if swept_hz.0 < swept_hz.1 {
        Ok(swept_hz)
    } else {
        Err(AnalysisError::EndedTooEarly {
            from_hz: config.chirp.start_hz,
            reached_hz,
        })
    }
}

/// The frequency that a sweep had reached when it ended; `None` if it came to its end, or if the excitation is no sweep.
fn reached_hz(
    config: &Config,
    swept_by: &SweptBy<'_>,
    ticks: usize,
) -> Result<Option<f64>, AnalysisError> {
    let last_tick = ticks.saturating_sub(1) as u64;
    match swept_by {
        SweptBy::Reference => {
            let ReferenceSettings::Chirp(swept) = &config.control.reference else {
                return Ok(None);
            };
            let sweep = swept.sweep(&ReferenceContext {
                chirp: &config.chirp,
                period_s: config.servo.period_s(),
                file: None,
            });
            Ok(Some(sweep.frequency_at_hz(last_tick)))
        }
        SweptBy::Current(Pattern::Once) => sweep_frequency_hz(config, last_tick),
        // The mean of whole repetitions has the whole band.
        SweptBy::Current(Pattern::Repeated { period, .. }) if ticks < *period => {
            sweep_frequency_hz(config, last_tick)
        }
        SweptBy::Current(_) => Ok(None),
    }
}

fn sweep_frequency_hz(config: &Config, tick: u64) -> Result<Option<f64>, AnalysisError> {
    let excitation = config.chosen_excitation()?.build();
    Ok(excitation.frequency_at_hz(tick))
}
