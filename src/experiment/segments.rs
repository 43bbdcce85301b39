//! The response of a run by how its excitation repeats.
//!
//! | excitation | what is estimated |
//! |---|---|
//! | from rest to rest, once | the whole record, as configured |
//! | from rest to rest, repeated | the mean of the repetitions, tick by tick, as one record: the same signal with less noise |
//! | periodic | each line from the periods after the settled ones, the noise from their scatter, and, where lines were left out, odd distortion as a noise of its own |
//! | one sine after the other | each sine from its frf_data, likewise |

use crate::excitation::{Pattern, Window};
use crate::identify::harmonics::harmonics;
use crate::identify::linearity::Linearity;
use crate::identify::periodic::{self, Periods, Repetition};
use crate::identify::{Frf, FrfDatum, IdentifyError, Signals, repeated};

/// Lines to either side over which the noise is averaged for a fit.
const NEIGHBOURS: usize = 4;

/// What the lines of a run show, or the record to be estimated as a whole.
pub(super) enum Segments {
    /// A record from rest to rest.
    Record(Signals),
    /// A response at single frequencies; how linear it is, where lines between were left out.
    Lines(Frf, Vec<FrfDatum>, Option<Box<Linearity>>),
}

/// Takes a run apart.
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
            let Periods { frf, frf_data, .. } = periodic::estimate(&whole, band_hz, repetition)?;
            let linearity = harmonics(&whole, band_hz, repetition)?
                .map(|lines| Box::new(Linearity::new(lines)));
            let frf_data = linearity
                .as_ref()
                .map_or_else(|| frf_data.clone(), |l| l.with_odd_distortion(&frf_data));
            Ok(Segments::Lines(
                frf,
                with_noise_of_neighbours(&frf_data),
                linearity,
            ))
        }
        Pattern::Stepped(windows) => stepped(&signals, windows, band_hz),
    }
}

/// The frf_data with the mean variance of the lines around each: the noise of a line alone, by the scatter of a few periods, comes
/// out far too small now and then, and a fit would take such a line for a mode.
fn with_noise_of_neighbours(frf_data: &[FrfDatum]) -> Vec<FrfDatum> {
    let around = |k: usize| {
        let near =
            &frf_data[k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(frf_data.len())];
        near.iter().map(|block| block.variance).sum::<f64>() / near.len() as f64
    };
    frf_data
        .iter()
        .enumerate()
        .map(|(k, block)| FrfDatum {
            variance: around(k),
            ..*block
        })
        .collect()
}

/// The samples of a signal from `start` on, as far as there are.
fn part(signals: &Signals, start: usize, length: usize) -> Signals {
    let of = |samples: &[f64]| samples.iter().skip(start).take(length).copied().collect();
    Signals {
        rate_hz: signals.rate_hz,
        input_a: of(&signals.input_a),
        output_m: of(&signals.output_m),
    }
}

/// Each sine by its frf_data; the frequencies rise, whichever way the sines went.
fn stepped(
    signals: &Signals,
    windows: &[Window],
    (low_hz, high_hz): (f64, f64),
) -> Result<Segments, IdentifyError> {
    let (mut frf, mut frf_data) = (Frf::default(), Vec::new());
    let hz = |window: &Window| window.turns as f64 * signals.rate_hz / window.period as f64;
    // A run that was stopped has those that it came to.
    let whole = |window: &&Window| window.start + window.period * window.periods <= signals.len();
    let mut rising: Vec<&Window> = windows.iter().filter(whole).collect();
    rising.sort_by(|a, b| hz(a).total_cmp(&hz(b)));
    // Frequencies that fit whole ticks may fall together.
    rising.dedup_by(|a, b| hz(a) <= hz(b));
    for window in rising {
        match sine(signals, window, hz(window)) {
            Ok(Periods {
                frf: one,
                frf_data: of_one,
                ..
            }) => {
                append(&mut frf, one);
                frf_data.extend(of_one);
            }
            // A sine that did not come through is no reason to lose the others.
            Err(IdentifyError::NotExcited { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    if frf_data.is_empty() {
        return Err(IdentifyError::NotExcited { low_hz, high_hz });
    }
    Ok(Segments::Lines(
        frf,
        with_noise_of_neighbours(&frf_data),
        None,
    ))
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

fn append(frf: &mut Frf, other: Frf) {
    frf.frequency_hz.extend(other.frequency_hz);
    frf.response.extend(other.response);
    frf.coherence.extend(other.coherence);
    frf.magnitude_sigma.extend(other.magnitude_sigma);
    frf.phase_sigma_rad.extend(other.phase_sigma_rad);
    frf.resolution_hz.extend(other.resolution_hz);
}
