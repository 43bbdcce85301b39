//! Whether a model describes rounded readings: their scores must be those of independent noise of one standard deviation.
//!
//! Unequal steps, another motion of the plant, or a disturbance make the noise seem larger where there are more of them, and scores alike
//! from one reading to the next.

use super::refine::{FINE, Likeliest, MAX_SIGMA_STEPS, RoundedRecord};

/// Number of parts of the record with equal information, each of which has its own noise.
const PARTS: usize = 6;
/// Largest decrease of -2 ln P by their own noise: chi-square with one degree of freedom less than parts exceeds it with 0.1 %.
const MAX_DECREASE: f64 = 20.5;
/// Largest sum of the products of neighbouring scores, over its standard deviation; noise exceeds it with 0.1 %.
const MAX_CORRELATION: f64 = 3.3;
impl RoundedRecord<'_> {
    /// Whether a model is near enough to the readings that their steps matter.
    pub(super) fn may_describe(&self, found: &Likeliest) -> bool {
        found.sigma < MAX_SIGMA_STEPS * self.step
    }

    /// Whether a model describes the readings.
    pub(super) fn is_described_by(&self, found: &Likeliest) -> bool {
        self.may_describe(found)
            && correlation(&found.scores).abs() < MAX_CORRELATION
            && self.decrease_by_parts(found) < MAX_DECREASE
    }

    /// The decrease of -2 ln P if each part of the record has its own noise.
    fn decrease_by_parts(&self, found: &Likeliest) -> f64 {
        let common = self.likeliest_sigma(&found.output, found.sigma, FINE);
        let mut gain = 0.0;
        let mut begin = 0;
        for end in ends_of_parts(&found.information) {
            let part = RoundedRecord {
                readings: &self.readings[begin..end],
                ..*self
            };
            let output = &found.output[begin..end];
            let own = part.likeliest_sigma(output, found.sigma, FINE);
            gain += part.log_probability(output, own) - part.log_probability(output, common);
            begin = end;
        }
        2.0 * gain
    }
}

/// Where the parts of equal information end.
fn ends_of_parts(information: &[f64]) -> Vec<usize> {
    let all: f64 = information.iter().sum();
    let mut ends = Vec::new();
    let mut sum = 0.0;
    for (k, of_reading) in information.iter().enumerate() {
        sum += of_reading;
        if sum >= all * (ends.len() + 1) as f64 / PARTS as f64 && ends.len() + 1 < PARTS {
            ends.push(k + 1);
        }
    }
    ends.push(information.len());
    ends
}

/// Sum of the products of neighbouring scores over its standard deviation, if these are independent.
fn correlation(scores: &[f64]) -> f64 {
    let products = scores.windows(2).map(|pair| pair[0] * pair[1]);
    let squares: f64 = products.clone().map(|product| product * product).sum();
    if squares > 0.0 {
        products.sum::<f64>() / squares.sqrt()
    } else {
        0.0
    }
}
