//! FROM:TO:COUNT, as grids are typed.

use std::str::FromStr;

use crate::util::quantity::{OfRatio, si};

/// Values of a grid, at most.
const MOST: usize = 10_000;

/// Values at equal distances, both ends among them.
#[derive(Clone, Debug)]
pub(super) struct ValueRange(pub Vec<f64>);

impl FromStr for ValueRange {
    type Err = String;

    fn from_str(text: &str) -> Result<ValueRange, String> {
        let [from, to, count] = text.split(':').collect::<Vec<_>>()[..] else {
            return Err("write FROM:TO:COUNT, as in 0%:15%:31".into());
        };
        let ratio = |text: &str| si::<OfRatio>(text).map_err(|e| e.to_string());
        let (from, to) = (ratio(from)?, ratio(to)?);
        let count = count
            .trim()
            .parse()
            .ok()
            .filter(|count| (2..=MOST).contains(count));
        let count: usize = count.ok_or(format!("COUNT is a whole number from 2 to {MOST}"))?;
        if from == to {
            return Err(format!(
                "an empty sweep: FROM and TO are both {from}; give two values"
            ));
        }
        let last = (count - 1) as f64;
        let value = |k: usize| {
            if k + 1 == count {
                to
            } else {
                from + (to - from) * k as f64 / last
            }
        };
        Ok(ValueRange((0..count).map(value).collect()))
    }
}
