//! The lines that a periodic input excites, and those of its distortion.
//!
//! A measured input has distortion at lines that its source does not contain. Sorted by amplitude, the excited lines precede the
//! others by a wide gap, and have a pattern that most of the others do not have: either a distance of several lines, or a band of all
//! lines, beside which the amplitudes are irregular.

use super::lines::{Line, mean, variance_of_mean};

/// A line below this ratio of the largest amplitude in the band is not excited.
const EXCITED_RATIO: f64 = 0.01;
/// The amplitude of an excited line exceeds this multiple of its standard deviation.
const EXCITED_SIGMAS: f64 = 5.0;
/// Ratio of amplitudes of the weakest excited line and of the strongest distortion: 10 dB.
const DISTORTION_GAP: f64 = 3.0;
/// A pattern has at least this many lines.
const MIN_PATTERN: usize = 8;
/// Median of |ln| of the ratio of neighbouring amplitudes above which lines are irregular. Independent lines with random phases of many
/// products have Rayleigh-distributed amplitudes, and 0.55: tanh(0.55) = 1/2.
const IRREGULAR: f64 = 0.25;

/// The lines whose input exceeds its own noise, [`EXCITED_RATIO`] of the largest, and the distortion.
pub(super) fn excited(lines: &[Line]) -> impl Iterator<Item = &Line> {
    let largest = lines.iter().map(amplitude).fold(0.0, f64::max);
    let significant: Vec<&Line> = lines
        .iter()
        .filter(|line| {
            let sigma = variance_of_mean(&line.input).sqrt();
            let amplitude = amplitude(line);
            amplitude > 0.0
                && amplitude >= EXCITED_RATIO * largest
                && amplitude > EXCITED_SIGMAS * sigma
        })
        .collect();
    let limit = distortion_limit(&significant);
    significant
        .into_iter()
        .filter(move |line| amplitude(line) > limit)
}

/// Amplitude of the mean input.
fn amplitude(line: &Line) -> f64 {
    mean(&line.input).norm()
}

/// The largest amplitude that is distortion of a measured input; 0 without any.
fn distortion_limit(lines: &[&Line]) -> f64 {
    let mut sorted: Vec<(f64, usize)> = lines
        .iter()
        .map(|line| (amplitude(line), line.number))
        .collect();
    sorted.sort_by(|a, b| b.0.total_cmp(&a.0));
    let gap = |k: &usize| sorted[k - 1].0 / sorted[*k].0;
    let widest = (MIN_PATTERN..sorted.len()).max_by(|a, b| gap(a).total_cmp(&gap(b)));
    let Some(first) = widest.filter(|k| gap(k) >= DISTORTION_GAP) else {
        return 0.0;
    };
    let (excited, others) = sorted.split_at(first);
    let pattern = Pattern::of(excited.iter().map(|line| line.1));
    let is_distortion = match pattern.step {
        1 => pattern.is_filled_by(excited.len()) && are_irregular(others),
        _ => true,
    };
    let outside = others.iter().filter(|line| !pattern.contains(line.1));
    if is_distortion && 4 * outside.count() >= others.len() {
        others[0].0
    } else {
        0.0
    }
}

/// Whether neighbouring lines differ as those of distortion do, and not as levels of an excitation that change rarely.
fn are_irregular(lines: &[(f64, usize)]) -> bool {
    let mut rising: Vec<(usize, f64)> = lines.iter().map(|line| (line.1, line.0)).collect();
    rising.sort_by_key(|line| line.0);
    let pairs = rising.windows(2).filter(|pair| pair[1].0 == pair[0].0 + 1);
    let mut changes: Vec<f64> = pairs.map(|p| libm::log(p[1].1 / p[0].1).abs()).collect();
    changes.sort_by(f64::total_cmp);
    changes
        .get(changes.len() / 2)
        .is_some_and(|median| *median > IRREGULAR)
}

/// Lines of equal distance.
struct Pattern {
    first: usize,
    last: usize,
    step: usize,
}

impl Pattern {
    /// The widest distance that contains all numbers, of which there is at least one.
    fn of(numbers: impl Iterator<Item = usize> + Clone) -> Pattern {
        let first = numbers.clone().min().unwrap_or(0);
        let last = numbers.clone().max().unwrap_or(0);
        let distances = numbers.map(|number| number - first);
        Pattern {
            first,
            last,
            step: distances.fold(0, greatest_common_divisor).max(1),
        }
    }

    /// Whether a line has the distance of the pattern; all lines have a distance of 1, so that it must then lie between them.
    fn contains(&self, number: usize) -> bool {
        match self.step {
            1 => (self.first..=self.last).contains(&number),
            step => number.abs_diff(self.first).is_multiple_of(step),
        }
    }

    /// Whether so many lines are at least half of the pattern. Any lines are in a pattern of step 1, though they fill it rarely.
    fn is_filled_by(&self, lines: usize) -> bool {
        2 * lines > (self.last - self.first) / self.step
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}
