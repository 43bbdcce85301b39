//! Samples that do not change: repeated readings, and an output at its limit.
//!
//! A run of L equal samples in a record of n is a defect if n p^L is below 1e-6, with p the ratio of equal neighbours, and the input
//! changes meanwhile. An output with a step is equal to itself wherever it moves by less: there the output must also move by several
//! steps right before and right after the run.

use std::cmp::Reverse;
use std::ops::Range;

use super::defect::Defect;
use crate::Signals;

/// A repeated sample occurs at least this many times in succession ...
const MIN_REPEATED: usize = 5;
/// ... of a quantised output at least this many times, so that it can be compared with the motion around ...
const MIN_QUANTISED: usize = 8;
/// ... and by chance with less than this probability.
const CHANCE: f64 = 1e-6;
/// Before and after repeated samples of a quantised output, it moves by at least this number of steps.
const MOVED_STEPS: f64 = 6.0;
/// Fast motion exceeds these steps in this number of samples.
const FAST_SAMPLES: usize = 16;
/// Upper limit of the probability that neighbouring samples of an output that moves by 24 steps or more within a run are equal.
const MOVING_EQUAL: f64 = 0.03;
/// Meanwhile the input moves by at least this ratio of its range.
const ACTIVE_SPAN: f64 = 0.05;
/// A clipped output stays at its limit for at least this many samples, at least this many times.
const CLIPPED: Plateaus = Plateaus {
    samples: 3,
    places: 4,
};
/// The same with few samples in each oscillation. (The values of a steady oscillation may repeat, but all of them do.)
const CLIPPED_FAST: Plateaus = Plateaus {
    samples: 2,
    places: 8,
};
/// A limit occurs at least this many times as often as the value next to it.
const MIN_PILE_RATIO: usize = 5;
/// An input with fewer values between its limits is one of steps.
const MIN_VALUES: usize = 100;

/// How often, and for how many samples, a signal has a value in succession.
#[derive(Clone, Copy, Debug)]
struct Plateaus {
    samples: usize,
    places: usize,
}

/// The resolution of an output, and its noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quantisation {
    /// The step of its values.
    pub(super) step: f64,
    /// Standard deviation of its noise.
    pub(super) noise: f64,
}

impl Quantisation {
    /// The probability that two neighbouring samples are equal. With noise above a step it is that of rest, where their difference of
    /// standard deviation sqrt(2) sigma is 0: q/(2 sqrt(pi) sigma). With less, [`Run::hides_motion`] excludes rest.
    fn chance_of_equal(&self) -> f64 {
        if self.noise < self.step {
            return MOVING_EQUAL;
        }
        self.step / (2.0 * std::f64::consts::PI.sqrt() * self.noise)
    }
}

/// Samples of the same value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    pub(super) start: usize,
    samples: usize,
}

/// The runs of equal samples that are no chance, and before and after which the output moves by several of its steps; the longest first.
pub(super) fn repeated(signals: &Signals, quantisation: Option<Quantisation>) -> Vec<Run> {
    let output = &signals.output;
    let runs = output.chunk_by(|a, b| a == b).scan(0, |end, run| {
        *end += run.len();
        let start = *end - run.len();
        Some(Run {
            start,
            samples: run.len(),
        })
    });
    let mut runs: Vec<Run> = runs
        .filter(|run| match quantisation {
            Some(q) => run.samples >= MIN_QUANTISED && run.hides_motion(signals, q.step),
            None => run.samples >= MIN_REPEATED && run.input_changes(&signals.input),
        })
        .collect();
    runs.sort_by_key(|run| Reverse(run.samples));
    let mut others = output.windows(2).filter(|pair| pair[0] == pair[1]).count();
    let is_no_chance = |run: &Run| {
        others = others.saturating_sub(run.samples);
        run.chance(output.len(), others, quantisation) < CHANCE
    };
    runs.into_iter().take_while(is_no_chance).collect()
}

impl Run {
    pub(super) fn range(&self) -> Range<usize> {
        self.start..self.start + self.samples
    }

    /// The run as a defect. A quantised output that came from fast motion is no command at rest.
    pub(super) fn defect(&self, signals: &Signals, is_quantised: bool) -> Defect {
        let (time_s, samples) = (self.start as f64 / signals.rate_hz, self.samples);
        let reaches_an_end = self.start == 0 || self.start + samples == signals.len();
        if reaches_an_end && !is_quantised {
            Defect::Constant { time_s, samples }
        } else {
            Defect::Repeated { time_s, samples }
        }
    }

    fn input_changes(&self, input: &[f64]) -> bool {
        let pairs = input[self.start..self.start + self.samples].windows(2);
        2 * pairs.filter(|pair| pair[0] != pair[1]).count() >= self.samples
    }

    /// The probability of such a run in a record of `count` samples, of which `others` outside of longer runs are equal to the one before.
    fn chance(&self, count: usize, others: usize, quantisation: Option<Quantisation>) -> f64 {
        let count = count as f64;
        // Of a quantised output, the ratio of the whole record is that of the parts in which it moves by less than one step.
        let ratio = quantisation.map_or(others as f64 / count, |q| q.chance_of_equal());
        count * ratio.max(CHANCE).powf(self.samples as f64)
    }

    /// Whether the output moves by [`MOVED_STEPS`] right before and right after, each in a quarter of the time of the run, and the
    /// input is active meanwhile. To a run until the end of the record the output must come from fast motion.
    ///
    /// Where a smooth output stays within one step from -T to T, it is at least as flat as c t^2 at a peak, and hardly flatter than
    /// c t^4 with several frequencies: from T to 1.5 T it changes by 1.5^4 - 1 = 4 steps at most, and rounding adds one.
    fn hides_motion(&self, signals: &Signals, step: f64) -> bool {
        let (output, input) = (&signals.output, &signals.input);
        let end = self.start + self.samples;
        let is_last = end == output.len();
        let around = self.samples.div_ceil(4);
        let before = if is_last {
            around.min(FAST_SAMPLES)
        } else {
            around
        };
        if self.start < before || (!is_last && end + around > output.len()) {
            return false;
        }
        let moved = |samples: &[f64]| span(samples) >= MOVED_STEPS * step;
        moved(&output[self.start - before..self.start])
            && (is_last || moved(&output[end..end + around]))
            && span(&input[self.start..end]) > ACTIVE_SPAN * span(input)
    }
}

/// The difference between the largest and the smallest sample.
fn span(samples: &[f64]) -> f64 {
    let low = samples.iter().copied().fold(f64::INFINITY, f64::min);
    let high = samples.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    high - low
}

/// The largest or smallest value of an output that stays there in several places.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limit {
    pub(super) value: f64,
    pub(super) is_upper: bool,
    /// The first sample of the first plateau.
    pub(super) first: usize,
}

impl Limit {
    pub(super) fn defect(&self, rate_hz: f64) -> Defect {
        Defect::Clipped {
            time_s: self.first as f64 / rate_hz,
            value: self.value,
        }
    }
}

/// The limits at which an output is clipped.
pub(super) fn limits(output: &[f64]) -> Vec<Limit> {
    let start = output.first().copied().unwrap_or(0.0);
    let largest = output.iter().copied().fold(start, f64::max);
    let smallest = output.iter().copied().fold(start, f64::min);
    [(largest, true), (smallest, false)]
        .into_iter()
        .filter_map(|(value, is_upper)| {
            let slow = first_plateau(output, value, CLIPPED);
            let first = slow.or_else(|| first_plateau(output, value, CLIPPED_FAST))?;
            piles_up(output, value).then_some(Limit {
                value,
                is_upper,
                first,
            })
        })
        .collect()
}

/// The limit at which an input that varies between its limits stays, as one that is clipped. (A binary sequence, or steps of a few
/// heights, stay at their values as well.)
pub(crate) fn limit_of_input(input: &[f64]) -> Option<f64> {
    let mut limits = limits(input);
    // That of an input to one side is its rest.
    limits.retain(|limit| Some(&limit.value) != input.first());
    let limit = limits.first()?.value;
    let is_limit = |u: &&f64| limits.iter().any(|limit| limit.value == **u);
    let mut between: Vec<f64> = input.iter().filter(|u| !is_limit(u)).copied().collect();
    between.sort_by(f64::total_cmp);
    between.dedup();
    (between.len() >= MIN_VALUES).then_some(limit)
}

/// Whether the extreme value of a signal occurs far more often than the value next to it. The flat peaks of a coarsely quantised
/// signal do not: a sine has its largest value 2.4 times as often as the next one (arcsine distribution, 1/(sqrt(2) - 1)).
fn piles_up(samples: &[f64], extreme: f64) -> bool {
    let others = samples.iter().copied().filter(|y| *y != extreme);
    let nearest = others.min_by(|a, b| (a - extreme).abs().total_cmp(&(b - extreme).abs()));
    let count = |value: f64| samples.iter().filter(|y| **y == value).count();
    nearest.is_some_and(|next| count(extreme) > MIN_PILE_RATIO * count(next))
}

/// Where a signal first has a value so many times in succession, if it has at least as many plateaus.
fn first_plateau(samples: &[f64], value: f64, least: Plateaus) -> Option<usize> {
    let (mut places, mut length) = (Vec::new(), 0);
    for (k, sample) in samples.iter().enumerate() {
        length = if *sample == value { length + 1 } else { 0 };
        if length == least.samples {
            places.push(k + 1 - length);
        }
    }
    let is_enough = places.len() >= least.places;
    places.first().copied().filter(|_| is_enough)
}
