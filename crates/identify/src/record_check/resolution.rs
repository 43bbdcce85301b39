//! The resolution of a channel: the step of the grid on which its values lie, as those of a converter, an encoder, or of text with few
//! digits.
//!
//! ```text
//! v_1 < v_2 < ...     distinct values        d_i = v_(i+1) - v_i = k_i q + rounding        k_i = 1, 2, ...
//! ```
//!
//! q begins with the smallest difference and becomes more exact with each larger one, so that an offset and a step that the digits of
//! the text round do no harm. Differences of a continuous signal are no multiples: 60 % of them deviate by more than 0.2 q.

use crate::Signals;

use super::prediction::Prediction;

/// Values nearer to each other than this ratio of the range are the same.
const SAME_RATIO: f64 = 1e-12;
/// Largest deviation of a difference from a multiple of the step, as a ratio of the step.
const OFF_GRID: f64 = 0.2;
/// At most this ratio of the differences, for example of interpolated samples, are no multiples.
const MAX_OFF_GRID_RATIO: f64 = 0.02;
/// Fewer values may lie on a grid by chance: for 16 differences with probability 0.4^16 = 4e-7.
const MIN_DIFFERENCES: usize = 16;
/// Quantiles of the differences with which the step may begin: a few smaller ones may come from interpolated samples.
const STARTS: [f64; 3] = [0.02, 0.01, 0.0];
/// The resolution of an input matters if its step exceeds this ratio of the range: its error, q/sqrt(12), is then 0.03 % of it.
const COARSE_RANGE_RATIO: f64 = 1e-3;

/// Noise and rounding errors above this ratio of the step, with step^2/12 of rounding: the noise alone is then above 0.53 steps, and the
/// mean of readings follows the true value to exp(-2 pi^2 0.53^2)/pi = 0.1 % of a step.
const DITHER_STEPS: f64 = 0.6;

/// The steps of the channels, in their units, as far as they exceed the noise.
///
/// Rounding adds noise of variance q^2/12, which the analysis measures with all other noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Resolution {
    /// Step of the input, if it exceeds a thousandth of its range. An input of few levels, as a PRBS or a staircase, has none.
    pub input: Option<f64>,
    /// Step of the output, if it exceeds the standard deviation of its noise.
    pub output: Option<f64>,
    /// Whether the noise of the output makes its rounding errors a noise.
    pub(crate) is_dithered: bool,
}

impl Resolution {
    /// The resolution of the channels of a record.
    pub fn of(signals: &Signals) -> Resolution {
        let coarse = |step: &f64| *step > COARSE_RANGE_RATIO * range(&signals.input);
        let noise = Prediction::new(signals, 0.0).map_or(0.0, |prediction| prediction.noise());
        let output = step(&signals.output).filter(|step| *step > noise);
        Resolution {
            input: step_of_many_levels(&signals.input).filter(coarse),
            output,
            is_dithered: output.is_some_and(|step| noise > DITHER_STEPS * step),
        }
    }

    /// What the steps are, for a reader; `None` if none matters.
    pub fn description(&self) -> Option<String> {
        let of = |channel: &str, step: Option<f64>| {
            step.map(|step| format!("steps of {step:.4e} in the {channel}"))
        };
        let output = of("output", self.output).map(|text| format!("{text}, more than its noise"));
        let parts: Vec<String> = output.into_iter().chain(of("input", self.input)).collect();
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

/// The step of the grid on which the values lie, if they do.
pub(super) fn step(samples: &[f64]) -> Option<f64> {
    let differences = differences(samples);
    if differences.len() < MIN_DIFFERENCES {
        few_levels(&differences)
    } else {
        many_levels(&differences)
    }
}

/// The step of a grid of which the values use many levels.
fn step_of_many_levels(samples: &[f64]) -> Option<f64> {
    let differences = differences(samples);
    let are_many = differences.len() >= MIN_DIFFERENCES;
    are_many.then(|| many_levels(&differences)).flatten()
}

/// The differences of neighbouring levels, rising.
fn differences(samples: &[f64]) -> Vec<f64> {
    let mut levels = samples.to_vec();
    levels.sort_by(f64::total_cmp);
    let same = SAME_RATIO * range(samples);
    let differences = levels.windows(2).map(|pair| pair[1] - pair[0]);
    let mut differences: Vec<f64> = differences.filter(|d| *d > same).collect();
    differences.sort_by(f64::total_cmp);
    differences
}

fn many_levels(differences: &[f64]) -> Option<f64> {
    let first = |quantile: f64| (quantile * differences.len() as f64) as usize;
    let starts = STARTS.into_iter().map(first);
    starts.into_iter().find_map(|k| grid(differences, k))
}

/// The step of a record with few levels, all of which must be on the grid.
fn few_levels(differences: &[f64]) -> Option<f64> {
    let all = differences.len() >= 2;
    let smallest = *differences.first()?;
    let is_multiple = |d: &f64| {
        let count = d / smallest;
        (count - count.round()).abs() < OFF_GRID / MIN_DIFFERENCES as f64
    };
    (all && differences.iter().all(is_multiple)).then_some(smallest)
}

/// The step, beginning with one of the sorted differences.
fn grid(differences: &[f64], start: usize) -> Option<f64> {
    let mut step = differences[start];
    let (mut sum, mut count) = (0.0, 0.0);
    for difference in &differences[start..] {
        if let Some(steps) = multiple(*difference, step) {
            (sum, count) = (sum + difference, count + steps);
            step = sum / count;
        }
    }
    let off = differences.iter().filter(|d| multiple(**d, step).is_none());
    (off.count() as f64 <= MAX_OFF_GRID_RATIO * differences.len() as f64).then_some(step)
}

/// The number of steps in a difference, if it is a multiple.
fn multiple(difference: f64, step: f64) -> Option<f64> {
    let steps = (difference / step).round();
    let is_multiple = steps > 0.0 && (difference - steps * step).abs() <= OFF_GRID * step;
    is_multiple.then_some(steps)
}

fn range(samples: &[f64]) -> f64 {
    let low = samples.iter().copied().fold(f64::INFINITY, f64::min);
    let high = samples.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    high - low
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sweep of amplitude 1, so that neighbouring samples differ by many values.
    fn sweep(n: usize) -> f64 {
        let t = n as f64 / 1000.0;
        (std::f64::consts::TAU * (2.0 * t + 1.5 * t * t)).sin()
    }

    #[test]
    fn finds_the_step_of_a_grid_with_an_offset_in_rounded_text() {
        for (q, decimals) in [
            (5e-3, 12),
            (1.0 / 2048.0, 6),
            (1.0 / 300.0, 5),
            (1.0 / 30_000.0, 6),
        ] {
            let values = (0..20_000).map(|n| {
                let value = q * (sweep(n) / q).round() + 0.123_456_789;
                format!("{value:.decimals$}").parse().unwrap()
            });
            let found = step(&values.collect::<Vec<f64>>()).expect("a step");
            // The mean of some 100 rounded differences and more.
            assert!((found / q - 1.0).abs() < 2e-3, "{q}: {found}");
        }
    }

    #[test]
    fn continuous_signal_has_no_step_but_that_of_its_numbers() {
        let values: Vec<f64> = (0..20_000).map(sweep).collect();
        let found = step(&values);
        assert!(found.is_none_or(|q| q < 1e-9), "{found:?}");
    }

    #[test]
    fn few_interpolated_samples_do_not_hide_the_step() {
        let q = 0.01;
        let mut values: Vec<f64> = (0..20_000).map(|n| q * (sweep(n) / q).round()).collect();
        values[7_000] += 0.1234 * q;
        values[9_000] += 0.4321 * q;
        let found = step(&values).expect("a step");
        assert!((found / q - 1.0).abs() < 1e-9, "{found}");
    }

    #[test]
    fn an_input_of_few_levels_is_exact() {
        let signals = |input: Vec<f64>| Signals {
            rate_hz: 1000.0,
            output: (0..input.len()).map(sweep).collect(),
            input,
        };
        // A PRBS of +-1 that begins at 0, and a staircase of eight steps.
        let prbs = (0..4000_usize).map(|n| match n {
            0..100 => 0.0,
            n if (n / 7) * 40_503 % 65_536 < 32_768 => 1.0,
            _ => -1.0,
        });
        assert_eq!(Resolution::of(&signals(prbs.collect())).input, None);
        let staircase = (0..4000_i32).map(|n| f64::from(n / 500));
        assert_eq!(Resolution::of(&signals(staircase.collect())).input, None);
        // A rounded sweep has many.
        let rounded = (0..4000).map(|n| (50.0 * sweep(n)).round() / 50.0);
        let step = Resolution::of(&signals(rounded.collect())).input;
        assert!((step.expect("a step") - 0.02).abs() < 1e-9);
    }
}
