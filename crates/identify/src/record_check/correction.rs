//! Spikes and steps of the output that are corrected, so that modes are fitted to the rest.
//!
//! The samples of a spike get the values with which the errors of a prediction by the samples around them and by the input are smallest
//! (interpolation by an autoregressive model); the height of a step is determined in the same way and subtracted from all samples after
//! it. Corrected samples deviate by about the noise of one sample. An outlier that neither describes, as the response to a force that is
//! not in the input, is not corrected.
//!
//! Source: Janssen, Veldhuis and Vries, "Adaptive interpolation of discrete-time signals that can be modeled as autoregressive
//! processes", IEEE Transactions on Acoustics, Speech, and Signal Processing 34 (1986), 317-330; here with the input.

use std::fmt;

use serde::Serialize;

use super::defect::HeldFor;
use super::outlier::{MAX_SPIKE, Outlier, Place, Shape};
use super::prediction::{Prediction, REACH};
use super::resolution;
use crate::Signals;

/// A record with more spikes and steps is not corrected: its probe or its cable has to be repaired.
const MAX_PLACES: usize = 20;
/// As many of them are told one by one.
const MAX_LISTED: usize = 3;
/// The prediction and all heights are determined again at most so often: as long as spikes and steps are found, and twice without them.
const MAX_PASSES: usize = 10;
const CLEAN_PASSES: usize = 2;
/// Outliers below this ratio of the largest one wait for the next pass: the largest one spoils the prediction, and its errors look like
/// outliers.
const MIN_RATIO_TO_LARGEST: f64 = 0.1;

/// A spike or a step of the output that was corrected, or samples that were left out because they are no readings. Times are in seconds
/// from the first sample, heights and values in units of the output.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Correction {
    /// A few samples were replaced.
    Spike {
        /// Time of the first one.
        time_s: f64,
        /// By how much the one that is farthest off was too large.
        height: f64,
        /// Number of samples.
        samples: usize,
    },
    /// A height was subtracted from all samples from here on.
    Step {
        /// Time of the first one.
        time_s: f64,
        /// The height.
        height: f64,
    },
    /// Samples of the same value, because the probe was stuck or lost its target, were left out.
    Repeated {
        /// Time of the first one.
        time_s: f64,
        /// Their number.
        samples: usize,
        /// In as many places.
        places: usize,
    },
    /// Of samples at a limit only this was used, that the output is there or beyond.
    Clipped {
        /// Time of the first one.
        time_s: f64,
        /// The limit.
        value: f64,
        /// Their number.
        samples: usize,
    },
    /// Only every n-th sample was used, because the probe is slower than the log.
    Held {
        /// n.
        samples: usize,
    },
}

impl fmt::Display for Correction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Correction::Spike {
                time_s,
                height,
                samples,
            } => {
                let replaced = match samples {
                    1 => "this sample was".to_owned(),
                    _ => format!("these {samples} samples were"),
                };
                write!(
                    f,
                    "the output has a spike of {height:.3e} at {time_s:.4} s; {replaced} replaced by interpolation"
                )
            }
            Correction::Step { time_s, height } => write!(
                f,
                "the output jumps by {height:.3e} at {time_s:.4} s; this was subtracted from the samples after it"
            ),
            Correction::Repeated {
                time_s,
                samples,
                places,
            } => {
                let more = match places {
                    1 => String::new(),
                    _ => format!(" in {places} places"),
                };
                write!(
                    f,
                    "{samples} samples of the output{more}, the first one at {time_s:.4} s, have the same value as those around them and were left out; check the probe and its connection"
                )
            }
            Correction::Clipped {
                time_s,
                value,
                samples,
            } => write!(
                f,
                "{samples} samples of the output are clipped at {value:.6e}, the first one at {time_s:.4} s; of these only the limit was used"
            ),
            Correction::Held { samples } => write!(
                f,
                "{}; only these samples were used",
                HeldFor(*samples as f64)
            ),
        }
    }
}

impl Correction {
    /// What was corrected, for a reader; `None` if nothing was.
    pub fn description(corrections: &[Correction]) -> Option<String> {
        let (listed, others) = corrections.split_at(corrections.len().min(MAX_LISTED));
        let mut texts: Vec<String> = listed.iter().map(ToString::to_string).collect();
        if !others.is_empty() {
            texts.push(format!("{} more are corrected", others.len()));
        }
        (!texts.is_empty()).then(|| texts.join("; "))
    }
}

/// A record with its corrections, in the order of time.
#[derive(Clone, Debug)]
pub struct Corrected {
    /// The record without its spikes and steps.
    pub signals: Signals,
    /// What was corrected.
    pub corrections: Vec<Correction>,
}

impl Corrected {
    /// A record of which spikes and steps are the only defects, without them; `None` if it has none, or if not all can be corrected.
    pub fn of(recorded: &Signals) -> Option<Corrected> {
        let step = resolution::step(&recorded.output).unwrap_or(0.0);
        let mut signals = recorded.clone();
        let mut places = Vec::new();
        let mut clean_passes = 0;
        for _ in 0..MAX_PASSES {
            let prediction = Prediction::new(&signals, step)?;
            let outliers = prediction.outliers();
            for outlier in large(&outliers) {
                let is_known = extends(&mut places, outlier.place);
                if !is_known && !outlier.is_explained {
                    return None;
                }
                if !is_known {
                    places.push(outlier.place);
                }
            }
            if places.is_empty() || places.len() > MAX_PLACES {
                return None;
            }
            if outliers.is_empty() {
                clean_passes += 1;
            }
            if clean_passes == CLEAN_PASSES {
                return Some(Corrected::new(recorded, signals, places));
            }
            let heights: Option<Vec<Vec<f64>>> = places
                .iter()
                .map(|place| prediction.heights(*place))
                .collect();
            for (place, heights) in places.iter().zip(heights?) {
                subtract(&mut signals.output, *place, &heights);
            }
        }
        None
    }

    fn new(recorded: &Signals, signals: Signals, mut places: Vec<Place>) -> Corrected {
        places.sort_by_key(|place| place.at);
        let of_place = |place: &Place| correction(*place, recorded, &signals);
        Corrected {
            corrections: places.iter().map(of_place).collect(),
            signals,
        }
    }
}

/// The outliers that are not far smaller than the largest one.
fn large(outliers: &[Outlier]) -> impl Iterator<Item = &Outlier> {
    let heights = outliers.iter().map(|outlier| outlier.height.abs());
    let limit = MIN_RATIO_TO_LARGEST * heights.fold(0.0, f64::max);
    outliers
        .iter()
        .filter(move |outlier| outlier.height.abs() >= limit)
}

/// Whether an outlier lies at one of the known places, of which a part is left until the prediction is good. A spike is extended by
/// another one beside it.
fn extends(places: &mut [Place], new: Place) -> bool {
    let is_near = |place: &&mut Place| place.at.abs_diff(new.at) < REACH;
    let Some(place) = places.iter_mut().find(is_near) else {
        return false;
    };
    if let (Shape::Spike { samples }, Shape::Spike { samples: further }) = (place.shape, new.shape)
    {
        let begin = place.at.min(new.at);
        let samples = (place.at + samples).max(new.at + further) - begin;
        if samples <= MAX_SPIKE {
            place.at = begin;
            place.shape = Shape::Spike { samples };
        }
    }
    true
}

fn subtract(output: &mut [f64], place: Place, heights: &[f64]) {
    let from = &mut output[place.at..];
    match (place.shape, heights) {
        (Shape::Step, [height]) => from.iter_mut().for_each(|y| *y -= height),
        _ => from
            .iter_mut()
            .zip(heights)
            .for_each(|(y, height)| *y -= height),
    }
}

fn correction(place: Place, recorded: &Signals, corrected: &Signals) -> Correction {
    let time_s = place.at as f64 / recorded.rate_hz;
    // Without the steps before the place; no other spike is near.
    let removed_at = |k: usize| recorded.output[k] - corrected.output[k];
    let before = place.at.checked_sub(1).map_or(0.0, removed_at);
    let removed = |k: usize| removed_at(k) - before;
    match place.shape {
        Shape::Spike { samples } => {
            let heights = (place.at..place.at + samples).map(removed);
            let height = heights.max_by(|a, b| a.abs().total_cmp(&b.abs()));
            Correction::Spike {
                time_s,
                height: height.unwrap_or_default(),
                samples,
            }
        }
        Shape::Step => Correction::Step {
            time_s,
            height: removed(place.at),
        },
    }
}
