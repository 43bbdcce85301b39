//! Samples that do not change: repeated readings, and an output at its limit.
//!
//! A run of L equal samples in a record of n is a defect if n p^L is below 1e-6, with p the ratio of equal neighbours, and the input
//! changes meanwhile.

use super::defect::Defect;
use crate::Signals;

/// A repeated sample occurs at least this many times in succession ...
const MIN_REPEATED: usize = 5;
/// ... and by chance with less than this probability.
const CHANCE: f64 = 1e-6;
/// A clipped output stays at its limit for at least this many samples ...
const MIN_CLIPPED: usize = 3;
/// ... at least this many times.
const MIN_CLIPPED_PEAKS: usize = 4;
/// A limit occurs at least this many times as often as the value next to it.
const MIN_PILE_RATIO: usize = 5;

/// The longest run of equal samples, if it is no chance.
pub(super) fn repeated(signals: &Signals) -> Option<Defect> {
    let output = &signals.output;
    let runs = output.chunk_by(|a, b| a == b);
    let starts = runs.scan(0, |end, run| {
        *end += run.len();
        Some((*end - run.len(), run.len()))
    });
    let moving = starts.filter(|(start, samples)| {
        let input = &signals.input[*start..start + samples];
        let changes = input.windows(2).filter(|pair| pair[0] != pair[1]);
        2 * changes.count() >= *samples
    });
    let (start, samples) = moving.max_by_key(|(_, samples)| *samples)?;
    let equal = output.windows(2).filter(|pair| pair[0] == pair[1]).count();
    let others = equal.saturating_sub(samples) as f64;
    let ratio = (others / output.len() as f64).max(CHANCE);
    let chance = output.len() as f64 * ratio.powf(samples as f64);
    (samples >= MIN_REPEATED && chance < CHANCE).then(|| Defect::Repeated {
        time_s: start as f64 / signals.rate_hz,
        samples,
    })
}

/// The output at its largest or smallest value, if it stays there in several places.
pub(super) fn clipped(signals: &Signals) -> Option<Defect> {
    let output = &signals.output;
    let limits = [f64::max, f64::min].map(|extreme| {
        let first = output.first().copied().unwrap_or(0.0);
        output.iter().copied().fold(first, extreme)
    });
    limits.into_iter().find_map(|value| {
        let places = plateaus(output, value);
        let is_clipped = places.len() >= MIN_CLIPPED_PEAKS && piles_up(output, value);
        is_clipped.then(|| Defect::Clipped {
            time_s: places[0] as f64 / signals.rate_hz,
            value,
        })
    })
}

/// Whether the extreme value of a signal occurs far more often than the value next to it. The flat peaks of a coarsely quantised
/// signal do not: a sine has its largest value 2.4 times as often as the next one (arcsine distribution, 1/(sqrt(2) - 1)).
fn piles_up(samples: &[f64], extreme: f64) -> bool {
    let others = samples.iter().copied().filter(|y| *y != extreme);
    let nearest = others.min_by(|a, b| (a - extreme).abs().total_cmp(&(b - extreme).abs()));
    let count = |value: f64| samples.iter().filter(|y| **y == value).count();
    nearest.is_some_and(|next| count(extreme) > MIN_PILE_RATIO * count(next))
}

/// Where a signal has a value at least [`MIN_CLIPPED`] times in succession: the first index of each place.
fn plateaus(samples: &[f64], value: f64) -> Vec<usize> {
    let (mut places, mut length) = (Vec::new(), 0);
    for (k, sample) in samples.iter().enumerate() {
        length = if *sample == value { length + 1 } else { 0 };
        if length == MIN_CLIPPED {
            places.push(k + 1 - MIN_CLIPPED);
        }
    }
    places
}
