//! A probe slower than the log: its value is held until the next one.
//!
//! ```text
//! k_m = n m + phase + less than 1       sample of the m-th change of the output; n samples per value, not always an integer
//! ```
//!
//! The changes lie on a line in each window. Those by which a slow signal passes the steps of its resolution do so, too, but each is one
//! step high, and a fast one repeats values at its peaks only, where the changes are small; those by noise deviate from a line by the square root of their number.

use crate::Signals;

/// Number of changes in a window.
const WINDOW: usize = 32;
/// Samples per value of a probe that is slower than the log.
const MIN_SAMPLES: f64 = 1.05;
/// Largest deviation of the changes from a line, in samples: 1 for a whole number of the sample, and some more since the line has an
/// error; with slow probes a ratio of the samples per value, for an occasional delay.
const MAX_DEVIATION: f64 = 1.3;
const MAX_DEVIATION_RATIO: f64 = 0.6;
/// Windows agree if their number of samples per value differs from the median by less than this ratio: with a deviation of 1 sample at
/// the ends it has an error of 1/32.
const SAME_RATIO: f64 = 0.05;
/// After equal samples, a change is typically at least this ratio of the others: at a peak of a coarse output it is smaller.
const MIN_LATE_RATIO: f64 = 0.5;
/// This ratio of the windows agrees, and at least this number: the phase may slip in the others.
const MIN_AGREEING_RATIO: f64 = 0.6;
const MIN_AGREEING: usize = 3;
/// The median change of a window with motion exceeds this number of steps. The quarter of them with the fastest motion counts: in slow
/// motion, neighbouring values may be equal.
const MIN_CHANGE_STEPS: f64 = 1.5;

/// This ratio of the changes comes at one phase of a slow probe. By chance 64 changes do so with probability 2^-60.
const MIN_IN_PHASE: f64 = 0.98;
const MIN_CHANGES_IN_PHASE: usize = 64;
/// Largest number of samples for each value that is looked for by the phase.
const MAX_SAMPLES_IN_PHASE: usize = 64;

/// A change of a signal.
#[derive(Clone, Copy, Debug)]
struct Change {
    sample: usize,
    height: f64,
}

/// The changes of a window with motion.
struct Window {
    /// Samples per change.
    samples: f64,
    /// Median height of a change.
    height: f64,
    /// Whether the changes lie on a line, and those after equal samples are as high as the others.
    is_regular: bool,
}

/// The samples for each value of an output that changes less often than it is logged, where its values have this step.
pub(super) fn held(signals: &Signals, step: f64) -> Option<f64> {
    let changes = changes(&signals.output);
    held_in_windows(&changes, step).or_else(|| held_in_phase(changes, step, &signals.input))
}

/// A whole number of samples for each value if nearly all changes of the output by more than a step come at one phase of it, but not those of
/// the input. A coarse output may have the same value twice wherever it turns, so that its windows are not regular.
fn held_in_phase(mut output: Vec<Change>, step: f64, input: &[f64]) -> Option<f64> {
    output.retain(|change| change.height > MIN_CHANGE_STEPS * step);
    if output.len() < MIN_CHANGES_IN_PHASE {
        return None;
    }
    let input = changes(input);
    let samples = (2..=MAX_SAMPLES_IN_PHASE)
        .rev()
        .find(|samples| are_in_phase(&output, *samples) && !are_in_phase(&input, *samples))?;
    Some(samples as f64)
}

/// Whether nearly all changes come at one phase of a number of samples.
fn are_in_phase(changes: &[Change], samples: usize) -> bool {
    let mut counts = vec![0; samples];
    for change in changes {
        counts[change.sample % samples] += 1;
    }
    let most = counts.into_iter().max().unwrap_or(0);
    most as f64 >= MIN_IN_PHASE * changes.len() as f64
}

fn held_in_windows(changes: &[Change], step: f64) -> Option<f64> {
    let windows = changes.chunks_exact(WINDOW).map(Window::of);
    let mut moving: Vec<Window> = windows
        .filter(|window| window.height > MIN_CHANGE_STEPS * step)
        .collect();
    moving.sort_by(|a, b| b.height.total_cmp(&a.height));
    moving.truncate(MIN_AGREEING.max(moving.len() / 4));
    let typical = median(moving.iter().map(|window| window.samples));
    let agrees =
        |window: &&Window| window.is_regular && (window.samples / typical - 1.0).abs() < SAME_RATIO;
    let agreeing: Vec<&Window> = moving.iter().filter(agrees).collect();
    let is_held = agreeing.len() >= MIN_AGREEING
        && agreeing.len() as f64 >= MIN_AGREEING_RATIO * moving.len() as f64
        && typical > MIN_SAMPLES;
    let sum: f64 = agreeing.iter().map(|window| window.samples).sum();
    is_held.then(|| sum / agreeing.len() as f64)
}

fn changes(samples: &[f64]) -> Vec<Change> {
    let pairs = samples.windows(2).enumerate();
    let changed = pairs.filter(|(_, pair)| pair[0] != pair[1]);
    let change = |(k, pair): (usize, &[f64])| Change {
        sample: k + 1,
        height: (pair[1] - pair[0]).abs(),
    };
    changed.map(change).collect()
}

impl Window {
    fn of(changes: &[Change]) -> Window {
        let height = median(changes.iter().map(|change| change.height));
        let pairs = changes.windows(2);
        let late = pairs.filter(|pair| pair[1].sample - pair[0].sample > 1);
        let late_height = median(late.map(|pair| pair[1].height));
        let first = changes[0].sample as f64;
        let middle = (WINDOW - 1) as f64 / 2.0;
        let sample = |m: usize| changes[m].sample as f64 - first;
        let mean = (0..WINDOW).map(sample).sum::<f64>() / WINDOW as f64;
        let product: f64 = (0..WINDOW).map(|m| (m as f64 - middle) * sample(m)).sum();
        let square: f64 = (0..WINDOW).map(|m| (m as f64 - middle).powi(2)).sum();
        let slope = product / square;
        let deviations = (0..WINDOW).map(|m| sample(m) - mean - slope * (m as f64 - middle));
        let (low, high) = deviations.fold((0.0_f64, 0.0_f64), |(low, high), d| {
            (low.min(d), high.max(d))
        });
        Window {
            samples: slope,
            height,
            is_regular: high - low < MAX_DEVIATION.max(MAX_DEVIATION_RATIO * slope)
                && late_height > MIN_LATE_RATIO * height,
        }
    }
}

/// The median; 0 without values.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
