//! A grid as it is typed: FROM:TO:COUNT.

use std::str::FromStr;

use crate::util::quantity::{OfRatio, si};

/// Largest number of values of a grid.
const MOST: usize = 10_000;

/// At least two values at equal distances, with both ends.
#[derive(Clone, Debug)]
pub(super) struct ValueRange(pub Vec<f64>);

impl ValueRange {
    pub fn ends(&self) -> [f64; 2] {
        [self.0[0], self.0[self.0.len() - 1]]
    }
}

impl FromStr for ValueRange {
    type Err = String;

    fn from_str(text: &str) -> Result<ValueRange, String> {
        let [from, to, count] = text.split(':').collect::<Vec<_>>()[..] else {
            return Err("write FROM:TO:COUNT, as in 0%:15%:31".into());
        };
        let (from, to, count) = (ratio(from)?, ratio(to)?, count_of(count)?);
        if from == to {
            return Err(format!(
                "an empty sweep: FROM and TO are both {from}; give two values"
            ));
        }
        let last = (count - 1) as f64;
        let inner = (0..count - 1).map(|k| from + (to - from) * k as f64 / last);
        Ok(ValueRange(inner.chain([to]).collect()))
    }
}

fn ratio(text: &str) -> Result<f64, String> {
    si::<OfRatio>(text).map_err(|e| e.to_string())
}

fn count_of(text: &str) -> Result<usize, String> {
    let count = text.trim().parse().ok();
    let count = count.filter(|count| (2..=MOST).contains(count));
    count.ok_or_else(|| format!("COUNT is a whole number from 2 to {MOST}"))
}
