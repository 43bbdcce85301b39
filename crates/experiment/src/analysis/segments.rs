//! The parts of a run from which its response is estimated. They depend on how the excitation repeats.
//!
//! | excitation | estimate |
//! |---|---|
//! | from rest to rest, once | from the whole record, with the configured estimator |
//! | from rest to rest, repeated | the same, from the mean of the repetitions, which has less noise |
//! | periodic | each line from the periods after those for settling, and the noise from their scatter; if lines are omitted, odd distortion is added to the noise |
//! | stepped sine | each sine from its own periods, and the noise from their scatter |

use bench_excitation::{Pattern, Window};
use bench_identify::harmonics::{InputSignal, harmonics};
use bench_identify::linearity::Linearity;
use bench_identify::periodic::{self, Periods, Repetition, with_pooled_noise};
use bench_identify::{Frf, IdentifyError, Signals, repeated};

/// A record to be estimated as a whole, or the estimate from the lines of a run.
pub(super) enum Segments {
    /// A record from rest to rest.
    Record(Signals),
    /// A response at single frequencies, and its linearity if lines are omitted between them.
    Lines(Frf, Option<Box<Linearity>>),
}

/// Divides a run by the pattern of its excitation.
pub(super) fn segments(
    signals: Signals,
    pattern: &Pattern,
    band_hz: (f64, f64),
) -> Result<Segments, IdentifyError> {
    match pattern {
        Pattern::Once => Ok(Segments::Record(signals)),
        Pattern::Repeated { period, count } => {
            Ok(Segments::Record(repeated::mean(&signals, *period, *count)))
        }
        Pattern::Periodic {
            start,
            period,
            skip,
            periods,
        } => {
            let whole = part(&signals, *start, (skip + periods) * period);
            let repetition = Repetition {
                period: *period,
                skip: *skip,
            };
            periodic_lines(&whole, band_hz, repetition)
        }
        Pattern::Stepped(windows) => estimate_stepped_sine(&signals, windows, band_hz),
    }
}

fn periodic_lines(
    signals: &Signals,
    band_hz: (f64, f64),
    repetition: Repetition,
) -> Result<Segments, IdentifyError> {
    let periods = periodic::estimate(signals, band_hz, repetition)?;
    let Some(lines) = harmonics(signals, band_hz, repetition, InputSignal::Commanded)? else {
        return Ok(Segments::Lines(periods.pooled(), None));
    };
    let linearity = Linearity::new(lines);
    let Periods {
        frf,
        input_powers,
        count,
    } = periods;
    let distorted = linearity.with_odd_distortion(&frf.data);
    let data = with_pooled_noise(&distorted, &input_powers, count);
    let frf = Frf { data, ..frf };
    Ok(Segments::Lines(frf, Some(Box::new(linearity))))
}

/// Up to `length` samples of a signal from `start` on.
fn part(signals: &Signals, start: usize, length: usize) -> Signals {
    let of = |samples: &[f64]| samples.iter().skip(start).take(length).copied().collect();
    Signals {
        rate_hz: signals.rate_hz,
        input: of(&signals.input),
        output: of(&signals.output),
    }
}

/// Estimates the response at each sine from its periods.
fn estimate_stepped_sine(
    signals: &Signals,
    windows: &[Window],
    (low_hz, high_hz): (f64, f64),
) -> Result<Segments, IdentifyError> {
    let (mut frf, mut input_powers) = (Frf::default(), Vec::new());
    let mut fewest = usize::MAX;
    for (hz, window) in rising_windows(signals, windows) {
        match sine(signals, window, hz) {
            Ok(periods) => {
                frf.append(periods.frf);
                input_powers.extend(periods.input_powers);
                fewest = fewest.min(periods.count);
            }
            // The other sines are still usable.
            Err(IdentifyError::NotExcited { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    if frf.data.is_empty() {
        Err(IdentifyError::NotExcited { low_hz, high_hz })
    } else {
        let data = with_pooled_noise(&frf.data, &input_powers, fewest);
        Ok(Segments::Lines(Frf { data, ..frf }, None))
    }
}

/// The complete windows with their frequencies, rising; an upward and a downward sweep give the same order.
fn rising_windows<'a>(signals: &Signals, windows: &'a [Window]) -> Vec<(f64, &'a Window)> {
    // The last window of a run that was stopped is not complete.
    let complete = windows.iter().filter(|w| end(w) <= signals.len());
    let with_frequency = complete.map(|window| (frequency_hz(window, signals.rate_hz), window));
    let mut rising: Vec<(f64, &Window)> = with_frequency.collect();
    rising.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Different sines may have the same frequency once their periods are whole ticks.
    rising.dedup_by(|a, b| a.0 <= b.0);
    rising
}

/// The tick after a window.
fn end(window: &Window) -> usize {
    window.start + window.period * window.periods
}

fn frequency_hz(window: &Window, rate_hz: f64) -> f64 {
    window.turns as f64 * rate_hz / window.period as f64
}

fn sine(signals: &Signals, window: &Window, frequency_hz: f64) -> Result<Periods, IdentifyError> {
    let line_hz = signals.rate_hz / window.period as f64;
    let band_hz = (frequency_hz - 0.25 * line_hz, frequency_hz + 0.25 * line_hz);
    let repetition = Repetition {
        period: window.period,
        skip: 0,
    };
    periodic::estimate(
        &part(signals, window.start, window.period * window.periods),
        band_hz,
        repetition,
    )
}
