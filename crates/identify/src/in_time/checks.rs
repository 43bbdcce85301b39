//! Whether a model describes readings: their scores must be those of independent noise of one standard deviation.
//!
//! Unequal steps, another motion of the plant, or a disturbance make the noise seem larger where there are more of them, and scores alike
//! from one reading to the next.

use super::refine::{FINE, Likeliest, TimeRecord};
use crate::record_check::Reading;

/// Number of parts of the record with equal information, each of which has its own noise.
const PARTS: usize = 6;
/// Largest decrease of -2 ln P by their own noise: chi-square with one degree of freedom less than parts exceeds it with 0.1 %.
const MAX_DECREASE: f64 = 20.5;
/// Scores of readings up to as many places apart are compared.
const LAGS: usize = 4;
/// Largest sum of the squares of the correlations at these lags: chi-square with as many degrees of freedom exceeds it with 0.1 %.
const MAX_CORRELATION: f64 = 18.5;

impl TimeRecord<'_> {
    /// Whether a model describes the readings.
    pub(super) fn is_described_by(&self, found: &Likeliest) -> bool {
        self.is_near(found.sigma)
            && self.correlation(&found.scores) < MAX_CORRELATION
            && self.decrease_by_parts(found) < MAX_DECREASE
    }

    /// The sum of the squares of the correlations of the scores at the first lags, each over its standard deviation.
    fn correlation(&self, scores: &[f64]) -> f64 {
        let pairs = scores.iter().zip(self.readings);
        let of_readings = pairs.filter(|(_, reading)| **reading != Reading::Lost);
        let scores: Vec<f64> = of_readings.map(|(score, _)| *score).collect();
        let lags = (1..=LAGS).map(|lag| correlation(&scores, lag).powi(2));
        lags.sum()
    }

    /// The decrease of -2 ln P if each part of the record has its own noise.
    fn decrease_by_parts(&self, found: &Likeliest) -> f64 {
        let common = self.likeliest_sigma(&found.output, found.sigma, FINE);
        let mut gain = 0.0;
        let mut begin = 0;
        for end in ends_of_parts(&found.information) {
            let part = TimeRecord {
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

/// Sum of the products of scores `lag` places apart over its standard deviation, if these are independent.
fn correlation(scores: &[f64], lag: usize) -> f64 {
    let products = scores.windows(lag + 1).map(|part| part[0] * part[lag]);
    let squares: f64 = products.clone().map(|product| product * product).sum();
    if squares > 0.0 {
        products.sum::<f64>() / squares.sqrt()
    } else {
        0.0
    }
}
