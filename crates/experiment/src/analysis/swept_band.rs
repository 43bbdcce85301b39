//! The band that a run excited: of a sweep that ended early, that up to the frequency which it had reached.
//!
//! ```text
//! band of [chirp] --the sweep came to its end, or the excitation does not sweep--> the same
//!                 --the sweep ended early--> from its first frequency to the one at which the signals begin to fade out
//! ```

use super::analysis_error::AnalysisError;
use super::ending::Ending;
use super::fade_out::FadeOut;
use bench_config::{Config, ReferenceSettings};
use bench_excitation::{Excitation, Pattern, ReferenceContext};
use bench_recording::Recording;

/// Bins of the record that a local model needs.
const MIN_BINS: f64 = 16.0;
/// A sweep is at its end if its frequency is nearer to the last one than this ratio: rounding.
const ROUNDING: f64 = 1e-9;

/// What swept the band.
pub(super) enum SweptBy<'a> {
    /// The current of an excitation with this pattern.
    Current(&'a Pattern),
    /// The reference of a closed loop.
    Reference,
}

/// What a run excited.
pub(super) struct SweptBand {
    /// In hertz.
    pub(super) band_hz: (f64, f64),
    /// The fade of the signals, if the sweep ended early.
    pub(super) fade_out: Option<FadeOut>,
}

/// The band that a run of this number of ticks excited.
///
/// # Errors
/// When a sweep ended too early to excite a band.
pub(super) fn swept_band(
    recording: &Recording,
    config: &Config,
    swept_by: &SweptBy<'_>,
    ticks: usize,
) -> Result<SweptBand, AnalysisError> {
    let band_hz = config.chirp.band_hz();
    let whole = SweptBand {
        band_hz,
        fade_out: None,
    };
    if Ending::of(recording) == Ending::Completed {
        return Ok(whole);
    }
    let frequency_hz = |tick| frequency_at_hz(config, swept_by, ticks, tick);
    let Some(reached_hz) = frequency_hz(ticks.saturating_sub(1))? else {
        return Ok(whole);
    };
    let (start_hz, stop_hz) = (config.chirp.start_hz, config.chirp.stop_hz);
    if (reached_hz - stop_hz).abs() <= ROUNDING * stop_hz {
        return Ok(whole);
    }
    let fade_out = FadeOut::of(ticks);
    let faded_hz = frequency_hz(fade_out.first_tick)?.unwrap_or(reached_hz);
    let band_hz = if start_hz < stop_hz {
        (band_hz.0, faded_hz)
    } else {
        (faded_hz, band_hz.1)
    };
    let bin_hz = config.servo.rate_hz / ticks.max(1) as f64;
    if band_hz.1 - band_hz.0 > MIN_BINS * bin_hz {
        Ok(SweptBand {
            band_hz,
            fade_out: Some(fade_out),
        })
    } else {
        Err(AnalysisError::EndedTooEarly {
            from_hz: start_hz,
            reached_hz,
        })
    }
}

/// The frequency of the sweep at a tick of a run of a number of ticks; `None` if no single sweep excited the run.
fn frequency_at_hz(
    config: &Config,
    swept_by: &SweptBy<'_>,
    ticks: usize,
    tick: usize,
) -> Result<Option<f64>, AnalysisError> {
    let tick = tick as u64;
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
            Ok(Some(sweep.frequency_at_hz(tick)))
        }
        SweptBy::Current(Pattern::Once) => sweep_frequency_hz(config, tick),
        // The mean of whole repetitions has the whole band.
        SweptBy::Current(Pattern::Repeated { period, .. }) if ticks < *period => {
            sweep_frequency_hz(config, tick)
        }
        SweptBy::Current(_) => Ok(None),
    }
}

fn sweep_frequency_hz(config: &Config, tick: u64) -> Result<Option<f64>, AnalysisError> {
    let excitation = config.chosen_excitation()?.build();
    Ok(excitation.frequency_at_hz(tick))
}
