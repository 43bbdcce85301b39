//! Filters as sums of delayed values.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Filters in series that span fewer ticks than this are convolved in a dense row.
const DENSE_TICKS: i64 = 1_000_000;

/// One term a x(k - d) of a filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tap {
    /// Delay d in ticks; negative for a value in the future.
    pub delay_ticks: i64,
    /// Weight a.
    pub weight: f64,
}

/// The filter y(k) = sum over its taps of a x(k - d). The taps have different delays, in rising order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Taps(Vec<Tap>);

impl Taps {
    /// The filter y = x.
    pub fn identity() -> Taps {
        Taps(vec![Tap {
            delay_ticks: 0,
            weight: 1.0,
        }])
    }

    /// A filter of any taps; those with equal delays are added.
    pub fn new(taps: impl IntoIterator<Item = Tap>) -> Taps {
        let mut by_delay = BTreeMap::new();
        for tap in taps {
            *by_delay.entry(tap.delay_ticks).or_insert(0.0) += tap.weight;
        }
        let taps = by_delay.into_iter();
        Taps(
            taps.map(|(delay_ticks, weight)| Tap {
                delay_ticks,
                weight,
            })
            .collect(),
        )
    }

    /// Weights in order, the first with the delay `first_ticks`, each of the others one tick later.
    pub fn dense(first_ticks: i64, weights: impl IntoIterator<Item = f64>) -> Taps {
        let taps = (first_ticks..).zip(weights);
        Taps::new(taps.map(|(delay_ticks, weight)| Tap {
            delay_ticks,
            weight,
        }))
    }

    /// A weight with a delay of any length, as linear interpolation between the two ticks around it. At the frequency w the
    /// amplitude is too small by at most (w T)^2/8.
    pub fn interpolated(delay_ticks: f64, weight: f64) -> [Tap; 2] {
        let whole = libm::floor(delay_ticks);
        let share = delay_ticks - whole;
        let delay_ticks = whole as i64;
        [
            Tap {
                delay_ticks,
                weight: weight * (1.0 - share),
            },
            Tap {
                delay_ticks: delay_ticks + 1,
                weight: weight * share,
            },
        ]
    }

    /// This filter and another one in series.
    pub fn in_series_with(&self, next: &Taps) -> Taps {
        match (self.span_ticks(), next.span_ticks()) {
            (Some((first, last)), Some((next_first, next_last)))
                if (last - first) + (next_last - next_first) < DENSE_TICKS =>
            {
                self.convolved(next, first + next_first)
            }
            _ => Taps::new(self.products(next)),
        }
    }

    fn products(&self, next: &Taps) -> impl Iterator<Item = Tap> {
        self.0.iter().flat_map(|first| {
            next.0.iter().map(|second| Tap {
                delay_ticks: first.delay_ticks + second.delay_ticks,
                weight: first.weight * second.weight,
            })
        })
    }

    /// The sum of the products over a dense row of ticks from `first` on. The two spans are short.
    fn convolved(&self, next: &Taps, first: i64) -> Taps {
        let mut weights: Vec<Option<f64>> = Vec::new();
        for tap in self.products(next) {
            let place = (tap.delay_ticks - first) as usize;
            if place >= weights.len() {
                weights.resize(place + 1, None);
            }
            *weights[place].get_or_insert(0.0) += tap.weight;
        }
        let taps = (first..).zip(weights);
        Taps(
            taps.filter_map(|(delay_ticks, weight)| {
                Some(Tap {
                    delay_ticks,
                    weight: weight?,
                })
            })
            .collect(),
        )
    }

    /// The taps, in rising order of their delays.
    pub fn as_slice(&self) -> &[Tap] {
        &self.0
    }

    /// The shortest and the longest delay in ticks; `None` without taps.
    pub fn span_ticks(&self) -> Option<(i64, i64)> {
        Some((self.0.first()?.delay_ticks, self.0.last()?.delay_ticks))
    }

    /// The sum of the weights: the gain at low frequency.
    pub fn sum(&self) -> f64 {
        self.0.iter().map(|tap| tap.weight).sum()
    }

    /// The filter times a factor.
    pub fn scaled(mut self, factor: f64) -> Taps {
        for tap in &mut self.0 {
            tap.weight *= factor;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_in_series_multiply_their_polynomials() {
        // (1 + 2 z^-1)(3 z - z^-1) = 3 z + 6 - z^-1 - 2 z^-2
        let first = Taps::dense(0, [1.0, 2.0]);
        let second = Taps::dense(-1, [3.0, 0.0, -1.0]);
        let product = Taps::dense(-1, [3.0, 6.0, -1.0, -2.0]);
        assert_eq!(first.in_series_with(&second), product);
        assert_eq!(product.span_ticks(), Some((-1, 2)));
        assert_eq!(product.sum(), 6.0);
    }

    #[test]
    fn interpolated_delay_is_exact_for_a_straight_line() {
        // x(k) = k delayed by 2.25 ticks is k - 2.25.
        let taps = Taps::new(Taps::interpolated(2.25, 1.0));
        let at_10: f64 = taps
            .as_slice()
            .iter()
            .map(|tap| tap.weight * (10 - tap.delay_ticks) as f64)
            .sum();
        assert_eq!(at_10, 7.75);
    }
}
