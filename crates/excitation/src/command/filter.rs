//! The filters of a planned command. They are stored in the recording, so that a replay needs no plan.

use serde::{Deserialize, Serialize};

use super::taps::Taps;

/// Reference filter and feedforward filter of a command. Every weight is finite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CommandFilter {
    /// From the planned reference to the reference of the loop; sum of the weights: 1.
    reference: Taps,
    /// From the planned reference in metres to the feedforward current, in amperes per metre; empty without feedforward.
    feedforward: Taps,
}

/// A filter that cannot run.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CommandFilterError {
    /// A weight is infinite or not a number.
    #[error(
        "the command filter has a weight that is not finite; check the model with `bench model modes`, and the settings control.shaper, control.prefilter and control.feedforward"
    )]
    NotFinite,
    /// It needs too long in each tick.
    #[error(
        "the command filter has {taps} taps and spans {ticks} ticks, above the limit of {max}; raise the frequencies of control.shaper, control.prefilter or control.feedforward"
    )]
    Long {
        /// Number of taps.
        taps: usize,
        /// Longest delay minus shortest delay.
        ticks: i64,
        /// The limit of both.
        max: usize,
    },
}

impl CommandFilter {
    /// Largest number of taps of both filters together, and of ticks from the shortest to the longest delay: with so many, a tick
    /// takes some 20 us.
    pub const MAX_TAPS: usize = 20_000;

    /// A command with these filters.
    ///
    /// # Errors
    /// For a weight that is not finite, and for more than 20,000 taps or ticks.
    pub fn new(reference: Taps, feedforward: Taps) -> Result<CommandFilter, CommandFilterError> {
        let filter = CommandFilter {
            reference,
            feedforward,
        };
        if !filter.all_taps().all(|tap| tap.weight.is_finite()) {
            return Err(CommandFilterError::NotFinite);
        }
        let (first, last) = filter.span_ticks();
        let (taps, ticks) = (filter.all_taps().count(), last.saturating_sub(first));
        let max = CommandFilter::MAX_TAPS;
        if taps > max || ticks > max as i64 {
            Err(CommandFilterError::Long { taps, ticks, max })
        } else {
            Ok(filter)
        }
    }

    /// The filter of the reference.
    pub fn reference(&self) -> &Taps {
        &self.reference
    }

    /// The filter of the feedforward current, in amperes per metre.
    pub fn feedforward(&self) -> &Taps {
        &self.feedforward
    }

    /// The shortest and the longest delay of both filters in ticks; the shortest is at most 0, the longest at least 0.
    pub fn span_ticks(&self) -> (i64, i64) {
        let spans = [self.reference.span_ticks(), self.feedforward.span_ticks()];
        let spans = spans.into_iter().flatten();
        spans.fold((0, 0), |(first, last), span| {
            (first.min(span.0), last.max(span.1))
        })
    }

    /// How far ahead the filters read the planned reference, in ticks.
    pub fn preview_ticks(&self) -> u64 {
        self.span_ticks().0.unsigned_abs()
    }

    fn all_taps(&self) -> impl Iterator<Item = &super::taps::Tap> {
        let feedforward = self.feedforward.as_slice();
        self.reference.as_slice().iter().chain(feedforward)
    }
}

impl<'de> Deserialize<'de> for CommandFilter {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Unchecked {
            reference: Vec<super::taps::Tap>,
            feedforward: Vec<super::taps::Tap>,
        }
        let unchecked = Unchecked::deserialize(deserializer)?;
        let (reference, feedforward) = (unchecked.reference, unchecked.feedforward);
        CommandFilter::new(Taps::new(reference), Taps::new(feedforward))
            .map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Tap;

    fn tap(delay_ticks: i64, weight: f64) -> Taps {
        Taps::new([Tap {
            delay_ticks,
            weight,
        }])
    }

    #[test]
    fn rejects_a_weight_that_is_not_finite() {
        for weight in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for (reference, feedforward) in [
                (tap(0, weight), Taps::default()),
                (Taps::identity(), tap(1, weight)),
            ] {
                let refused = CommandFilter::new(reference, feedforward);
                assert_eq!(refused, Err(CommandFilterError::NotFinite));
            }
        }
    }

    #[test]
    fn rejects_a_span_that_takes_too_long_in_a_tick() {
        for (first, last) in [(0, 20_001), (-20_001, 0), (i64::MIN, i64::MAX)] {
            let refused = CommandFilter::new(tap(first, 1.0), tap(last, 1.0));
            assert!(
                matches!(refused, Err(CommandFilterError::Long { .. })),
                "{first} {last}"
            );
        }
        assert!(CommandFilter::new(tap(-10_000, 1.0), tap(10_000, 1.0)).is_ok());
    }

    #[test]
    fn text_of_a_filter_keeps_every_bit() {
        let weights = [1.0 / 3.0, -1e-17, 6.02e23, f64::MIN_POSITIVE];
        let filter = CommandFilter::new(Taps::dense(-2, weights), Taps::dense(0, weights));
        let filter = filter.expect("finite");
        let text = toml::to_string(&filter).expect("TOML");
        assert_eq!(toml::from_str::<CommandFilter>(&text), Ok(filter));
    }
}
